"""Recordings: reading them, feeding them to a SLAM method, and evaluating the trajectories that come of it."""
