"""The robot: what it weighs on the floor, how it may drive, and which sensors it carries where."""

from taskslam.robot.imperfections import Imperfections
from taskslam.robot.parts import Camera, Imu, Lidar2D, Lidar3D, Mount, Odometer, Part, StereoCamera
from taskslam.robot.robot import SENSOR_GROUP, Drive, Footprint, Robot, SensorRig, load_robot, robot_presets

__all__ = [
    "SENSOR_GROUP",
    "Camera",
    "Drive",
    "Footprint",
    "Imperfections",
    "Imu",
    "Lidar2D",
    "Lidar3D",
    "Mount",
    "Odometer",
    "Part",
    "Robot",
    "SensorRig",
    "StereoCamera",
    "load_robot",
    "robot_presets",
]
