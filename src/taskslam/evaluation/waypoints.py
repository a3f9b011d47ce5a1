"""Accuracy and precision of the visits to one waypoint (eqs. (1) and (2) of the paper; protocol 5.2).

With visits (x_j, y_j, theta_j), goal (x*, y*, theta*), and wrap(a) = atan2(sin a, cos a):

    e     = mean_j |z_j - z*|              how far from the goal        position accuracy
    delta = mean_j |wrap(theta_j - theta*)|                             orientation accuracy
    E     = mean_j |z_j - mean z|          how far from one another     position precision
    Delta = mean_j |wrap(theta_j - mean theta)|                         orientation precision

Means of norms with 1/M, not RMS and not standard deviations (protocol D0.7). The mean heading is the circular one.
Visits are (V, 3) arrays of x, y in metres and theta in radians; visits and goal share any one frame. What is not
defined (accuracy without a visit, precision with fewer than two) is NaN.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.geometry import FloatArray, mean_heading, wrap


def position_accuracy(visits: FloatArray, goal: FloatArray) -> float:
    """Position accuracy e in metres: mean distance of (V, 3) visits to the goal (3,).

    NaN without a visit. Eq. (1), protocol 5.2.
    """
    return float(_distances(visits, goal[:2]).mean()) if len(visits) else math.nan


def orientation_accuracy(visits: FloatArray, goal: FloatArray, upstream_compat: bool = False) -> float:
    """Orientation accuracy delta in radians: mean |wrap(theta_j - theta*)|.

    NaN without a visit. Protocol 5.2.

    upstream_compat: the published code's mean of arccos(u_j . u*), not clipped, so that a heading which equals the
    goal's can round to NaN and then silently leaves the mean (protocol 5.9 b).
    """
    if not len(visits):
        return math.nan
    if upstream_compat:
        return _mean_arccos(visits[:, 2], np.array([math.cos(goal[2]), math.sin(goal[2])]))
    return float(np.abs(wrap(visits[:, 2] - goal[2])).mean())


def position_precision(visits: FloatArray) -> float:
    """Position precision E in metres: mean distance of (V, 3) visits to their mean.

    NaN below two visits. Eq. (2), protocol 5.2.
    """
    if len(visits) < 2:
        return math.nan
    return float(_distances(visits, visits[:, :2].mean(axis=0)).mean())


def position_precision_rms(visits: FloatArray) -> float:
    """Root of the mean squared distance to the mean, metres: what E would be as an RMS (protocol 7.3 #5)."""
    if len(visits) < 2:
        return math.nan
    return float(np.sqrt((_distances(visits, visits[:, :2].mean(axis=0)) ** 2).mean()))


def orientation_precision(visits: FloatArray, upstream_compat: bool = False) -> float:
    """Orientation precision Delta in radians: mean |wrap(theta_j - circular mean)|.

    NaN below two visits. Eq. (2), protocol 5.2.

    upstream_compat: the published code's mean of arccos(u_j . u) with the mean direction u not normalised, about 1.6
    times too large at five visits, and not clipped (protocol 5.9 a, b).
    """
    if len(visits) < 2:
        return math.nan
    theta = visits[:, 2]
    if upstream_compat:
        return _mean_arccos(theta, np.array([np.cos(theta).mean(), np.sin(theta).mean()]))
    return float(np.abs(wrap(theta - mean_heading(theta))).mean())


def mean_pose(visits: FloatArray) -> FloatArray:
    """(3,) mean position and circular mean heading of (V, 3) visits; NaN without a visit (protocol 5.2)."""
    if not len(visits):
        return np.full(3, math.nan)
    return np.array([*visits[:, :2].mean(axis=0), mean_heading(visits[:, 2])])


def _distances(visits: FloatArray, point: FloatArray) -> FloatArray:
    distances: FloatArray = np.hypot(visits[:, 0] - point[0], visits[:, 1] - point[1])
    return distances


def _mean_arccos(theta: FloatArray, direction: FloatArray) -> float:
    with np.errstate(invalid="ignore"):
        angles = np.arccos(np.cos(theta) * direction[0] + np.sin(theta) * direction[1])
    kept = angles[~np.isnan(angles)]
    return float(kept.mean()) if len(kept) else math.nan
