"""Cameras: models, calibration, recording."""
