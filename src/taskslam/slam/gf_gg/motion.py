"""`Motion`: where the camera should be by now, by its last motion or, where that is the prior, by the wheels."""

from __future__ import annotations

import numpy as np

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import WheelOdometry
from taskslam.slam.karto.odometry_history import OdometryHistory
from taskslam.slam.vision.prediction import Prediction


class Motion:
    """T_base_camera: (4, 4), given where the wheels are heard; None: without them. blend: as in `Prediction`."""

    def __init__(self, blend: float, T_base_camera: FloatArray | None = None) -> None:
        self._velocity = Prediction(blend)
        self._wheels = OdometryHistory()
        self._T_base_camera = T_base_camera
        self._step = np.eye(4)

    @property
    def by_wheels(self) -> bool:
        """Whether the wheels tell where the camera goes."""
        return len(self._wheels) > 0

    def hear(self, sample: WheelOdometry) -> None:
        """Keep the newest of the wheels."""
        if self._T_base_camera is not None:
            self._wheels.add(sample)

    def expected(self, since: int, stamp: int) -> list[FloatArray]:
        """(4, 4) `T_then_now` of the camera between two stamps, ns: what is likeliest, and what else it may be."""
        motions = self._velocity.motions(since, stamp)
        if self._T_base_camera is None or not self.by_wheels:
            return motions
        then, now = self._wheels.at(since), self._wheels.at(stamp)
        T_then_now = (then.inverse() @ now).matrix()
        return [invert_se3(self._T_base_camera) @ T_then_now @ self._T_base_camera, *motions]

    def learn(self, T_then_now: FloatArray, since: int, stamp: int, jumped: bool) -> None:
        """Take in how the camera did move between two stamps, unless it was found somewhere else."""
        if jumped:
            self.rest()
            return
        self._velocity.learn(T_then_now, since, stamp)
        self._step = T_then_now

    def ahead(self, frames: int) -> FloatArray:
        """(4, 4) pose of the camera so many frames from now, in its own axes, if it goes on as it does."""
        return np.asarray(np.linalg.matrix_power(self._step, frames), np.float64)

    def rest(self) -> None:
        """Expect no motion."""
        self._velocity.rest()
        self._step = np.eye(4)
