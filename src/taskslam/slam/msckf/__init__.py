"""Stereo visual-inertial odometry by a multi-state constraint Kalman filter, implemented from the papers.

Sun et al., "Robust stereo visual inertial odometry for fast autonomous flight", RA-L 2018; Mourikis, Roumeliotis, "A
multi-state constraint Kalman filter for vision-aided inertial navigation", ICRA 2007; Hesch, Kottas, Bowman,
Roumeliotis, "Observability-constrained vision-aided inertial navigation", 2012. Read `odometry.py` first.
"""
