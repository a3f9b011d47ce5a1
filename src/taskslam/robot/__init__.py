"""The robot: what it weighs on the floor, how it may drive, and which sensors it carries where."""

from taskslam.robot.robot import (
    Drive,
    Footprint,
    Lidar2D,
    OdometryNoise,
    Robot,
    SensorRig,
    load_robot,
    robot_presets,
)

__all__ = ["Drive", "Footprint", "Lidar2D", "OdometryNoise", "Robot", "SensorRig", "load_robot", "robot_presets"]
