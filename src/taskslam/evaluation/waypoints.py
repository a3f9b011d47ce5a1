"""Accuracy and precision of the visits to waypoints (eqs. (1) and (2) of the paper; protocol 5.2).

With visits (x_j, y_j, theta_j), goal (x*, y*, theta*), and wrap(a) = atan2(sin a, cos a):

    e     = mean_j |z_j - z*|              how far from the goal        position accuracy
    delta = mean_j |wrap(theta_j - theta*)|                             orientation accuracy
    E     = mean_j |z_j - mean z|          how far from one another     position precision
    Delta = mean_j |wrap(theta_j - mean theta)|                         orientation precision

Means of norms with 1/M, not RMS and not standard deviations (protocol D0.7). The mean heading is the circular one.
Visits are (..., V, 3) arrays of x, y in metres and theta in radians, goals (..., 3), in any one frame; the leading axes
are waypoints. A row of NaN is a round without a visit and is left out. What is not defined (accuracy without a visit,
precision with fewer than two) is NaN. For poses in SE(3): `trajectory_precision.py`, where a frame is a waypoint.
"""

from __future__ import annotations

import numpy as np

from taskslam.evaluation.upstream import NONE, Deviation, Deviations
from taskslam.geometry import FloatArray, wrap


def position_accuracy(visits: FloatArray, goal: FloatArray) -> FloatArray:
    """Position accuracy e in metres: mean distance to the goal. Eq. (1), protocol 5.2."""
    return known_mean(_distances(visits, goal))


def orientation_accuracy(visits: FloatArray, goal: FloatArray, deviations: Deviations = NONE) -> FloatArray:
    """Orientation accuracy delta in radians: mean |wrap(theta_j - theta*)|. Protocol 5.2; deviation b."""
    return known_mean(_angles(visits[..., 2], np.cos(goal[..., 2]), np.sin(goal[..., 2]), deviations))


def position_precision(visits: FloatArray) -> FloatArray:
    """Position precision E in metres: mean distance to the mean. Eq. (2), protocol 5.2."""
    return known_mean(_distances(visits, mean_pose(visits)), fewest=2)


def position_precision_rms(visits: FloatArray) -> FloatArray:
    """Root of the mean squared distance to the mean, metres: what E would be as an RMS (protocol 7.3 #5)."""
    return np.asarray(np.sqrt(known_mean(_distances(visits, mean_pose(visits)) ** 2, fewest=2)))


def orientation_precision(visits: FloatArray, deviations: Deviations = NONE) -> FloatArray:
    """Orientation precision Delta in radians: mean |wrap(theta_j - circular mean)|.

    Eq. (2), protocol 5.2; deviations a and b.
    """
    theta = visits[..., 2]
    c, s = known_mean(np.cos(theta), fewest=2), known_mean(np.sin(theta), fewest=2)
    if Deviation.UNNORMALISED_HEADING not in deviations:
        angle = np.arctan2(s, c)
        c, s = np.cos(angle), np.sin(angle)
    return known_mean(_angles(theta, c, s, deviations))


def mean_pose(visits: FloatArray) -> FloatArray:
    """(..., 3) mean position and circular mean heading; NaN without a visit (protocol 5.2)."""
    x, y, theta = np.moveaxis(visits, -1, 0)
    means = known_mean(np.stack([x, y, np.cos(theta), np.sin(theta)]))
    return np.stack([means[0], means[1], np.arctan2(means[3], means[2])], axis=-1)


def known_mean(values: FloatArray, fewest: int = 1) -> FloatArray:
    """Mean over the last axis of what is not NaN; NaN where fewer than `fewest` are left."""
    known = ~np.isnan(values)
    count = known.sum(axis=-1)
    total = np.where(known, values, 0.0).sum(axis=-1)
    return np.where(count >= fewest, total / np.maximum(count, 1), np.nan)


def _distances(visits: FloatArray, point: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(visits[..., 0] - point[..., None, 0], visits[..., 1] - point[..., None, 1]))


def _angles(theta: FloatArray, c: FloatArray, s: FloatArray, deviations: Deviations) -> FloatArray:
    """(..., V) angle between each heading and the direction (c, s); the published forms go by arccos."""
    if Deviation.UNNORMALISED_HEADING not in deviations and Deviation.UNCLIPPED_ARCCOS not in deviations:
        return np.abs(wrap(theta - np.arctan2(s, c)[..., None]))
    cosine = np.cos(theta) * c[..., None] + np.sin(theta) * s[..., None]
    if Deviation.UNCLIPPED_ARCCOS not in deviations:
        cosine = np.clip(cosine, -1.0, 1.0)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.arccos(cosine))
