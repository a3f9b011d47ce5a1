"""Compiling before the first pair."""

from __future__ import annotations

from taskslam.slam.svo.odometry import SvoOdometry
from taskslam.slam.svo.settings import SvoSettings
from taskslam.slam.vision.made_up_drive import PINHOLE, made_up_drive
from taskslam.slam.vision.prediction import Prediction


def warm_up(settings: SvoSettings) -> None:
    """Track a made-up drive, every pair a keyframe, and forget it: no real pair waits for compilation."""
    changed = {"keyframe_lower": 10_000, "lost_features": 1, "align_coarsest": min(settings.align_coarsest, 4)}
    odometry = SvoOdometry(settings.model_copy(update=changed), PINHOLE, Prediction(settings.velocity_blend))
    for left, right, stamp in made_up_drive(3):
        odometry.process(left, right, stamp)
