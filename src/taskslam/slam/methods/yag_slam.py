"""`yag_slam`: the adapter of yag-slam, which drives the OpenKarto scan matcher itself.

It is the independent reference that `karto` is measured against. yag-slam and karto-scanmatcher are GPL and LGPL and
have wheels up to CPython 3.11 only, so they come with an extra and are imported when the method starts, in its own
process. It keeps its own name in every table: the paper's numbers are for slam_toolbox.

yag-slam has no keyframe gate and no pose between keyframes; both are added here (0.2 m or 10 degrees; the odometry
since the last keyframe). Poses inside are those of the laser, outside of the base. After a loop closure its keyframes
move, and the live pose with the last of them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from taskslam.errors import DiskFullError, InputError, RecordError
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import LaserScan, Measurement, Sensor, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.karto.odometry_history import OdometryHistory
from taskslam.slam.needs import need_lidar_2d
from taskslam.slam.option_settings import read_options
from taskslam.slam.registry import unavailable

_MISSED = 100.0  # metres: a range beyond the threshold, which the matcher leaves out (0 or inf would be taken as hits)
_BUFFER = 10

# The published settings (protocol 1.3) as far as yag-slam has a name for them.
_SEQUENTIAL: dict[str, float | bool] = {
    "search_size": 0.5,
    "resolution": 0.01,
    "smear_deviation": 0.1,
    "distance_variance_penalty": 0.5,
    "angle_variance_penalty": 1.0,
    "minimum_angle_penalty": 0.9,
    "coarse_search_angle_offset": 0.349,
    "coarse_angle_resolution": 0.0349,
    "fine_search_angle_resolution": 0.00349,
    "use_response_expansion": True,
}
_LOOP: dict[str, float | bool] = {**_SEQUENTIAL, "search_size": 2.0, "resolution": 0.05, "smear_deviation": 0.03}


class YagSettings(BaseModel):
    """Options of `yag_slam`: metres, radians, and the matcher's response from 0 to 1."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    minimum_travel_distance: Annotated[float, Field(ge=0)] = 0.2
    minimum_travel_heading: Annotated[float, Field(ge=0)] = math.radians(10)
    max_laser_range: Annotated[float, Field(gt=0)] = 10.0
    minimum_response: Annotated[float, Field(ge=0, le=1)] = 0.3


class YagSlam(SlamMethod):
    """Options: minimum_travel_distance (m), minimum_travel_heading (rad), max_laser_range (m), minimum_response (0..1).

    A keyframe whose match is below minimum_response is reported as `lost`.
    """

    card: ClassVar[MethodCard] = MethodCard(
        name="yag_slam",
        version="0.3",
        licence="GPL-3.0",
        kind=Kind.SLAM,
        sensors=(Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY),
        summary="yag-slam: graph SLAM around the OpenKarto scan matcher itself",
        odometry_prior=True,
        map_mode=MapMode.CONTINUE,
        can_save_map=True,
        deterministic=True,
        latency=0.1,
        queue=1,
        homepage="https://pypi.org/project/yag-slam/",
        extra="yag-slam",
    )

    def __init__(self, **options: float) -> None:
        self._settings = read_options(YagSettings, self.card.name, options)
        self._graph: Any = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map.

        Raises:
            MethodUnavailableError: yag-slam is not installed; names the extra.
            InputError: the robot has no 2D LiDAR.
        """
        lidar = need_lidar_2d("yag_slam", rig)
        try:
            from yag_slam.graph_slam import GraphSlam
            from yag_slam.models import LocalizedRangeScan
            from yag_slam.scan_matching import Scan2DMatcherCpp
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        threshold = {"range_threshold": self._settings.max_laser_range}
        self._graph_class, self._scan_class = GraphSlam, LocalizedRangeScan
        self._graph = GraphSlam(
            Scan2DMatcherCpp({**_SEQUENTIAL, **threshold}),
            Scan2DMatcherCpp({**_LOOP, **threshold}, loop=True),
            scan_buffer_len=_BUFFER,
            loop_search_dist=3,
            loop_search_min_chain_size=10,
            min_response_coarse=0.35,
            min_response_fine=0.45,
        )
        self._T_base_laser = SE2.from_matrix(lidar.mount.matrix())
        self._odometry = OdometryHistory()
        self._T_fed_odom: SE2 | None = None
        self._T_fed_start = SE2()
        self._last: Any = None
        self._status = Status.TRACKING
        self._covariance: FloatArray | None = None

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every scan; None for odometry."""
        if isinstance(measurement, WheelOdometry):
            self._odometry.add(measurement)
            return None
        if not isinstance(measurement, LaserScan):
            return None
        if self._graph is None:
            raise InputError("yag_slam: call start before feed")
        if not len(self._odometry):
            return PoseEstimate(measurement.stamp, np.eye(4), Status.STARTING)
        T_odom_base = self._odometry.at(measurement.stamp)
        if self._T_fed_odom is None:
            self._T_fed_odom = self._T_fed_start @ T_odom_base.inverse()
        T_fed_laser = self._T_fed_odom @ T_odom_base @ self._T_base_laser
        if self._moved(T_fed_laser):
            self._process(measurement, T_fed_laser)
        T_start_laser = _pose(self._last.corrected_pose) @ _pose(self._last.odom_pose).inverse() @ T_fed_laser
        T_start_base = T_start_laser @ self._T_base_laser.inverse()
        return PoseEstimate(measurement.stamp, T_start_base.matrix(), self._status, self._covariance)

    def save_map(self, path: Path) -> None:
        """Write the map in yag-slam's own format (msgpack, compressed). Raises DiskFullError if that fails."""
        if self._last is None:
            raise InputError("yag_slam: nothing was mapped yet, so there is no map to save")
        try:
            self._graph.to_file(str(path))
        except OSError as error:
            raise DiskFullError(f"{path}: cannot write the yag_slam map: {error.strerror}") from error

    def load_map(self, path: Path) -> None:
        """Continue a saved map with the robot at its start pose. Raises RecordError if the file is not such a map."""
        if self._graph is None:
            raise InputError("yag_slam: call start before load_map")
        try:
            graph = self._graph_class.from_file(str(path))
            vertices = [vertex.obj for vertex in graph.graph.vertices]
            last = vertices[-1]
        except OSError as error:
            raise RecordError(f"{path}: cannot read the yag_slam map: {error.strerror}") from error
        except Exception as error:  # whatever zlib, msgpack and the reader raise on foreign bytes
            raise RecordError(f"{path}: not a yag_slam map or cut short: {type(error).__name__}: {error}") from error
        near = sorted(vertices[:-1], key=lambda scan: math.hypot(scan.corrected_pose.x, scan.corrected_pose.y))
        # The package numbers the next keyframe after the last of the running scans, so the last one must be there.
        graph.running_scans = [*near[:_BUFFER], last]
        self._graph, self._last = graph, last
        # The odometry is fed so that, seen from the last keyframe, the robot stands at the start.
        self._T_fed_start = _pose(last.odom_pose) @ _pose(last.corrected_pose).inverse()
        self._T_fed_odom = None

    @property
    def keyframes(self) -> int:
        """Keyframes in the map."""
        return 0 if self._last is None else int(self._last.num) + 1

    def _moved(self, T_fed_laser: SE2) -> bool:
        if self._last is None:
            return True
        step = _pose(self._last.odom_pose).inverse() @ T_fed_laser
        far = math.hypot(step.x, step.y) >= self._settings.minimum_travel_distance
        return far or abs(step.theta) >= self._settings.minimum_travel_heading

    def _process(self, scan: LaserScan, T_fed_laser: SE2) -> None:
        ranges, hit = np.asarray(scan.ranges, dtype=np.float64), scan.hits()
        if not hit.any() and self._last is not None:
            self._status = Status.LOST  # an empty scan would be a keyframe that matches anything
            return
        keyframe = self._scan_class(
            np.where(hit, ranges, _MISSED),
            scan.angle_min,
            scan.angle_min + scan.angle_increment * (len(ranges) - 1),
            scan.angle_increment,
            scan.range_min,
            scan.range_max,
            self._settings.max_laser_range,
            T_fed_laser.x,
            T_fed_laser.y,
            T_fed_laser.theta,
        )
        match, _ = self._graph.process_scan(keyframe)
        self._last = keyframe
        if match is None:
            return
        good = match.response >= self._settings.minimum_response
        self._status = Status.TRACKING if good else Status.LOST
        self._covariance = _matrix(match.covariance)


def _pose(transform: Any) -> SE2:
    return SE2(float(transform.x), float(transform.y), float(transform.euler[-1]))


def _matrix(covariance: Any) -> FloatArray | None:
    found = np.array(covariance, dtype=np.float64)
    return found if found.shape == (3, 3) and np.isfinite(found).all() else None
