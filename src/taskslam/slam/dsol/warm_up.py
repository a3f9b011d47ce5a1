"""Compiling before the first pair."""

from __future__ import annotations

import numpy as np

from taskslam.slam.dsol.odometry import DsolOdometry
from taskslam.slam.dsol.settings import DsolSettings
from taskslam.slam.vision.made_up_drive import PINHOLE, made_up_drive
from taskslam.slam.vision.prediction import Prediction


def warm_up(settings: DsolSettings) -> None:
    """Track a made-up drive, every pair a keyframe, and forget it: no real pair waits for compilation."""
    changed = {"keyframe_ratio": 1.0, "levels": min(settings.levels, 4), "lost_share": 0.0, "lost_area": 0.0}
    prediction = Prediction(settings.velocity_blend, np.eye(3))
    odometry = DsolOdometry(settings.model_copy(update=changed), PINHOLE, prediction)
    for left, right, stamp in made_up_drive(3):
        odometry.process(left, right, stamp)
