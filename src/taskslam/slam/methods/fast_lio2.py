"""`fast_lio2`: an independent implementation of FAST-LIO2, LiDAR-inertial odometry by an iterated Kalman filter.

From the papers: Xu, Cai, He, Lin, Zhang, "FAST-LIO2: fast direct LiDAR-inertial odometry", T-RO 38(4), 2022, and Xu,
Zhang, "FAST-LIO", RA-L 6(2), 2021. It shares no code with the authors' program. Parameters, defaults and the two
presets: `slam/fast_lio2/settings.py`.

Where it differs, and why:

- The map is a table of voxels and not an incremental k-d tree: the same points, the same neighbours
  (`slam/fast_lio2/voxel_map.py`), and it is never cut to a cube around the robot.
- It says `lost` (`slam/fast_lio2/verdict.py`), and does not map what it does not believe. FAST-LIO2 never does.
- Neighbours that form a line make no plane, and the plane is fitted along the axis across which they spread most.
- An IMU that does not stand upright at the start as its mount says is refused in a sentence.

Its limits: no loop closure, no relocalisation. With `map_point: nearest`, the published rule, a voxel's point gives way
to any that lies nearer to the centre, so walls and floor creep towards the middle of their voxels as the robot looks at
them, and the poses with them: by up to 0.25 m at the published 0.5 m (`first`, in the preset `indoor`, has none of it).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import ImuSamples, Measurement, PointCloud, Sensor
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod
from taskslam.slam.fast_lio2.settings import FastLio2Settings
from taskslam.slam.needs import need_imu, need_lidar_3d
from taskslam.slam.option_settings import read_options

if TYPE_CHECKING:
    from taskslam.slam.fast_lio2.odometry import LidarInertialOdometry, Outcome


class FastLio2(SlamMethod):
    """LiDAR-inertial odometry. Options: the fields of `FastLio2Settings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="fast_lio2",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.POINT_CLOUD, Sensor.IMU),
        summary="independent implementation of FAST-LIO2 (Xu et al., T-RO 2022): LiDAR-inertial, no loop closure",
        needs_still_start=1.5,
        map_mode=MapMode.CONTINUE,
        can_save_map=True,
        deterministic=True,
        latency=0.02,
        queue=1,
    )

    def __init__(self, **options: object) -> None:
        self._settings = read_options(FastLio2Settings, "fast_lio2", options)
        self._odometry: LidarInertialOdometry | None = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map. Raises InputError if the robot has no 3D LiDAR or no IMU."""
        lidar, imu = need_lidar_3d("fast_lio2", rig), need_imu("fast_lio2", rig)
        from taskslam.slam.fast_lio2.odometry import LidarInertialOdometry, warm_up  # numba: not to read a card

        warm_up(self._settings, lidar, imu)
        self._odometry = LidarInertialOdometry(self._settings, lidar, imu)
        self._T_base_imu = imu.mount.matrix()
        self._T_imu_base = invert_se3(self._T_base_imu)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every cloud; None for the IMU."""
        odometry = self._started()
        if isinstance(measurement, ImuSamples):
            odometry.add(measurement)
        if not isinstance(measurement, PointCloud):
            return None
        outcome = odometry.process(measurement)
        T_start_base = self._T_base_imu @ outcome.T_world_imu @ self._T_imu_base
        return PoseEstimate(measurement.stamp, T_start_base, outcome.status, self._planar(outcome))

    def save_map(self, path: Path) -> None:
        """Write the map's points to one npz file."""
        from taskslam.slam.fast_lio2.map_file import write_map

        write_map(Path(path), self._started().map, self._settings)

    def load_map(self, path: Path) -> None:
        """Continue a saved map with the robot at the map's start pose; the settings stay those of this method."""
        from taskslam.slam.fast_lio2.map_file import read_map

        read_map(Path(path), self._started().map)

    def _planar(self, outcome: Outcome) -> FloatArray:
        """(3, 3) covariance over x, y, theta in the start frame."""
        R_start_world = self._T_base_imu[:3, :3]
        across = np.zeros((3, 6))
        across[:2, 3:] = R_start_world[:2]
        across[2, :3] = (R_start_world @ outcome.T_world_imu[:3, :3])[2]
        planar: FloatArray = across @ outcome.covariance @ across.T
        return planar

    def _started(self) -> LidarInertialOdometry:
        if self._odometry is None:
            raise InputError("fast_lio2: call start before feed, save_map or load_map")
        return self._odometry
