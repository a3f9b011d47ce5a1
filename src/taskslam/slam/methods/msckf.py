"""`msckf`: an independent implementation of the stereo multi-state constraint Kalman filter.

From the papers: Sun et al., "Robust stereo visual inertial odometry for fast autonomous flight", RA-L 3(2), 2018;
Mourikis and Roumeliotis, ICRA 2007; Hesch et al., 2012, for the observability constraints. It shares no code with the
authors' program. Parameters and defaults: `slam/msckf/settings.py`.

Where it differs: a rectified pair gives three numbers a landmark and not four (`slam/msckf/observation.py`); it says
`lost` after half a second without features that hold, and where the IMU is silent. No map, no loop closure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import invert_se3
from taskslam.measurements import ImuSamples, Measurement, Sensor, StereoImages
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod
from taskslam.slam.lidar_support import need_imu
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.option_settings import read_options

if TYPE_CHECKING:
    from taskslam.slam.msckf.odometry import StereoInertialOdometry


class MsckfMethod(SlamMethod):
    """Stereo visual-inertial odometry. Options: the fields of `MsckfSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="msckf",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.STEREO_IMAGES, Sensor.IMU),
        summary="independent implementation of stereo MSCKF (Sun et al., RA-L 2018): visual-inertial odometry",
        needs_still_start=2.5,
        map_mode=MapMode.NONE,
        deterministic=True,
        latency=0.02,
        queue=1,
    )

    def __init__(self, **options: object) -> None:
        self._settings = read_options(MsckfSettings, "msckf", options)
        self._odometry: StereoInertialOdometry | None = None

    def start(self, rig: SensorRig) -> None:
        """Begin. Raises InputError if the robot has no stereo camera or no IMU."""
        if rig.stereo is None:
            raise InputError("msckf needs a stereo camera, and this robot's sensor rig has none (rig.stereo)")
        imu = need_imu("msckf", rig)
        from taskslam.slam.msckf.odometry import StereoInertialOdometry, warm_up  # numba: not to read a card

        warm_up(self._settings, rig.stereo)
        self._odometry = StereoInertialOdometry(self._settings, rig.stereo, imu)
        self._T_base_imu = imu.mount.matrix()
        self._T_imu_base = invert_se3(self._T_base_imu)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every pair; None for the IMU."""
        if self._odometry is None:
            raise InputError("msckf: call start before feed")
        if isinstance(measurement, ImuSamples):
            self._odometry.add(measurement)
        if not isinstance(measurement, StereoImages):
            return None
        outcome = self._odometry.process(measurement)
        T_start_base = self._T_base_imu @ outcome.T_world_imu @ self._T_imu_base
        R = self._T_base_imu[:3, :3]
        across = np.zeros((3, 6))
        across[:2, 3:] = R[:2]
        across[2, :3] = (R @ outcome.T_world_imu[:3, :3])[2]
        return PoseEstimate(measurement.stamp, T_start_base, outcome.status, across @ outcome.covariance @ across.T)
