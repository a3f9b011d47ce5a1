"""Whether a scan may be believed. FAST-LIO2 itself never says that it is lost.

A scan is refused if it has too few points, if too few of them lie on planes of the map, if too many lie beside planes
that the map has there, or if it would move the robot farther from where the IMU has it than an IMU errs in that time. A
refused scan changes neither state nor map. One that lies on the map, but leaves a direction open, as the walls of a
bare corridor do, is taken, and its pose is `lost`; so is one whose standard deviation is too large. The preset `indoor`
notices a bare corridor: there the share of normals along it is 0.014 to 0.033, and in the corridors of our hospital,
with doors and niches, 0.05 and more. With the published voxels of half a metre the normals are too rough to tell the
two apart, and the published settings do not ask.

On tours of four places at least 0.90 of the points with a plane lay on it, usually 0.99. A robot that was carried
0.6 m or more, or to another room, made it 0.3 to 0.68: a filter that believes such a scan settles where it fits best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.slam.fast_lio2.iterated_filter import Updated
from taskslam.slam.fast_lio2.settings import FastLio2Settings
from taskslam.slam.fast_lio2.state import State, minus

_DEVIATIONS, _AT_MOST = 3.0, 2.0  # of the prediction; times the largest correction


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a scan had to say. points: of the thinned scan; matched: share of them on planes of the map.

    fit: share on their planes of those near which the map has one.

    correction, turn: m and rad by which it moves the prediction; allowed, allowed_turn: the most that is believed.
    weakest: share of the planes' normals along the direction in which they say least, 1/3 at best.
    """

    points: int
    matched: float
    fit: float
    correction: float
    turn: float
    allowed: float
    allowed_turn: float
    weakest: float


def evidence(points: int, predicted: State, P: FloatArray, found: Updated, settings: FastLio2Settings) -> Evidence:
    """Weigh an update. P: (23, 23) covariance of the prediction."""
    moved = minus(found.x, predicted)
    deviation = np.sqrt(np.diag(P))
    return Evidence(
        points,
        found.matched / max(1, points),
        found.matched / max(1, found.placed),
        float(np.linalg.norm(moved[3:6])),
        float(np.linalg.norm(moved[:3])),
        _allowed(settings.largest_correction, float(deviation[3:6].max())),
        _allowed(settings.largest_turn, float(deviation[:3].max())),
        float(np.linalg.eigvalsh(found.information)[0]),
    )


def believed(seen: Evidence, settings: FastLio2Settings) -> bool:
    """Whether state and map may take the scan."""
    return (
        seen.points >= settings.least_points
        and seen.matched >= settings.least_matched
        and seen.fit >= settings.least_fit
        and seen.correction <= seen.allowed
        and seen.turn <= seen.allowed_turn
    )


def _allowed(limit: float, deviation: float) -> float:
    return min(limit + _DEVIATIONS * deviation, _AT_MOST * limit)


def certain(seen: Evidence, P: FloatArray, settings: FastLio2Settings) -> bool:
    """Whether a scan that was believed says where the robot is, in every direction. P: (23, 23), after the scan."""
    deviation = float(np.sqrt(np.linalg.eigvalsh(P[3:6, 3:6])[-1]))
    return seen.weakest >= settings.weakest_direction and deviation <= settings.largest_deviation
