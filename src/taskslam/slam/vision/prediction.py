"""`Prediction`: where the camera should be by now, from its velocity and, where there is one, a gyro."""

from __future__ import annotations

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS, ImuSamples
from taskslam.slam.inertial.rotations import exp_so3, log_so3

_LONGEST_STEP_S = 0.5  # over which a velocity says anything
_LONGEST_SILENCE = NANOSECONDS // 20  # between two samples of a gyro that can be relied on


class Prediction:
    """Velocities of the camera in its own axes, smoothed, and the gyro's samples since the last frame.

    blend: the share of the old velocity that is kept. R_camera_imu: (3, 3), or None: without a gyro.
    """

    def __init__(self, blend: float, R_camera_imu: FloatArray | None = None) -> None:
        self._blend, self._R_camera_imu = blend, R_camera_imu
        self._stamps: list[int] = []
        self._rates: list[FloatArray] = []
        self.rest()

    def rest(self) -> None:
        """Expect no motion but what the gyro tells."""
        self._linear, self._angular = np.zeros(3), np.zeros(3)

    def hear(self, samples: ImuSamples) -> None:
        """Keep the gyro's samples for the next frame; those that are no numbers are passed over."""
        if self._R_camera_imu is None:
            return
        finite = np.isfinite(samples.angular_velocity).all(axis=1)
        self._stamps += samples.stamps[finite].tolist()
        self._rates += list(samples.angular_velocity[finite])

    def motions(self, since: int, stamp: int) -> list[FloatArray]:
        """(4, 4) `T_then_now` of the camera between two stamps, ns: what is likeliest, and what else it may be."""
        seconds = min((stamp - since) / NANOSECONDS, _LONGEST_STEP_S)
        by_velocity = np.eye(4)
        by_velocity[:3, :3] = exp_so3(self._angular * seconds)
        by_velocity[:3, 3] = self._linear * seconds
        turned = self._turned(since, stamp)
        if turned is None:
            return [by_velocity, np.eye(4)]
        by_gyro = by_velocity.copy()
        by_gyro[:3, :3] = turned
        return [by_gyro, by_velocity, np.eye(4)]

    def learn(self, T_then_now: FloatArray, since: int, stamp: int) -> None:
        """Take in how the camera did move between two stamps."""
        if stamp <= since:
            return
        seconds, keep = (stamp - since) / NANOSECONDS, self._blend
        self._linear = keep * self._linear + (1.0 - keep) * T_then_now[:3, 3] / seconds
        self._angular = keep * self._angular + (1.0 - keep) * log_so3(T_then_now[:3, :3]) / seconds

    def forget(self, stamp: int) -> None:
        """Drop the gyro's samples that no frame after `stamp`, ns, needs."""
        used = sum(at <= stamp for at in self._stamps)
        del self._stamps[:used], self._rates[:used]

    def _turned(self, since: int, stamp: int) -> FloatArray | None:
        """(3, 3) rotation by the gyro, a sample telling the mean since the one before; None if it was silent."""
        if self._R_camera_imu is None:
            return None
        R, at, rate = np.eye(3), since, np.zeros(3)
        for moment, rate in zip(self._stamps, self._rates, strict=True):
            if at < moment <= stamp:
                if moment - at > _LONGEST_SILENCE:
                    return None
                R = R @ exp_so3(self._R_camera_imu @ rate * ((moment - at) / NANOSECONDS))
                at = moment
        if stamp - at > _LONGEST_SILENCE or not self._stamps:
            return None
        turned: FloatArray = R @ exp_so3(self._R_camera_imu @ rate * ((stamp - at) / NANOSECONDS))
        return turned
