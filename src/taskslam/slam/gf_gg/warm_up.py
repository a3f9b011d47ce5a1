"""Compiling before the first pair: a made-up drive past a wall is tracked, lost, found again and forgotten."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taskslam.measurements import NANOSECONDS
from taskslam.slam.gf_gg.motion import Motion
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.gf_gg.slam import GfGgSlam
from taskslam.slam.vision.made_up_drive import PINHOLE, SIDE, made_up_pair
from taskslam.slam.vision.pyramid import GreyImage

_STEP, _PAIRS = 6, 16  # pixels sideways from pair to pair
_EVERYTHING = {
    "features": 300,
    "least_inliers": 15,
    "least_relocalised": 15,
    "keyframe_gap": 1,
    "keyframe_ratio": 1.0,
    "full_frames": 2,
    "features_wanted": 60,
    "graph_threshold": 2,
    "virtual_frame_ahead": 1,
    "good_features": True,
    "good_graph": True,
    "loop_closing": True,
}


def warm_up(settings: GfGgSettings) -> GfGgSlam:
    """Go through all that a drive may ask for, so that no real pair waits for compilation; returns what was made."""
    slam = GfGgSlam(settings.model_copy(update=_EVERYTHING), PINHOLE, SIDE, SIDE, Motion(0.0))
    for left, right, stamp in _drive():
        slam.process(left, right, stamp)
    return slam


def _drive() -> Iterator[tuple[GreyImage, GreyImage, int]]:
    """Pairs and stamps, ns: sideways along the wall, a second of darkness, and the second view again."""
    period = NANOSECONDS // 30
    for number in range(_PAIRS):
        yield *made_up_pair(_STEP * number), number * period
    dark = np.zeros((SIDE, SIDE), np.uint8)
    yield dark, dark, _PAIRS * period + NANOSECONDS
    yield *made_up_pair(_STEP), _PAIRS * period + 2 * NANOSECONDS
