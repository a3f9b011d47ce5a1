"""What a set of calibration views lacks, in sentences that say what to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.calibration import GOOD_RMS_PX, Calibration

COLUMNS, ROWS = 8, 5

_ENOUGH_VIEWS = 15
_TILTED = np.radians(15.0)
_TILTED_SHARE = 0.3
_SURE_FOCAL = 0.002
_SURE_IMAGE_PX = 1.0
_EDGE_WORDS = (
    ("upper left", "top", "upper right"),
    ("left", "middle", "right"),
    ("lower left", "bottom", "lower right"),
)


def coverage(pixels: Sequence[FloatArray], size: tuple[int, int]) -> npt.NDArray[np.int64]:
    """(5, 8) number of corners seen in each part of the image. pixels: (N, 2) of each view; size: width and height."""
    every = np.concatenate([np.empty((0, 2)), *pixels])
    counts, *_ = np.histogram2d(
        every[:, 1], every[:, 0], bins=(ROWS, COLUMNS), range=((-0.5, size[1] - 0.5), (-0.5, size[0] - 0.5))
    )
    return np.asarray(counts, np.int64)


def guidance(calibration: Calibration) -> list[str]:
    """What would make the calibration better, most urgent first; empty where it is good."""
    camera, used = calibration.camera, calibration.used
    advice = []
    if calibration.rms > GOOD_RMS_PX:
        advice.append(
            f"The reprojection error is {calibration.rms:.2f} px, above {GOOD_RMS_PX:g} px: is the board flat and "
            "stiff, is the focus fixed, do the millimetres in the board's name agree with a ruler?"
        )
    if len(used) < _ENOUGH_VIEWS:
        advice.append(f"Only {len(used)} views are used: take 20 to 40.")
    bare = _bare(coverage([f.view.pixels for f in used], (camera.width, camera.height)))
    if bare:
        advice.append(
            f"No corner was seen at the {_listed(bare)} of the image: hold the board there, partly outside too."
        )
    advice.extend(_tilt_advice(np.array([f.tilt for f in used])))
    focal, deviation = calibration.parameters[0][1:]
    if deviation > _SURE_FOCAL * focal:
        advice.append(
            f"The focal length is only known to {100 * deviation / focal:.1f} %: take more tilted, near views."
        )
    worst = float(calibration.uncertainty.image.max())
    if not worst <= _SURE_IMAGE_PX:
        row, column = np.unravel_index(
            int(np.nanargmax(calibration.uncertainty.image)), calibration.uncertainty.image.shape
        )
        rows, columns = calibration.uncertainty.image.shape
        where = _EDGE_WORDS[3 * int(row) // rows][3 * int(column) // columns]
        advice.append(f"At the {where} the lens is only known to {worst:.1f} px: take views with the board there.")
    return advice


def _bare(counts: npt.NDArray[np.int64]) -> list[str]:
    """Names of the nine parts of the image of which less than a third was seen."""
    names = []
    rows, columns = np.arange(ROWS) * 3 // ROWS, np.arange(COLUMNS) * 3 // COLUMNS
    for i, words in enumerate(_EDGE_WORDS):
        for j, word in enumerate(words):
            if (counts[np.ix_(rows == i, columns == j)] > 0).mean() < 1 / 3:
                names.append(word)
    return names


def _tilt_advice(tilts: FloatArray) -> list[str]:
    """tilts: (V, 2) how the board leans to the right and down in each view, rad."""
    leaning = np.abs(tilts) > _TILTED
    if leaning.any(1).mean() < _TILTED_SHARE:
        return ["Few views are tilted: without tilt focal length and distance look alike; tilt the board by 20 to 40°."]
    if not leaning[:, 0].any():
        return ["The board was never turned to the left or right: turn it by 20 to 40° in some views."]
    if not leaning[:, 1].any():
        return ["The board was never tipped forwards or backwards: tip it by 20 to 40° in some views."]
    return []


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
