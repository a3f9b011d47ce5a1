"""The iterated Kalman filter: the most likely state after a scan (FAST-LIO2, Sec. IV-D, eqs. (14) to (18)).

The gain is in the form of FAST-LIO (RA-L 2021, eq. (20)), whose inverse has the size of the state and not that of the
measurement.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.fast_lio2.planes import COLUMNS, find_planes, residuals
from taskslam.slam.fast_lio2.state import DIMENSIONS, State, minus, minus_jacobian, plus
from taskslam.slam.fast_lio2.voxel_map import Keys

# The error's R, p and the extrinsic, to which a measurement belongs.
_MEASURED = np.array([0, 1, 2, 3, 4, 5, 15, 16, 17, 18, 19, 20])


class Matching(NamedTuple):
    """What an update goes by: fields of `FastLio2Settings`."""

    neighbours: int
    neighbour_distance: float
    plane_tolerance: float
    match_score: float
    point_cov: float
    converged: float
    max_iteration: int
    extrinsic: bool
    refresh_neighbours: bool


class Updated(NamedTuple):
    """x, P: state and covariance. matched: points that lay on planes; passes: iterations.

    placed: points near which the map has a plane at all. information: (3, 3) mean of n n^T, n being the normals of
    those planes that leave no doubt.
    """

    x: State
    P: FloatArray
    matched: int
    passes: int
    placed: int
    information: FloatArray


@njit(cache=True)
def step(  # type: ignore[no-untyped-def]
    predicted: State, P: FloatArray, x: State, r: FloatArray, H: FloatArray, point_cov: float
):
    """One pass about x; returns the (23,) step and the covariance if it were the last.

    predicted, P: before the scan. r, H: (K,) residuals and (K, 12) derivatives at x. point_cov: variance of each r.
    """
    # The prior about x instead of about the prediction: eqs. (13) and (14).
    J_inverse = np.linalg.inv(minus_jacobian(x, predicted))
    prior = J_inverse @ P @ J_inverse.T
    information = (H.T @ H) / point_cov
    pull = (H.T @ r) / point_cov
    total = np.linalg.inv(prior)
    for a in range(COLUMNS):
        for b in range(COLUMNS):
            total[_MEASURED[a], _MEASURED[b]] += information[a, b]
    after = np.linalg.inv(total)
    gain_H = np.zeros((DIMENSIONS, DIMENSIONS))
    kicked = np.zeros(DIMENSIONS)
    for i in range(DIMENSIONS):
        for b in range(COLUMNS):
            for a in range(COLUMNS):
                gain_H[i, _MEASURED[b]] += after[i, _MEASURED[a]] * information[a, b]
            kicked[i] += after[i, _MEASURED[b]] * pull[b]
    back = J_inverse @ minus(x, predicted)
    return gain_H @ back - back - kicked, 0.5 * (after + after.T)


@njit(cache=True)
def update(
    predicted: State, P: FloatArray, points: FloatArray, keys: Keys, table: FloatArray, size: float, matching: Matching
) -> Updated:
    """The state that agrees best with the prediction and with (N, 3) points on the map.

    Neighbours are sought at the prediction, and again where the iteration has converged, or before the last pass.
    """
    x, after = predicted, P
    planes = np.zeros((len(points), 5))
    search, arrivals = True, 0
    passes, matched = 0, 0
    for index in range(matching.max_iteration + 1):
        if search:
            planes = find_planes(
                keys,
                table,
                size,
                points,
                x,
                matching.neighbours,
                matching.neighbour_distance,
                matching.plane_tolerance,
            )
        r, H = residuals(points, planes, x, matching.match_score, matching.extrinsic)
        matched, passes = len(r), index + 1
        if matched == 0:
            break
        d, after = step(predicted, P, x, r, H, matching.point_cov)
        x = plus(x, d)
        arrived = np.max(np.abs(d)) < matching.converged
        arrivals += 1 if arrived else 0
        if arrivals > (1 if matching.refresh_neighbours else 0):
            break
        search = matching.refresh_neighbours and (arrived or index == matching.max_iteration - 1)
    placed, sharp, information = 0, 0, np.zeros((3, 3))
    for n in range(len(planes)):
        if planes[n, 0] != 0.0 or planes[n, 1] != 0.0 or planes[n, 2] != 0.0:
            placed += 1
        if planes[n, 4] > 0.0:
            sharp += 1
            for a in range(3):
                for b in range(3):
                    information[a, b] += planes[n, a] * planes[n, b]
    return Updated(x, after, matched, passes, placed, information / max(1, sharp))
