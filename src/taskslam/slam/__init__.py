"""SLAM methods as guests: one small base class, a card that declares needs and abilities, and a host process."""

from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status

__all__ = ["Kind", "MapMode", "MethodCard", "PoseEstimate", "SlamMethod", "Status"]
