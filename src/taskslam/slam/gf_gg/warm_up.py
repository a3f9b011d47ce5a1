"""Compiling before the first pair: a made-up drive past a wall is tracked, lost, found again and forgotten."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from taskslam.measurements import NANOSECONDS
from taskslam.slam.gf_gg.motion import Motion
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.gf_gg.slam import GfGgSlam
from taskslam.slam.vision.pinhole import Pinhole

_SIDE, _BLOCK, _DISPARITY, _STEP, _PAIRS = 256, 8, 8, 6, 16
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
    slam = GfGgSlam(
        settings.model_copy(update=_EVERYTHING), Pinhole(160.0, _SIDE / 2, _SIDE / 2, 0.1), _SIDE, _SIDE, Motion(0.0)
    )
    for left, right, stamp in made_up_drive():
        slam.process(left, right, stamp)
    return slam


def made_up_drive() -> Iterator[tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8], int]]:
    """Left and right pictures and stamps, ns: sideways along tiles, a second of darkness, and the second view again."""
    tiles = np.random.Generator(np.random.PCG64(0)).integers(0, 256, (_SIDE // _BLOCK, 2 * _SIDE // _BLOCK))
    wall = np.kron(tiles, np.ones((_BLOCK, _BLOCK))).astype(np.uint8)
    views = [_STEP * number for number in range(_PAIRS)]
    period = NANOSECONDS // 30
    for number, at in enumerate(views):
        yield wall[:, at : at + _SIDE], wall[:, at + _DISPARITY : at + _DISPARITY + _SIDE], number * period
    dark = np.zeros((_SIDE, _SIDE), np.uint8)
    yield dark, dark, _PAIRS * period + NANOSECONDS
    at = views[1]
    yield (
        wall[:, at : at + _SIDE],
        wall[:, at + _DISPARITY : at + _DISPARITY + _SIDE],
        _PAIRS * period + 2 * NANOSECONDS,
    )
