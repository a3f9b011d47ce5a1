"""TaskSLAM-Bench: SLAM inside the navigation loop, and how repeatably the robot arrives."""

__version__ = "0.1.0"
