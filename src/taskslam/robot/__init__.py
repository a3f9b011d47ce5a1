"""The robot: what it weighs on the floor, how it may drive, and which sensors it carries where."""

from taskslam.robot.parts import Imu, Lidar2D, Lidar3D, OdometryNoise, StereoCamera
from taskslam.robot.robot import Drive, Footprint, Robot, SensorRig, load_robot, robot_presets

__all__ = [
    "Drive",
    "Footprint",
    "Imu",
    "Lidar2D",
    "Lidar3D",
    "OdometryNoise",
    "Robot",
    "SensorRig",
    "StereoCamera",
    "load_robot",
    "robot_presets",
]
