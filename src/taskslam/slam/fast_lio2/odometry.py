"""`LidarInertialOdometry`: IMU samples and scans in, a pose for every scan out.

What the papers leave open, or what is ours: a sample of the IMU holds since the one before it. The world is where the
IMU stood at the start, which is exact; velocity begins at zero. The published program cuts its map to a cube of
1000 m around the robot: no place here is as large, and the map is never cut. Where the IMU is silent for longer than
`imu_gap` the robot is taken to go on as it went, after a second of silence to stand, and its poses are `lost`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, PointCloud
from taskslam.robot import Imu, Lidar3D
from taskslam.slam.base import Status
from taskslam.slam.fast_lio2.iterated_filter import Matching, update
from taskslam.slam.fast_lio2.scan import centroids, chosen, deskewed
from taskslam.slam.fast_lio2.settings import FastLio2Settings
from taskslam.slam.fast_lio2.state import DIMENSIONS, State, carried
from taskslam.slam.fast_lio2.verdict import Evidence, believed, certain, evidence
from taskslam.slam.fast_lio2.voxel_map import VoxelMap
from taskslam.slam.inertial.still_start import Standstill, standstill

_SILENCE_S = 1.0
_FASTEST, _HARDEST = 100.0, 1000.0  # rad/s, m/s^2: what no sample says
_UNKNOWN_TURN, _UNKNOWN_ACCELERATION = 1.0, 2.0  # rad/s, m/s^2: standard deviations while the IMU is silent
_UPRIGHT = 0.7  # cosine of the angle between the two downs, of the IMU and of its mount
# Variances at the start. From bias on: as the authors' program begins.
_INITIAL = {0: 1e-6, 3: 1e-6, 6: 1e-4, 9: 1e-4, 12: 1e-3, 15: 1e-5, 18: 1e-5, 21: 1e-5}


class _Pieces(NamedTuple):
    """Of the time up to a scan's end: (K,) seconds, (K, 3) readings, NaN where the IMU was silent; (K, 4) variances."""

    durations: FloatArray
    rates: FloatArray
    forces: FloatArray
    variances: FloatArray


@dataclass(frozen=True, slots=True)
class Outcome:
    """T_world_imu: (4, 4). covariance: (6, 6) of rotation in the IMU frame and position in the world.

    seen: what the scan had to say; None if it was not looked at.
    """

    T_world_imu: FloatArray
    status: Status
    covariance: FloatArray
    seen: Evidence | None = None


class LidarInertialOdometry:
    """The filter, its map, and what the IMU has said since the last scan."""

    def __init__(self, settings: FastLio2Settings, lidar: Lidar3D, imu: Imu) -> None:
        s = self._settings = settings
        self.map = VoxelMap(s.filter_size_map, s.map_point == "nearest")
        self._lidar, self._imu = lidar, imu
        T_imu_lidar = invert_se3(imu.mount.matrix()) @ lidar.mount.matrix()
        self._down_of_mount = -imu.mount.matrix()[2, :3]
        still = np.zeros(3)
        self.state = State(
            np.eye(3), still, still, still, still, T_imu_lidar[:3, :3].copy(), T_imu_lidar[:3, 3].copy(), still
        )
        self.covariance = np.zeros((DIMENSIONS, DIMENSIONS))
        self._scale = 0.0
        self._now: int | None = None
        self._stamps: list[int] = []
        self._rates: list[FloatArray] = []
        self._forces: list[FloatArray] = []
        self._last_stamp = 0
        self._last_reading = (np.full(3, np.nan), np.full(3, np.nan))
        self._matching = Matching(
            s.neighbours,
            s.neighbour_distance,
            s.plane_tolerance,
            s.match_score,
            s.point_cov,
            s.converged,
            s.max_iteration,
            s.extrinsic_est_en,
            s.refresh_neighbours,
        )

    def add(self, samples: ImuSamples) -> None:
        """Keep samples until the scan that they belong to; those that cannot be, or come too late, are left out."""
        for stamp, rate, force in zip(
            samples.stamps.tolist(), samples.angular_velocity, samples.linear_acceleration, strict=True
        ):
            possible = (np.abs(rate) < _FASTEST).all() and (np.abs(force) < _HARDEST).all()  # and so finite
            if stamp > self._last_stamp and possible:
                self._last_stamp = stamp
                self._stamps.append(stamp)
                self._rates.append(np.array(rate, np.float64))
                self._forces.append(np.array(force, np.float64))
        if self._now is None:
            self._try_to_begin()

    def process(self, cloud: PointCloud) -> Outcome:
        """The pose at the end of a turn.

        Raises:
            InputError: the IMU says at rest that the robot does not stand upright; names the angle.
        """
        s = self._settings
        if self._now is None:
            return self._outcome(Status.STARTING)
        if cloud.stamp <= self._now:
            return self._outcome(Status.LOST if len(self.map) else Status.STARTING)
        heard = cloud.stamp - self._last_stamp <= s.imu_gap * NANOSECONDS
        pieces = self._pieces(cloud.stamp)
        if (pieces.durations >= _SILENCE_S).any():
            self.state = self.state._replace(v=np.zeros(3))
        predicted, P, track = carried(self.state, self.covariance, *pieces)
        self.state, self.covariance, self._now = predicted, P, cloud.stamp

        points, offsets = chosen(cloud.points, cloud.time_offset, s.point_filter_num, s.blind, self._lidar.range_max)
        if s.deskew:
            points = deskewed(points, offsets, track, predicted)
        points = centroids(points, s.filter_size_surf)
        if len(points) < s.least_points:
            return self._outcome(Status.LOST if len(self.map) else Status.STARTING)
        if not len(self.map):
            self._insert(points)
            return self._outcome(Status.TRACKING)

        found = update(predicted, P, points, self.map.keys, self.map.points, self.map.size, self._matching)
        seen = evidence(len(points), predicted, P, found, s)
        if not believed(seen, s):
            return self._outcome(Status.LOST, seen)
        self.state, self.covariance = found.x, found.P
        if heard:
            self._insert(points)
        known = heard and certain(seen, found.P, s)
        return self._outcome(Status.TRACKING if known else Status.LOST, seen)

    def _try_to_begin(self) -> None:
        """Take gravity and biases from the last seconds, if the robot stood."""
        s = self._settings
        period = NANOSECONDS / self._imu.rate
        if self._stamps[-1:] and self._stamps[-1] - self._stamps[0] + 1.5 * period < s.still_start * NANOSECONDS:
            return
        if not self._stamps:
            return
        rates, forces = np.array(self._rates), np.array(self._forces)
        found = standstill(rates, forces, self._imu.gyro_noise, self._imu.accel_noise, s.gravity)
        if found is None:
            half = len(self._stamps) // 2 + 1
            del self._stamps[:half], self._rates[:half], self._forces[:half]
            return
        self._begin(found)

    def _begin(self, found: Standstill) -> None:
        upright = float(found.gravity @ self._down_of_mount) / self._settings.gravity
        if upright < _UPRIGHT:
            angle = np.degrees(np.arccos(max(-1.0, upright)))
            raise InputError(
                f"fast_lio2: at rest the IMU measures gravity {angle:.0f} degrees away from where its mount in the "
                f"robot's rig has it; is it mounted as rig.imu.mount says?"
            )
        self.state = self.state._replace(b_g=found.gyro_bias, g=found.gravity)
        self.covariance = np.zeros((DIMENSIONS, DIMENSIONS))
        for first, variance in _INITIAL.items():
            for k in range(first, min(first + 3, DIMENSIONS)):
                self.covariance[k, k] = variance
        self._scale = found.scale
        self._now = self._stamps[-1]
        self._stamps, self._rates, self._forces = [], [], []

    def _pieces(self, end: int) -> _Pieces:
        """How the time from the state to `end` (ns) divides; the samples up to it are used up."""
        assert self._now is not None
        s, edges = self._settings, [self._now]
        rates, forces = [], []
        count = int(np.searchsorted(self._stamps, end, side="right"))
        for stamp, rate, force in zip(self._stamps[:count], self._rates, self._forces, strict=False):
            if stamp > edges[-1]:
                edges.append(stamp)
                rates.append(rate)
                forces.append(force * self._scale)
                self._last_reading = rates[-1], forces[-1]
        del self._stamps[:count], self._rates[:count], self._forces[:count]
        if end > edges[-1]:
            edges.append(end)
            rates.append(self._last_reading[0])
            forces.append(self._last_reading[1])
        durations: FloatArray = np.diff([(edge - edges[0]) / NANOSECONDS for edge in edges])
        R, F = np.array(rates), np.array(forces)
        silent = durations > s.imu_gap
        silent[-1] |= end - self._last_stamp > s.imu_gap * NANOSECONDS
        R[silent], F[silent] = np.nan, np.nan
        durations = np.minimum(durations, _SILENCE_S)
        per_sample = np.array([s.gyr_cov, s.acc_cov, s.b_gyr_cov, s.b_acc_cov])
        variances = np.where(np.isnan(R[:, :1]), [_UNKNOWN_TURN**2, _UNKNOWN_ACCELERATION**2, 0.0, 0.0], per_sample)
        return _Pieces(durations, R, F, variances * durations[:, None] ** 2)

    def _insert(self, points: npt.NDArray[np.float64]) -> None:
        x = self.state
        self.map.insert((points @ x.R_il.T + x.p_il) @ x.R.T + x.p)

    def _outcome(self, status: Status, seen: Evidence | None = None) -> Outcome:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.state.R, self.state.p
        return Outcome(T, status, self.covariance[:6, :6].copy(), seen)


def warm_up(settings: FastLio2Settings, lidar: Lidar3D, imu: Imu) -> None:
    """Map a made-up room and forget it, so that no real scan waits for compilation."""
    odometry = LidarInertialOdometry(settings, lidar, imu)
    azimuth, elevation = np.meshgrid(np.linspace(-np.pi, np.pi, 360, endpoint=False), np.linspace(-0.6, 0.6, 16))
    rays = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)
    rays = rays.reshape(-1, 3)
    points = (rays * ((4.0 + 2.0 * settings.blind) / np.abs(rays).max(axis=1, keepdims=True))).astype(np.float32)
    count = round((settings.still_start + 1.0) * imu.rate)
    stamps = np.arange(1, count + 1, dtype=np.int64) * round(NANOSECONDS / imu.rate)
    up = np.tile(imu.mount.matrix()[2, :3] * settings.gravity, (count, 1))
    odometry.add(ImuSamples(int(stamps[-1]), stamps, np.zeros((count, 3)), up))
    for k in range(1, 3):
        stamp = int(stamps[-1]) + k
        cloud = PointCloud(stamp, points, np.zeros(len(points), np.uint16), np.zeros(len(points), np.int32))
        odometry.process(cloud)
