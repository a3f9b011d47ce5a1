"""Precision and accuracy over repeated runs of one recorded sequence, frame by frame (protocol 5.8).

The open-loop counterpart of a waypoint's metrics: a frame takes the place of the waypoint, a run that of the round, the
ground truth that of the goal. Only frames that every run has count, as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.evaluation.trajectory_rotations import mean_rotations, rotation_angles
from taskslam.geometry import FloatArray


@dataclass(frozen=True)
class FrameErrors:
    """Means over runs, one value a frame. position: (F,) metres; orientation: (F,) radians."""

    position: FloatArray
    orientation: FloatArray


def frame_accuracy(positions: FloatArray, quaternions: FloatArray, truth: FloatArray, turns: FloatArray) -> FrameErrors:
    """Mean over runs of the distance and the angle to the ground truth: e and delta of each frame.

    positions: (F, R, 3) metres; quaternions: (F, R, 4) x y z w; truth: (F, R, 3) and turns: (F, R, 4), the pose of the
    ground truth that belongs to each of them, all in its frame.
    """
    frames, runs = positions.shape[:2]
    angles = rotation_angles(turns.reshape(-1, 4), quaternions.reshape(-1, 4)).reshape(frames, runs)
    return FrameErrors(np.linalg.norm(positions - truth, axis=2).mean(axis=1), angles.mean(axis=1))


def frame_precision(positions: FloatArray, quaternions: FloatArray) -> FrameErrors:
    """Mean over runs of the distance and the angle to their mean pose: E and Delta of each frame.

    Position ||t_j - mean t||, orientation angle(mean R^T R_j), the mean rotation in the chordal sense (protocol 5.8).
    positions: (F, R, 3), quaternions: (F, R, 4), of at least two runs that lie in one common frame.
    """
    deviation = positions - positions.mean(axis=1, keepdims=True)
    return FrameErrors(np.linalg.norm(deviation, axis=2).mean(axis=1), _angles_to_mean(quaternions))


def published_frame_precision(positions: FloatArray, quaternions: FloatArray) -> FrameErrors:
    """The same by the published code (protocol 5.9 h): the translation of mean T * T_j^-1, mean t - mean R R_j^T t_j.

    It adds a lever arm: a run that is turned by an angle seems displaced by that angle times the distance from the
    origin, so the number depends on where the origin lies. 0.2 degrees at 10 m are 3.5 cm.
    """
    from scipy.spatial.transform import Rotation

    frames, runs = positions.shape[:2]
    mean = np.repeat(mean_rotations(quaternions), runs, axis=0)
    turned = Rotation.from_quat(mean) * Rotation.from_quat(quaternions.reshape(-1, 4)).inv()
    seen = turned.apply(positions.reshape(-1, 3)).reshape(frames, runs, 3)
    deviation = positions.mean(axis=1, keepdims=True) - seen
    return FrameErrors(np.linalg.norm(deviation, axis=2).mean(axis=1), _angles_to_mean(quaternions))


def _angles_to_mean(quaternions: FloatArray) -> FloatArray:
    frames, runs = quaternions.shape[:2]
    mean = np.repeat(mean_rotations(quaternions), runs, axis=0)
    angles: FloatArray = rotation_angles(mean, quaternions.reshape(-1, 4)).reshape(frames, runs).mean(axis=1)
    return angles
