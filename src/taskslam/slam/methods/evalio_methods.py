"""The adapter of evalio's pipelines: eight published LiDAR(-inertial) odometries, compiled behind one interface.

evalio (Potokar and Kaess 2025, "A Comprehensive Evaluation of LiDAR Odometry Techniques") builds the authors' code into
one wheel. Its parameters are theirs as evalio ships them; each class below says what it sets otherwise. For all:

- One thread where the method has a setting for it; the child process has one OpenMP thread anyway.
- Deskewing is on only if the LiDAR's turn takes time (`rolling`).
- A cloud is given whole, ring by ring: rays without return stand at the origin, below every minimum range.
- The first pose is the start, so a method that moves its world while it finds the vertical must stand meanwhile.

Poses are those of the IMU (of the LiDAR for methods without one). evalio stamps them all with the begin of the turn.
Measured against the truth they lie elsewhere in a rolling turn, or belong to an earlier cloud: `pose_in_sweep` and
`clouds_behind` say where, and the estimate carries the stamp that fits.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any, ClassVar

import numpy as np

from taskslam.geometry import invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, Measurement, PointCloud, Sensor
from taskslam.robot import Lidar3D, SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.needs import need_imu, need_lidar_3d
from taskslam.slam.option_settings import check_option_names
from taskslam.slam.registry import unavailable
from taskslam.slam.start_frame import StartFrame

_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("t", "<u4"), ("ring", "<u2")])
_GRAVITY = 9.8


def _card(name: str, version: str, licence: str, summary: str, homepage: str, **more: Any) -> MethodCard:
    inertial = more.pop("inertial", False)
    return MethodCard(
        name=name,
        version=version,
        licence=licence,
        kind=Kind.ODOMETRY,
        sensors=(Sensor.POINT_CLOUD, Sensor.IMU) if inertial else (Sensor.POINT_CLOUD,),
        summary=f"{summary}, by evalio. No loop closure; never says that it is lost",
        map_mode=MapMode.CONTINUE,
        homepage=f"https://github.com/{homepage}",
        extra="evalio",
        **more,
    )


class EvalioMethod(SlamMethod):
    """What the eight have in common. Options: the pipeline's own parameters."""

    pipeline: ClassVar[str]
    settings: ClassVar[dict[str, bool | int | float]] = {}
    pose_in_sweep: ClassVar[float] = 0.5  # where in a rolling turn the pose lies: 0 its begin, 1 its end
    clouds_behind: ClassVar[int] = 0  # how many clouds ago the cloud came to which the newest pose belongs

    def __init__(self, **options: bool | int | float | str) -> None:
        self._options = options
        self._pipeline: Any = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map.

        Raises:
            MethodUnavailableError: evalio is not installed; names the extra.
            InputError: the robot lacks a sensor, or an option is not the pipeline's.
        """
        self._lidar = need_lidar_3d(self.card.name, rig)
        try:
            from evalio import pipelines, types
            from evalio._cpp import helpers
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        self._types, self._helpers = types, helpers
        self._pipeline = getattr(pipelines, self.pipeline)()
        parameters = self._parameters(self._pipeline.default_params())
        self._pipeline.set_params(parameters)
        T_base_lidar = T_base_pose = self._lidar.mount.matrix()
        imu_params = types.ImuParams(gravity=np.array([0.0, 0.0, -_GRAVITY]))
        if Sensor.IMU in self.card.sensors:
            imu = need_imu(self.card.name, rig)
            T_base_pose = imu.mount.matrix()
            imu_params = types.ImuParams(
                gyro=imu.gyro_noise / math.sqrt(imu.rate),  # a density, as preintegration takes it
                accel=imu.accel_noise / math.sqrt(imu.rate),
                gravity=np.array([0.0, 0.0, -_GRAVITY]),
                rate=imu.rate,
            )
        T_imu_lidar = invert_se3(T_base_pose) @ T_base_lidar
        self._pipeline.set_imu_params(imu_params)
        self._pipeline.set_lidar_params(_lidar_params(types, self._lidar))
        self._pipeline.set_imu_T_lidar(types.SE3.from_mat(np.asfortranarray(T_imu_lidar)))
        self._pipeline.initialize()
        self._fields = [
            helpers.Field(name=name, datatype=_datatype(helpers, name), offset=offset)
            for name, (_, offset, *_) in (_POINT.fields or {}).items()
        ]
        self._frame = StartFrame(T_base_pose)
        self._last = np.eye(4)
        sweeps = parameters.get("motion_compensation", "NONE") != "NONE"  # then the begin is of the cloud's own sweep
        self._begins: deque[int] = deque(maxlen=1 if sweeps else 1 + self.clouds_behind)
        self._said = -1

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every cloud once there is one; None for the IMU. An empty cloud says `lost`."""
        if isinstance(measurement, ImuSamples):
            self._add_imu(measurement)
        if not isinstance(measurement, PointCloud):
            return None
        if not len(measurement.points):
            return self._say(measurement.stamp, Status.LOST)
        begin = measurement.stamp - (self._sweep if self._lidar.rolling else 0)
        self._pipeline.add_lidar(self._cloud(measurement, begin))
        self._begins.append(begin)
        estimates = self._pipeline.saved_estimates()
        if not estimates or len(self._begins) < (self._begins.maxlen or 1):
            return None
        pose = estimates[-1][1]
        self._last = self._frame.pose(np.asarray(pose.to_mat(), dtype=np.float64))
        into = self.pose_in_sweep * self._sweep if self._lidar.rolling else 0.0
        return self._say(self._begins[0] + round(into), Status.TRACKING)

    def _say(self, stamp: int, status: Status) -> PoseEstimate | None:
        """Nothing if something newer was said, as after an empty cloud by a method that is behind."""
        if stamp <= self._said:
            return None
        self._said = stamp
        return PoseEstimate(stamp, self._last, status)

    def _parameters(self, defaults: dict[str, Any]) -> dict[str, Any]:
        """All of them: evalio leaves what is not given unset, and not at its default."""
        check_option_names(self.card.name, self._options, defaults)
        one_thread = {"max_num_threads": 1, "num_threads": 1, "ls_num_threads": 1, "numberOfCores": 1}
        ours: dict[str, Any] = {name: value for name, value in one_thread.items() if name in defaults}
        if "deskew" in defaults:
            ours["deskew"] = self._lidar.rolling
        if "motion_compensation" in defaults and not self._lidar.rolling:
            ours["motion_compensation"] = "NONE"
        return {**defaults, **ours, **self.settings, **self._options}

    def _add_imu(self, samples: ImuSamples) -> None:
        rows = zip(samples.stamps, samples.angular_velocity, samples.linear_acceleration, strict=True)
        for stamp, rate, acceleration in rows:
            self._pipeline.add_imu(self._types.ImuMeasurement(self._stamp(int(stamp)), rate, acceleration))

    def _cloud(self, cloud: PointCloud, begin: int) -> Any:
        packed = organised(cloud, self._lidar, begin)
        rings, samples = packed.shape
        metadata = self._helpers.PointCloudMetadata(
            stamp=self._stamp(begin),
            width=samples,
            height=rings,
            point_step=_POINT.itemsize,
            row_step=_POINT.itemsize * samples,
            is_bigendian=0,
            is_dense=1,
        )
        measurement = self._helpers.pc2_to_evalio(metadata, self._fields, packed.tobytes())
        self._helpers.fill_col_row_major(measurement)
        return measurement

    @property
    def _sweep(self) -> int:
        """Time between the first and the last firing of a rolling turn, ns."""
        return round((self._lidar.samples - 1) * NANOSECONDS / self._lidar.rate / self._lidar.samples)

    def _stamp(self, stamp: int) -> Any:
        return self._types.Stamp(sec=1 + stamp // NANOSECONDS, nsec=stamp % NANOSECONDS)  # a sweep may begin before 0


def organised(cloud: PointCloud, lidar: Lidar3D, begin: int) -> np.ndarray[Any, Any]:
    """(rings, samples) points with their time since `begin` (ns) and ring; zeros where nothing returned."""
    packed = np.zeros((lidar.rings, lidar.samples), _POINT)
    packed["ring"] = np.arange(lidar.rings)[:, None]
    x, y, z = cloud.points.T
    step = 2.0 * np.pi / lidar.samples
    column = np.round((np.arctan2(y, x).astype(np.float64) + np.pi) / step).astype(np.int64) % lidar.samples
    if lidar.rolling:
        ages = np.arange(lidar.samples) * (NANOSECONDS / lidar.rate / lidar.samples)
        packed["t"] = np.round(ages).astype(np.uint32)
    cells = packed[cloud.ring, column]
    cells["x"], cells["y"], cells["z"] = x, y, z
    cells["t"] = np.maximum(cloud.stamp - begin + cloud.time_offset.astype(np.int64), 0)
    packed[cloud.ring, column] = cells
    return packed


def _lidar_params(types: Any, lidar: Lidar3D) -> Any:
    return types.LidarParams(
        num_rows=lidar.rings,
        num_columns=lidar.samples,
        min_range=lidar.range_min,
        max_range=lidar.range_max,
        rate=lidar.rate,
    )


def _datatype(helpers: Any, name: str) -> Any:
    types = helpers.DataType
    return {"t": types.UINT32, "ring": types.UINT16}.get(name, types.FLOAT32)


class Dlio(EvalioMethod):
    """DLIO. `imu_calib_time` is 1.5 s (the package's 3 s): shorter than the standing start."""

    pipeline = "DLIO"
    settings: ClassVar[dict[str, bool | int | float]] = {"imu_calib_time": 1.5, "gravity": _GRAVITY}
    card = _card(
        "dlio",
        "1.1.1",
        "MIT",
        "DLIO, direct LiDAR-inertial odometry",
        "vectr-ucla/direct_lidar_inertial_odometry",
        inertial=True,
        needs_still_start=2.0,
        latency=0.05,
        deterministic=True,
    )


class LioSam(EvalioMethod):
    """LIO-SAM: its feature odometry with preintegrated IMU, without loop closure.

    The leaf sizes are those that its own parameter file names for indoors: with the ones for outdoors, which evalio
    ships, it was 120 m off after a minute in a room of 8 m. `mappingProcessInterval` is 0 (0.15 s), so that
    every cloud at 10 Hz gets its pose, and not every second. It holds two clouds back, so its pose is that of the cloud
    two before: on known drives it is off by 5 mm there and by 5 cm at the newest.
    """

    pipeline = "LioSAM"
    clouds_behind = 2
    settings: ClassVar[dict[str, bool | int | float]] = {
        "odometrySurfLeafSize": 0.2,
        "mappingCornerLeafSize": 0.1,
        "mappingSurfLeafSize": 0.2,
        "mappingProcessInterval": 0.0,
    }
    card = _card(
        "lio_sam",
        "0.1.0",
        "BSD-3-Clause",
        "LIO-SAM's front end, LiDAR features and preintegrated IMU; two clouds behind",
        "contagon/LIO-SAM",
        inertial=True,
        needs_still_start=2.0,
        latency=0.05,
        deterministic=True,
    )


class EvalioKissIcp(EvalioMethod):
    """KISS-ICP as evalio builds it; `kiss_icp` is its authors' own package. `voxel_size` as there, 0.5 m."""

    pipeline = "KissICP"
    pose_in_sweep = 1.0
    settings: ClassVar[dict[str, bool | int | float]] = {"voxel_size": 0.5}
    card = _card(
        "evalio_kiss_icp",
        "1.3.0",
        "MIT",
        "KISS-ICP, LiDAR odometry by point-to-point ICP",
        "PRBonn/kiss-icp",
        latency=0.05,
        deterministic=True,
    )


class GenzIcp(EvalioMethod):
    """GenZ-ICP. It has no setting for threads, and its sums depend on how they share them."""

    pipeline = "GenZICP"
    pose_in_sweep = 1.0
    card = _card(
        "genz_icp",
        "0.3.2",
        "MIT",
        "GenZ-ICP, LiDAR odometry that weighs points against planes; runs do not repeat",
        "cocel-postech/genz-icp",
        latency=0.1,
        deterministic=False,
    )


class MadIcp(EvalioMethod):
    """MAD-ICP. `realtime` is False: it would cut its work short by the wall clock."""

    pipeline = "MadICP"
    pose_in_sweep = 1.0
    settings: ClassVar[dict[str, bool | int | float]] = {"realtime": False}
    card = _card(
        "mad_icp",
        "0.0.10",
        "BSD-3-Clause",
        "MAD-ICP, LiDAR odometry on trees of planes",
        "rvp-group/mad-icp",
        latency=0.05,
        deterministic=True,
    )


class CtIcp(EvalioMethod):
    """CT-ICP. Without a sweep there is no continuous time: an instant turn is matched with motion_compensation NONE.

    evalio hands out the pose at the begin of the turn, and without a sweep that is where the turn before ended: on
    known drives it is off by 1 mm at the stamp of the cloud before, by 25 mm at the cloud's own.

    Lengths are a third of the package's, which are for streets (1.5 m between the points that are matched): in a room
    of 8 m the package's own lost the robot within seconds of its first motion.
    """

    pipeline = "CTICP"
    settings: ClassVar[dict[str, bool | int | float]] = {
        "sample_voxel_size": 0.5,
        "voxel_size": 0.2,
        "size_voxel_map": 0.5,
        "max_dist_to_plane_ct_icp": 0.2,
    }
    clouds_behind = 1
    pose_in_sweep = 0.0
    card = _card(
        "ct_icp",
        "0.0.1",
        "MIT",
        "CT-ICP, LiDAR odometry with continuous time in the turn; one cloud behind",
        "jedeschaud/ct_icp",
        latency=0.1,
        deterministic=True,
    )


class Loam(EvalioMethod):
    """LOAM's features, edges and planes."""

    pipeline = "LOAM"
    card = _card(
        "loam",
        "1.0.0",
        "MIT",
        "LOAM, LiDAR odometry on edges and planes",
        "DanMcGann/loam",
        latency=0.05,
        deterministic=True,
    )


class Form(EvalioMethod):
    """FORM. Two runs differ although it works on one thread."""

    pipeline = "FORM"
    card = _card(
        "form",
        "0.2.0",
        "MIT",
        "FORM, LiDAR odometry with fixed-lag smoothing over many scans; runs do not repeat",
        "rpl-cmu/form",
        latency=0.05,
        deterministic=False,
    )
