"""Absolute and relative trajectory error (ATE, RPE), as evo defines them, over whole arrays.

J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012, eqs. (1) to (6). Rows of estimate
and reference belong together (`associate`); alignment is a step of its own. All errors are kept per pose or pair, so
that any statistic can be had of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.evaluation.trajectory_pairs import Pairs
from taskslam.evaluation.trajectory_rotations import angle, between, rotation_angles
from taskslam.geometry import FloatArray
from taskslam.record.trajectories import SpatialTrajectory


@dataclass(frozen=True)
class PoseErrors:
    """Errors of N poses or pairs. translation: (N,) metres; rotation: (N,) angles in [0, pi] radians.

    Two more numbers that evo has follow from these: `rotation_part` and `full`, without unit.
    """

    translation: FloatArray
    rotation: FloatArray

    @property
    def rotation_part(self) -> FloatArray:
        """Frobenius norm of R - I, which is sqrt(8) sin(angle / 2)."""
        part: FloatArray = math.sqrt(8) * np.sin(self.rotation / 2)
        return part

    @property
    def full(self) -> FloatArray:
        """Frobenius norm of T - I of the error transform: metres and radians in one, for comparison with evo only."""
        return np.hypot(self.translation, self.rotation_part)


@dataclass(frozen=True)
class Statistics:
    """Of errors, in their unit; std divides by N, as evo's does."""

    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float

    @staticmethod
    def of(errors: FloatArray) -> Statistics:
        """Of (N,) errors, N at least 1."""
        return Statistics(
            rmse=math.sqrt(float(np.mean(errors * errors))),
            mean=float(np.mean(errors)),
            median=float(np.median(errors)),
            std=float(np.std(errors)),
            min=float(np.min(errors)),
            max=float(np.max(errors)),
        )


def absolute_errors(reference: SpatialTrajectory, estimate: SpatialTrajectory) -> PoseErrors:
    """ATE (evo: APE) of each of N poses: ||t_est - t_ref|| and the angle of R_est^T R_ref."""
    difference = estimate.positions - reference.positions
    return PoseErrors(
        np.sqrt(np.einsum("ij,ij->i", difference, difference)),
        rotation_angles(reference.quaternions, estimate.quaternions),
    )


def relative_errors(reference: SpatialTrajectory, estimate: SpatialTrajectory, pairs: Pairs) -> PoseErrors:
    """RPE of each pair (i, j): E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) of reference Q and estimate P."""
    count = len(pairs.first)
    errors = PoseErrors(np.empty(count), np.empty(count))
    _relative_errors(
        np.ascontiguousarray(reference.positions),
        np.ascontiguousarray(reference.quaternions),
        np.ascontiguousarray(estimate.positions),
        np.ascontiguousarray(estimate.quaternions),
        pairs.first,
        pairs.second,
        errors.translation,
        errors.rotation,
    )
    return errors


def relative_distance_errors(reference: SpatialTrajectory, estimate: SpatialTrajectory, pairs: Pairs) -> FloatArray:
    """(P,) metres: by how much the straight distance from i to j differs (evo: point distance); needs no alignment."""
    wanted, found = (
        np.linalg.norm(trajectory.positions[pairs.second] - trajectory.positions[pairs.first], axis=1)
        for trajectory in (reference, estimate)
    )
    difference: FloatArray = np.abs(wanted - found)
    return difference


@njit(cache=True)
def _step(
    positions: FloatArray, quaternions: FloatArray, i: int, j: int
) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    """Translation and rotation of T_i^-1 T_j."""
    q = quaternions[i]
    x, y, z = -q[0], -q[1], -q[2]  # the inverse rotation
    dx = positions[j, 0] - positions[i, 0]
    dy = positions[j, 1] - positions[i, 1]
    dz = positions[j, 2] - positions[i, 2]
    cx, cy, cz = y * dz - z * dy + q[3] * dx, z * dx - x * dz + q[3] * dy, x * dy - y * dx + q[3] * dz
    moved = (dx + 2.0 * (y * cz - z * cy), dy + 2.0 * (z * cx - x * cz), dz + 2.0 * (x * cy - y * cx))
    return moved, between(q, quaternions[j])


@njit(cache=True)
def _relative_errors(
    reference_positions: FloatArray,
    reference_quaternions: FloatArray,
    positions: FloatArray,
    quaternions: FloatArray,
    first: npt.NDArray[Any],
    second: npt.NDArray[Any],
    translation: FloatArray,
    rotation: FloatArray,
) -> None:
    wanted, found = np.empty(4), np.empty(4)
    for pair in range(len(first)):
        i, j = first[pair], second[pair]
        q_step, q_turn = _step(reference_positions, reference_quaternions, i, j)
        p_step, p_turn = _step(positions, quaternions, i, j)
        dx, dy, dz = p_step[0] - q_step[0], p_step[1] - q_step[1], p_step[2] - q_step[2]
        translation[pair] = math.sqrt(dx * dx + dy * dy + dz * dz)
        for k in range(4):
            wanted[k], found[k] = q_turn[k], p_turn[k]
        rotation[pair] = angle(between(wanted, found))
