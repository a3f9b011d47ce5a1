"""`rko_lio`: the adapter of RKO-LIO, LiDAR-inertial odometry that needs no model of its sensors (Malladi et al. 2025).

It is told the mounts, so its pose is that of the base; it belongs to the end of the turn, the stamp of our clouds.

Where the settings are not the package's own, and why:

- `voxel_size` is 0.3 m: the package's 1 m is for streets. On a tour of the AWS small house 0.3 m was off by 2.5 cm,
  0.2 m by 6 cm and 0.1 m by 30 cm: the finer the map, the more the rings of a sparse cloud stick to its own.
- `initialization_phase` is on: gravity and biases are taken from the standing start.
- `max_num_threads` is 1, so that a run repeats.
- `deskew` is on only if the LiDAR's turn takes time (`rolling`). `min_range` and `max_range` are the LiDAR's.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from taskslam.errors import InputError
from taskslam.measurements import ImuSamples, Measurement, PointCloud, Sensor
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.needs import need_imu, need_lidar_3d
from taskslam.slam.registry import unavailable
from taskslam.slam.start_frame import StartFrame


class RkoLio(SlamMethod):
    """Options, as RKO-LIO names them.

    voxel_size: m, of the map. max_correspondence_distance: m. max_iterations. convergence_criterion: relative change
    of the cost. max_expected_jerk: m/s^3. min_beta: least weight of the accelerometer's down, -1 for none.
    double_downsample: thin each scan twice. initialization_phase: gravity and biases from the first scans.
    max_num_threads.
    """

    card: ClassVar[MethodCard] = MethodCard(
        name="rko_lio",
        version="0.4",
        licence="MIT",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.POINT_CLOUD, Sensor.IMU),
        summary="RKO-LIO: LiDAR-inertial odometry. No loop closure; never says that it is lost",
        needs_still_start=1.0,
        map_mode=MapMode.CONTINUE,
        deterministic=True,
        latency=0.05,
        queue=1,
        homepage="https://github.com/PRBonn/rko_lio",
        extra="rko-lio",
    )

    def __init__(
        self,
        voxel_size: float = 0.3,
        max_correspondence_distance: float = 0.5,
        max_iterations: int = 100,
        convergence_criterion: float = 1e-5,
        max_expected_jerk: float = 3.0,
        min_beta: float = 200.0,
        double_downsample: bool = True,
        initialization_phase: bool = True,
        max_num_threads: int = 1,
    ) -> None:
        if not voxel_size > 0:
            raise InputError(f"rko_lio: voxel_size is {voxel_size}; expected a positive length in metres")
        self._options = {
            "voxel_size": voxel_size,
            "max_correspondence_distance": max_correspondence_distance,
            "max_iterations": max_iterations,
            "convergence_criterion": convergence_criterion,
            "max_expected_jerk": max_expected_jerk,
            "min_beta": min_beta,
            "double_downsample": double_downsample,
            "initialization_phase": initialization_phase,
            "max_num_threads": max_num_threads,
        }
        self._odometry: Any = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map.

        Raises:
            MethodUnavailableError: rko-lio is not installed; names the extra.
            InputError: the robot has no 3D LiDAR or no IMU.
        """
        lidar, imu = need_lidar_3d(self.card.name, rig), need_imu(self.card.name, rig)
        try:
            from rko_lio.lio import LIO, LIOConfig
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        limits = {"min_range": lidar.range_min, "max_range": lidar.range_max, "deskew": lidar.rolling}
        self._odometry = LIO(LIOConfig(**self._options, **limits))
        self._T_base_lidar, self._T_base_imu = lidar.mount.matrix(), imu.mount.matrix()
        self._frame = StartFrame(np.eye(4))

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every cloud; None for the IMU. A cloud without points is `lost`."""
        if isinstance(measurement, ImuSamples):
            samples = zip(
                measurement.linear_acceleration, measurement.angular_velocity, measurement.stamps, strict=True
            )
            for acceleration, rate, stamp in samples:
                self._odometry.add_imu_measurement(acceleration, rate, int(stamp), self._T_base_imu)
        if not isinstance(measurement, PointCloud):
            return None
        status = Status.TRACKING
        if len(measurement.points):
            times = measurement.stamp + measurement.time_offset.astype(np.int64)
            self._odometry.register_scan(measurement.points, times, self._T_base_lidar)
        else:
            status = Status.LOST
        return PoseEstimate(measurement.stamp, self._frame.pose(self._odometry.pose()), status)
