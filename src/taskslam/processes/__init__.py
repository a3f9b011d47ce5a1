"""Child processes of any kind: messages over pipes, and confinement."""
