"""What may be done to trajectories around an evaluation: a window of time, fewer poses, a lever arm, a plane.

The same as evo's options of these names, in evo's order: window and sampling before poses are associated, the plane
after the estimate was laid on the ground truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from taskslam.errors import TrajectoryError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS
from taskslam.record.trajectories import SpatialTrajectory


class Plane(StrEnum):
    """Into which trajectories may be projected: coordinates of the ground truth's frame."""

    XY = "xy"
    XZ = "xz"
    YZ = "yz"


_NORMAL = {Plane.XY: 2, Plane.XZ: 1, Plane.YZ: 0}


@dataclass(frozen=True)
class Preparation:
    """start_s, end_s: of the ground truth that counts (its clock, s); most_poses: evenly spaced ones that are kept.

    T_body_sensor: (4, 4), where the sensor whose poses a run holds sits on the body of the ground truth; plane: into
    which both are projected.
    """

    start_s: float | None = None
    end_s: float | None = None
    most_poses: int | None = None
    T_body_sensor: FloatArray | None = None
    plane: Plane | None = None

    def of_truth(self, truth: SpatialTrajectory) -> SpatialTrajectory:
        """The ground truth in the window. Raises TrajectoryError if nothing of it is."""
        inside = np.ones(len(truth), dtype=np.bool_)
        if self.start_s is not None:
            inside &= truth.stamps >= round(self.start_s * NANOSECONDS)
        if self.end_s is not None:
            inside &= truth.stamps <= round(self.end_s * NANOSECONDS)
        if not inside.any():
            span = f"{truth.stamps[0] / NANOSECONDS:.3f} s to {truth.stamps[-1] / NANOSECONDS:.3f} s"
            raise TrajectoryError(f"no pose of the ground truth lies in the window of time; it holds {span}")
        return self._sampled(truth[inside])

    def of_run(self, run: SpatialTrajectory) -> SpatialTrajectory:
        """The run, sampled, as poses of the body that the ground truth speaks of."""
        run = self._sampled(run)
        if self.T_body_sensor is None:
            return run
        return SpatialTrajectory.from_matrices(run.stamps, run.matrices() @ invert_se3(self.T_body_sensor))

    def _sampled(self, trajectory: SpatialTrajectory) -> SpatialTrajectory:
        if self.most_poses is None or len(trajectory) <= self.most_poses:
            return trajectory
        return trajectory[np.linspace(0, len(trajectory) - 1, self.most_poses, dtype=np.int64)]

    def projected(self, trajectory: SpatialTrajectory) -> SpatialTrajectory:
        """Into the plane: one coordinate is nothing, and the rotation that about its axis (fixed axes x y z)."""
        if self.plane is None:
            return trajectory
        from scipy.spatial.transform import Rotation

        normal = _NORMAL[self.plane]
        positions = trajectory.positions.copy()
        positions[:, normal] = 0.0
        angles = Rotation.from_quat(trajectory.quaternions).as_euler("xyz")[:, normal]
        turns = Rotation.from_rotvec(angles[:, None] * np.eye(3)[normal])
        return SpatialTrajectory(trajectory.stamps, positions, turns.as_quat())
