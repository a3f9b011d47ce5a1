"""The drive on which `taskslam methods check` tries a method: laps in a furnished room, made from a formula.

It depends on numpy alone, not on the simulator, so that a method's author can read in one page what is fed. The room
is 8 m x 6 m with an island in the middle and a few boxes along the walls; the robot circles the island on an ellipse
at 0.3 m/s after standing still for a while. Everything follows from the rig and a seed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from taskslam.geometry import SE2, FloatArray, compose, invert, wrap_angle
from taskslam.measurements import NANOSECONDS, LaserScan, Measurement, TruePose, WheelOdometry
from taskslam.robot import Lidar2D, SensorRig

_SPEED = 0.3
_HALF_AXES = (2.6, 1.8)
# Rectangles x0, y0, x1, y1 in metres: the walls, the island, and boxes that make every corner look different.
_ROOM = (
    (-4.0, -3.0, 4.0, 3.0),
    (-1.2, -0.5, 1.0, 0.5),
    (-4.0, 1.8, -2.9, 3.0),
    (3.2, -3.0, 4.0, -1.6),
    (1.5, 2.5, 2.7, 3.0),
    (-3.2, -3.0, -2.4, -2.6),
    (3.6, 0.4, 4.0, 1.5),
)


class ConformanceDrive:
    """Deterministic measurements of a robot with this rig; iterate with `measurements`.

    still: seconds of standstill at the start. Poses are `T_start_base`, the first pose being the identity.
    """

    def __init__(self, rig: SensorRig, still: float = 2.0, seed: int = 0) -> None:
        self._rig = rig
        self._still = still
        self._seed = seed
        self._segments = _segments()
        phi = np.linspace(0.0, 2.0 * math.pi, 7201)
        a, b = _HALF_AXES
        speed = np.hypot(a * np.cos(phi), b * np.sin(phi))
        steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(phi)
        self._phi, self._arc = phi, np.concatenate(([0.0], np.cumsum(steps)))
        self._T_start_room = invert(self._in_room(np.zeros(1)))[0]

    @property
    def lap(self) -> float:
        """Seconds per lap."""
        return float(self._arc[-1]) / _SPEED

    def pose(self, stamp: int) -> SE2:
        """The true `T_start_base` at an instant (ns)."""
        return SE2(*compose(self._T_start_room, self._in_room(np.array([stamp / NANOSECONDS])))[0].tolist())

    def measurements(self, begin: int, end: int, scans: bool = True) -> Iterator[Measurement]:
        """What the sensors say with begin <= stamp < end (ns), in stamp order, the same for every way to cut it.

        At equal stamps true pose and odometry come before the scan. scans: False leaves the LiDAR out.
        """
        odometry_period = round(NANOSECONDS / self._rig.odometry.rate)
        lidar = self._rig.lidar_2d if scans else None
        scan_period = round(NANOSECONDS / lidar.rate) if lidar else 1
        odometry = self._odometry(odometry_period)
        for stamp in _ticks(begin, end, odometry_period, scan_period if lidar else None):
            if stamp % odometry_period == 0:
                yield TruePose(stamp, self.pose(stamp))
                yield next(m for m in odometry if m.stamp == stamp)
            if lidar and stamp % scan_period == 0:
                yield self._scan(stamp, lidar)

    def _in_room(self, seconds: FloatArray) -> FloatArray:
        """(N, 3) poses in the room's frame: rest, one second of acceleration, then laps along the ellipse."""
        moving = np.maximum(0.0, seconds - self._still)
        ramp = np.minimum(moving, 1.0)
        along = _SPEED * (0.5 * ramp**2 + np.maximum(0.0, moving - 1.0))
        phi = np.interp(np.mod(along, self._arc[-1]), self._arc, self._phi)
        a, b = _HALF_AXES
        heading = np.arctan2(b * np.sin(phi), a * np.cos(phi))
        return np.stack([a * np.sin(phi), -b * np.cos(phi), heading], axis=-1)

    def _odometry(self, period: int) -> Iterator[WheelOdometry]:
        """Gyro-integrated odometry from the start of time, noise per period as the rig says."""
        noise, dt = self._rig.odometry, period / NANOSECONDS
        random = np.random.Generator(np.random.PCG64(self._seed))
        bias = noise.gyro_bias * random.standard_normal()
        gyro = noise.gyro_noise / math.sqrt(max(1.0, noise.gyro_rate * dt))
        previous, odometry = self.pose(0), SE2()
        stamp, linear, angular = 0, 0.0, 0.0
        while True:
            yield WheelOdometry(stamp, odometry, linear, angular)
            stamp += period
            pose = self.pose(stamp)
            turn = wrap_angle(pose.theta - previous.theta)
            distance = pose.distance_to(previous)
            slip = noise.slip * math.sqrt(distance) * random.standard_normal()
            linear = (distance * (1.0 + noise.scale) + slip) / dt
            angular = turn / dt + bias + gyro * random.standard_normal()
            half = 0.5 * angular * dt
            step = SE2(linear * dt * math.cos(half), linear * dt * math.sin(half), angular * dt)
            odometry, previous = odometry @ step, pose

    def _scan(self, stamp: int, lidar: Lidar2D) -> LaserScan:
        turn = round(NANOSECONDS / lidar.rate / lidar.samples) if lidar.rolling else 0
        seconds = (stamp - turn * np.arange(lidar.samples - 1, -1, -1)) / NANOSECONDS
        x, y, _ = lidar.mount.xyz
        laser = compose(self._in_room(seconds), np.array([x, y, lidar.mount.rpy[2]]))
        ranges = _cast(laser, lidar.angles(), self._segments)
        random = np.random.Generator(np.random.PCG64([self._seed, 1, stamp]))
        ranges += lidar.noise * random.standard_normal(len(ranges))
        ranges[(ranges < lidar.range_min) | (ranges > lidar.range_max)] = np.inf
        return LaserScan(
            stamp,
            ranges.astype(np.float32),
            lidar.angle_min,
            lidar.angle_increment,
            lidar.range_min,
            lidar.range_max,
            turn,
        )


def _ticks(begin: int, end: int, period: int, other: int | None) -> list[int]:
    ticks = set(range(-(-begin // period) * period, end, period))
    if other is not None:
        ticks |= set(range(-(-begin // other) * other, end, other))
    return sorted(ticks)


def _segments() -> FloatArray:
    """(S, 4) wall pieces as start x, y and direction x, y."""
    pieces = []
    for x0, y0, x1, y1 in _ROOM:
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        for (xa, ya), (xb, yb) in zip(corners, corners[1:] + corners[:1], strict=True):
            pieces.append((xa, ya, xb - xa, yb - ya))
    return np.array(pieces)


def _cast(laser: FloatArray, angles: FloatArray, segments: FloatArray) -> FloatArray:
    """(N,) distances of N rays, each from its own (x, y, theta), to the nearest segment.

    Ray o + t d meets segment p + u e where t = (p - o) x e / (d x e) and u = (p - o) x d / (d x e), 0 <= u <= 1.
    """
    heading = laser[:, 2] + angles
    dx, dy = np.cos(heading)[:, None], np.sin(heading)[:, None]
    px, py = segments[:, 0] - laser[:, :1], segments[:, 1] - laser[:, 1:2]
    ex, ey = segments[:, 2], segments[:, 3]
    cross = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (px * ey - py * ex) / cross
        u = (px * dy - py * dx) / cross
    distance: FloatArray = np.where((t > 0) & (u >= 0) & (u <= 1), t, np.inf).min(axis=1)
    return distance
