"""`HectorMapper`: one scan in, one pose out; the map takes a scan in only when the robot has moved.

A scan lies on the map if at least `lost_score` of its hits on known ground fall on what is rather occupied, and at
least a fifth of all hits fall on known ground. One that does not is not taken into the map; after more than
`lost_after` seconds of such scans, or of scans with hardly any hits, the robot is `lost` until one lies on the map
again. Where the pose holds, the share is 0.9 and more; where it is lost in a turn, it falls below 0.4 at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, compose, invert, wrap_angle
from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.slam.base import Status
from taskslam.slam.hector.occupancy_grid import OccupancyGrid
from taskslam.slam.hector.scan_matcher import Alignment, align
from taskslam.slam.hector.settings import HectorSettings
from taskslam.slam.karto.scan_points import ScanPoints, scan_to_points

MINIMUM_HITS = 20  # fewer hits say nothing about a pose
_LEAST_KNOWN = 0.2
_WIDENING = np.diag([1e-2, 1e-2, 1e-2])  # m^2, rad^2 for each scan that said nothing


@dataclass(frozen=True, slots=True)
class Outcome:
    """pose: (3,) `T_start_base`; covariance: (3, 3). score: how well the scan lay on the map, 0..1."""

    pose: FloatArray
    status: Status
    covariance: FloatArray
    score: float


class HectorMapper:
    """Levels of the map, finest first, and where the robot is. The map frame is the start frame."""

    def __init__(self, settings: HectorSettings) -> None:
        self._settings = settings
        side = settings.map_resolution * settings.map_size
        self.levels = [
            OccupancyGrid(settings.map_resolution * 2**level, side) for level in range(settings.map_multi_res_levels)
        ]
        self.pose = np.zeros(3)
        self._covariance = np.diag([1e-4, 1e-4, 1e-4])
        self._last_step = np.zeros(3)
        self._updated_at: FloatArray | None = None
        self._good_until: int | None = None

    @property
    def empty(self) -> bool:
        """Whether the map shows nothing yet."""
        return self.levels[0].log_odds.size == 0

    def process(self, scan: ScanPoints, stamp: int) -> Outcome:
        """Live pose of the base at the scan's stamp (ns)."""
        if self._good_until is None:
            self._good_until = stamp
        if len(scan) < MINIMUM_HITS:
            self._last_step = np.zeros(3)
            self._covariance = self._covariance + _WIDENING
            return self._outcome(stamp, 0.0)
        points = np.asarray(scan.points, np.float64)
        if self.empty:
            self._good_until = stamp
            self._insert(points, scan.sensor)
            return self._outcome(stamp, 1.0)
        found = self._align(points)
        self._last_step = compose(invert(self.pose), found.pose)
        self.pose, self._covariance = found.pose, found.covariance
        if found.score >= self._settings.lost_score and found.known >= _LEAST_KNOWN:
            self._good_until = stamp
            if self._moved():
                self._insert(points, scan.sensor)
        return self._outcome(stamp, found.score)

    def place(self, pose: FloatArray) -> None:
        """Say that the robot now stands at (3,) `pose` of a map that is there already."""
        self.pose = pose.copy()
        self._last_step = np.zeros(3)
        self._updated_at = None
        self._good_until = None

    def _align(self, points: FloatArray) -> Alignment:
        s = self._settings
        start = compose(self.pose, self._last_step) if s.predict_motion else self.pose
        return align(self.levels, points, start, s.iterations_coarse, s.iterations_fine)

    def _moved(self) -> bool:
        """Whether the robot has moved or turned far enough since the map last took a scan in."""
        if self._updated_at is None:
            return True
        s = self._settings
        far = math.dist(self.pose[:2], self._updated_at[:2]) > s.map_update_distance_thresh
        return far or abs(wrap_angle(float(self.pose[2] - self._updated_at[2]))) > s.map_update_angle_thresh

    def _insert(self, points: FloatArray, sensor: FloatArray) -> None:
        free, occupied = _log_odds(self._settings.update_factor_free), _log_odds(self._settings.update_factor_occupied)
        for level in self.levels:
            level.insert(points, sensor, self.pose, free, occupied)
        self._updated_at = self.pose.copy()

    def _outcome(self, stamp: int, score: float) -> Outcome:
        assert self._good_until is not None
        if self.empty:
            status = Status.STARTING
        else:
            lost = stamp - self._good_until > self._settings.lost_after * NANOSECONDS
            status = Status.LOST if lost else Status.TRACKING
        return Outcome(self.pose.copy(), status, self._covariance.copy(), score)


def warm_up(settings: HectorSettings) -> None:
    """Map a few made-up scans and forget them, so that no real scan waits for compilation."""
    angles = np.linspace(-np.pi, np.pi, 400, endpoint=False)
    ranges = 2.0 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    laser = LaserScan(0, ranges.astype(np.float32), -np.pi, np.pi / 200, 0.1, settings.laser_max_dist)
    scan = scan_to_points(laser, np.eye(4), settings.laser_max_dist)
    mapper = HectorMapper(settings)
    for k in range(2):
        mapper.process(scan, k * NANOSECONDS)


def _log_odds(probability: float) -> float:
    return math.log(probability / (1.0 - probability))
