"""`karto`: graph SLAM with a 2D LiDAR and wheel odometry, our own implementation of the algorithm in slam_toolbox.

The algorithm is OpenKarto's (Konolige et al. 2010, IROS, "Efficient sparse pose adjustment for 2D mapping"; matching:
Olson 2009, ICRA, "Real-time correlative scan matching"): keyframes behind a gate of travel and heading, each matched
against the buffer of those before it, linked to near chains, loops searched among near keyframes that are not linked,
and a pose graph optimised when a loop closes. Parameters and defaults: `slam/karto/settings.py`.

Where it differs, and why:

- `minimum_travel_distance` is 0.2 m. The published file says 0.0, by which OpenKarto takes every scan (its gate asks
  whether the squared distance reaches d^2, and 0 always does): 12,000 keyframes in a tour of 20 minutes at 10 Hz, also
  while the robot stands, and a buffer of 10 scans that reaches back one second.
- Every scan gets a pose all the same: between keyframes it is matched on the surfaces of the buffer.
- While the robot has not moved since the start, its scans (as many as the buffer holds) become keyframes at one pose:
  all later ones are matched on these, and the noise of a single first scan turned the map by 0.05 degrees.
- `reuse_keyframes`: where a linked keyframe already shows the place, the robot passes it (it enters the buffer) and
  none is added, so that map and time grow with the area and not with the hours. False: every gate adds one.
- `refine_match`: a point-to-line refinement follows the correlative match, whose cells are 1 cm and 0.2 degrees. In
  three rounds of the AWS small house and warehouse it takes the mean error from 1.1 and 2.9 cm to 0.3 cm.
- The coarse search looks at every fourth cell with a thinned scan (OpenKarto: every second cell, all hits): the smear
  of 10 cm allows it, and the fine search and the refinement follow.
- A chain or a loop must reach 0.7 of the response that the buffer reaches, besides OpenKarto's absolute thresholds,
  which rooms of the same size pass. A loop is closed with one chain per keyframe, not with all.
- Where the robot passes a keyframe that is there already, loops are searched as well; the scan becomes a keyframe if
  one closes.
- A scan that does not fit the map leaves the robot on odometry with status `lost`, and after ten of them the map is
  continued from there over a weak edge, across which loops are searched. OpenKarto takes the best pose it finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, Measurement, Sensor, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.karto.odometry_history import OdometryHistory
from taskslam.slam.karto.settings import KartoSettings
from taskslam.slam.needs import need_lidar_2d

if TYPE_CHECKING:
    from taskslam.slam.karto.mapper import Mapper

_WHOLE_TURN = 2 * np.pi * 0.95


@dataclass(frozen=True, slots=True)
class MapSummary:
    """keyframes and edges of the graph; loops closed since the start or the load."""

    keyframes: int
    edges: int
    loops_closed: int


class Karto(SlamMethod):
    """2D LiDAR graph SLAM. Options: the fields of `KartoSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="karto",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.SLAM,
        sensors=(Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY),
        summary="2D LiDAR graph SLAM: correlative scan matching and loop closure, the algorithm in slam_toolbox",
        odometry_prior=True,
        map_mode=MapMode.CONTINUE,
        can_save_map=True,
        deterministic=True,
        latency=0.02,
        queue=1,
    )

    def __init__(self, **options: object) -> None:
        self._settings = KartoSettings.from_options(options)
        self._mapper: Mapper | None = None
        self._odometry = OdometryHistory()

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map. Raises InputError if the robot has no 2D LiDAR."""
        lidar = need_lidar_2d("karto", rig)
        self._T_base_laser = lidar.mount.matrix()
        from taskslam.slam.karto.mapper import Mapper, warm_up  # numba comes with it: not to read a card

        warm_up(self._settings)
        self._mapper = Mapper(self._settings)
        self._odometry = OdometryHistory()

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every scan; None for odometry."""
        if isinstance(measurement, WheelOdometry):
            self._odometry.add(measurement)
            return None
        if not isinstance(measurement, LaserScan):
            return None
        return self._scan(measurement)

    def _scan(self, scan: LaserScan) -> PoseEstimate:
        from taskslam.slam.karto.scan_points import scan_to_points

        mapper = self._started()
        if not len(self._odometry):
            # The first scan may come before any odometry: the robot has not moved yet.
            return PoseEstimate(scan.stamp, SE2(*mapper.pose).matrix(), Status.STARTING)
        motion = None
        if self._settings.deskew and scan.time_increment:
            offsets = np.arange(1 - len(scan.ranges), 1, dtype=np.int64) * scan.time_increment
            motion = self._odometry.motion_within(scan.stamp, offsets)
        points = scan_to_points(scan, self._T_base_laser, self._settings.max_laser_range, motion)
        whole_turn = abs(scan.angle_increment) * len(scan.ranges) >= _WHOLE_TURN
        outcome = mapper.process(points, self._odometry.at(scan.stamp).array(), scan.stamp, whole_turn)
        return PoseEstimate(scan.stamp, SE2(*outcome.pose).matrix(), outcome.status, outcome.covariance)

    def save_map(self, path: Path) -> None:
        """Write keyframes, edges and settings to one npz file."""
        from taskslam.slam.karto.map_file import write_map

        write_map(Path(path), self._started(), self._settings)

    def load_map(self, path: Path) -> None:
        """Continue a saved map with the robot at the map's start pose; the settings stay those of this method."""
        from taskslam.slam.karto.map_file import read_map

        mapper = type(self._started())(self._settings)
        read_map(Path(path), mapper)
        self._mapper = mapper

    @property
    def scans_matched(self) -> int:
        """Scans that went through the whole matching, at the keyframe gate or because tracking failed."""
        return self._started().gates_passed

    def map_summary(self) -> MapSummary:
        """How large the map is."""
        mapper = self._started()
        return MapSummary(len(mapper.keyframes), len(mapper.graph.edges), mapper.loops_closed)

    def _started(self) -> Mapper:
        if self._mapper is None:
            raise InputError("karto: call start before feed, save_map or load_map")
        return self._mapper
