"""A method whose module cannot even be imported."""

raise RuntimeError("this plugin was written for another version")
