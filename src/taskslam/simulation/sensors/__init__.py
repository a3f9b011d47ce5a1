"""The simulated sensors and their noise."""
