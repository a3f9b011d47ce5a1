"""Compiling before the first pair: a made-up drive is tracked and forgotten."""

from __future__ import annotations

import numpy as np

from taskslam.measurements import NANOSECONDS
from taskslam.slam.dsol.odometry import DsolOdometry
from taskslam.slam.dsol.prediction import Prediction
from taskslam.slam.dsol.settings import DsolSettings
from taskslam.slam.vision.pinhole import Pinhole

_SIDE, _BLOCK, _DISPARITY, _STEP = 160, 8, 8, 3


def warm_up(settings: DsolSettings) -> None:
    """Pass a wall of random tiles sideways, every pair a keyframe, so that no real pair waits for compilation."""
    tiles = np.random.Generator(np.random.PCG64(0)).integers(0, 256, (_SIDE // _BLOCK, 2 * _SIDE // _BLOCK))
    wall = np.kron(tiles, np.ones((_BLOCK, _BLOCK))).astype(np.uint8)
    changed = {"keyframe_ratio": 1.0, "levels": min(settings.levels, 4), "lost_share": 0.0, "lost_area": 0.0}
    odometry = DsolOdometry(
        settings.model_copy(update=changed),
        Pinhole(100.0, _SIDE / 2, _SIDE / 2, 0.1),
        Prediction(settings.velocity_blend, np.eye(3)),
    )
    for number in range(3):
        left = _STEP * number + _DISPARITY
        view, other = (np.ascontiguousarray(wall[:, at : at + _SIDE]) for at in (left, left + _DISPARITY))
        odometry.process(view, other, number * NANOSECONDS // 30)
