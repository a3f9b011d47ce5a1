"""LiDAR-inertial odometry by an iterated Kalman filter over a voxel map: FAST-LIO2, implemented from the papers.

Xu, Cai, He, Lin, Zhang, "FAST-LIO2: fast direct LiDAR-inertial odometry", T-RO 2022; Xu, Zhang, "FAST-LIO", RA-L 2021,
for the gain. Read `odometry.py` first: `LidarInertialOdometry.process` is the method as a list of steps.
"""
