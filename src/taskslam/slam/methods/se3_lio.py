"""`se3_lio`: the adapter of SE(3)-LIO, LiDAR-inertial odometry by an iterated Kalman filter on a map of planes.

It is of FAST-LIO2's family and keeps its own name in every table. GPL, so an extra, imported in its own process only.
The pose is that of the IMU at the end of the turn, the stamp of our clouds.

Where the settings are not the package's own, and why: `downsample_resolution` is 0.3 m and `voxel_map_resolution`
0.5 m (the package's 0.5 m and 1 m are for streets). Its map grows with the area; `voxel_map_sliding_en` bounds it.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, Measurement, PointCloud, Sensor
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.needs import need_imu, need_lidar_3d
from taskslam.slam.option_settings import check_option_names
from taskslam.slam.registry import unavailable
from taskslam.slam.start_frame import StartFrame

_DEFAULTS: dict[str, bool | int | float] = {"downsample_resolution": 0.3, "voxel_map_resolution": 0.5}


class Se3Lio(SlamMethod):
    """Options: the fields of the package's SE3LIOConfig."""

    card: ClassVar[MethodCard] = MethodCard(
        name="se3_lio",
        version="0.2",
        licence="GPL-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.POINT_CLOUD, Sensor.IMU),
        summary="SE(3)-LIO: LiDAR-inertial odometry, iterated Kalman filter. GPL; no loop closure",
        needs_still_start=1.0,
        map_mode=MapMode.CONTINUE,
        deterministic=True,
        latency=0.05,
        queue=1,
        homepage="https://pypi.org/project/se3-lio/",
        extra="se3-lio",
    )

    def __init__(self, **options: bool | int | float) -> None:
        self._options = options
        self._odometry: Any = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map.

        Raises:
            MethodUnavailableError: se3-lio is not installed; names the extra.
            InputError: the robot has no 3D LiDAR or no IMU, or an option is not the package's.
        """
        lidar, imu = need_lidar_3d(self.card.name, rig), need_imu(self.card.name, rig)
        try:
            from se3_lio import SE3LIO, SE3LIOConfig
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        check_option_names(self.card.name, self._options, SE3LIOConfig.model_fields)
        T_base_imu = imu.mount.matrix()
        config = SE3LIOConfig(**{**_DEFAULTS, **self._options})
        self._odometry = SE3LIO(config, lidar_extrinsic=invert_se3(T_base_imu) @ lidar.mount.matrix())
        self._frame = StartFrame(T_base_imu)
        self._samples: list[FloatArray] = []
        self._last = np.eye(4)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every cloud, `starting` until the IMU speaks, `lost` without points; None for the IMU."""
        if isinstance(measurement, ImuSamples):
            times = measurement.stamps[:, None] / NANOSECONDS
            self._samples.append(np.hstack([times, measurement.linear_acceleration, measurement.angular_velocity]))
        if not isinstance(measurement, PointCloud):
            return None
        if not self._samples:
            return PoseEstimate(measurement.stamp, self._last, Status.STARTING)
        if not len(measurement.points):
            return PoseEstimate(measurement.stamp, self._last, Status.LOST)
        begin = measurement.stamp + int(measurement.time_offset.min())
        times = (measurement.stamp - begin + measurement.time_offset.astype(np.int64)) / NANOSECONDS
        state, _ = self._odometry.register_frame(
            measurement.points, times, np.concatenate(self._samples), begin / NANOSECONDS
        )
        self._samples.clear()
        self._last = self._frame.pose(np.asarray(state.pose, dtype=np.float64))
        return PoseEstimate(measurement.stamp, self._last, Status.TRACKING)
