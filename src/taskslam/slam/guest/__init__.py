"""A method as a guest in a process of its own: host and child, messages, latency, pacing."""
