"""Pose accuracy AP and pose repeatability RP as robot makers state them (ISO 9283:1998, 7.2).

    AP_p = |mean z - z*|                       the mean position against the commanded one
    RP_l = mean_j l_j + 3 S_l                  l_j = |z_j - mean z|,  S_l = sqrt(sum_j (l_j - mean l)^2 / (M - 1))
    AP_c = |wrap(mean theta - theta*)|,  RP_c = 3 S_c,  S_c = sqrt(sum_j wrap(theta_j - mean theta)^2 / (M - 1))

The standard asks for 30 cycles; five rounds give S with 4 degrees of freedom. Visits and goals as in `waypoints.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.evaluation.waypoints import known_mean, mean_pose
from taskslam.geometry import FloatArray, wrap


@dataclass(frozen=True, slots=True)
class Iso9283:
    """AP and RP of shape (...), in metres and radians. AP is NaN without a visit, RP below two."""

    pose_accuracy_m: FloatArray
    pose_repeatability_m: FloatArray
    pose_accuracy_rad: FloatArray
    pose_repeatability_rad: FloatArray


def iso9283(visits: FloatArray, goal: FloatArray) -> Iso9283:
    """AP and RP of (..., V, 3) visits to goals (..., 3)."""
    mean = mean_pose(visits)
    distances = np.hypot(visits[..., 0] - mean[..., None, 0], visits[..., 1] - mean[..., None, 1])
    average = known_mean(distances, fewest=2)
    turns = wrap(visits[..., 2] - mean[..., None, 2])
    return Iso9283(
        pose_accuracy_m=np.asarray(np.hypot(mean[..., 0] - goal[..., 0], mean[..., 1] - goal[..., 1])),
        pose_repeatability_m=average + 3 * _sample_deviation(distances - average[..., None]),
        pose_accuracy_rad=np.abs(wrap(mean[..., 2] - goal[..., 2])),
        pose_repeatability_rad=3 * _sample_deviation(turns),
    )


def _sample_deviation(residuals: FloatArray) -> FloatArray:
    """Root of the sum of squares over (M - 1) of what is not NaN; NaN below two."""
    count = (~np.isnan(residuals)).sum(axis=-1)
    return np.asarray(np.sqrt(known_mean(residuals**2, fewest=2) * count / np.maximum(count - 1, 1)))
