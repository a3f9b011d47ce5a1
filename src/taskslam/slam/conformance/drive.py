"""The drive on which `taskslam methods check` tries a method: laps in a furnished room, made from a formula.

It depends on numpy alone, not on the simulator, so that a method's author can read in one page what is fed. The robot
circles the island of the room (`conformance_room.py`) on an ellipse at 0.3 m/s after standing still for a while.
Everything follows from the rig and a seed. Images, and whatever other packages' sensors say, come from whoever makes
the drive: it renders nothing itself.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TypeAlias

import numpy as np

from taskslam.geometry import SE2, FloatArray, compose, invert, wrap, wrap_angle
from taskslam.measurements import (
    NANOSECONDS,
    ImuSamples,
    LaserScan,
    Measurement,
    PointCloud,
    Sensor,
    TruePose,
    WheelOdometry,
)
from taskslam.robot import Imperfections, Imu, Lidar2D, Lidar3D, SensorRig, load_robot
from taskslam.sensors import sensor_kind
from taskslam.slam.conformance.room import planar_distances, spatial_distances

_SPEED = 0.3
_HALF_AXES = (2.6, 1.8)
_INSTANT_S = 0.005  # half the time over which the turning rate is taken
_ORDINARY = "turtlebot2"
_GRAVITY = 9.8  # m/s^2, as in the simulator
Look: TypeAlias = Callable[[int, SE2], Measurement]
"""What a sensor of the rig says at a stamp (ns) with the base at a pose in the room's frame."""

BY_FORMULA = frozenset({Sensor.TRUE_POSE, Sensor.WHEEL_ODOMETRY, Sensor.IMU, Sensor.LASER_SCAN, Sensor.POINT_CLOUD})
_DEFAULT_SENSORS = frozenset({Sensor.TRUE_POSE, Sensor.WHEEL_ODOMETRY, Sensor.LASER_SCAN})


class ConformanceDrive:
    """Deterministic measurements of a robot with this rig; iterate with `measurements`.

    still: seconds of standstill at the start. sensors: what is measured at all, as far as the rig has it. looks: what
    the sensors say that no formula here knows, such as images (not in `BY_FORMULA`); without them those are silent.
    imperfections: what is wrong with the sensors, the TurtleBot's if not given.
    Poses are `T_start_base`, the first being the identity.
    """

    def __init__(
        self,
        rig: SensorRig,
        still: float = 2.0,
        seed: int = 0,
        sensors: Collection[Sensor] = _DEFAULT_SENSORS,
        looks: Mapping[Sensor, Look] | None = None,
        imperfections: Imperfections | None = None,
    ) -> None:
        self._rig = rig
        self._wrong = imperfections or load_robot(_ORDINARY).imperfections
        self._looks = looks or {}
        self._still = still
        self._seed = seed
        self._sensors = frozenset(sensors)
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

        At equal stamps true pose and odometry come first, then the IMU, the LiDARs, and images. scans: False leaves
        all but odometry and IMU out.
        """
        rig, sensors = self._rig, self._sensors
        streams = [self._odometry_with_truth(begin, end)]
        if rig.imu and Sensor.IMU in sensors:
            streams.append(self._inertial(stamp, rig.imu) for stamp in _ticks(begin, end, rig.imu.rate))
        if rig.lidar_2d and scans and Sensor.LASER_SCAN in sensors:
            streams.append(self._scan(stamp, rig.lidar_2d) for stamp in _ticks(begin, end, rig.lidar_2d.rate))
        if rig.lidar_3d and scans and Sensor.POINT_CLOUD in sensors:
            streams.append(self._cloud(stamp, rig.lidar_3d) for stamp in _ticks(begin, end, rig.lidar_3d.rate))
        if scans:
            for sensor, look in self._looks.items():
                rate = sensor_kind(sensor).part_of(rig).rate
                streams.append(self._looked(_ticks(begin, end, rate), look))
        yield from heapq.merge(*streams, key=lambda measurement: measurement.stamp)  # stable: earlier streams first

    def _in_room(self, seconds: FloatArray) -> FloatArray:
        """(N, 3) poses in the room's frame: rest, one second of acceleration, then laps along the ellipse."""
        moving = np.maximum(0.0, seconds - self._still)
        ramp = np.minimum(moving, 1.0)
        along = _SPEED * (0.5 * ramp**2 + np.maximum(0.0, moving - 1.0))
        phi = np.interp(np.mod(along, self._arc[-1]), self._arc, self._phi)
        a, b = _HALF_AXES
        heading = np.arctan2(b * np.sin(phi), a * np.cos(phi))
        return np.stack([a * np.sin(phi), -b * np.cos(phi), heading], axis=-1)

    def _odometry_with_truth(self, begin: int, end: int) -> Iterator[Measurement]:
        odometry = self._odometry(round(NANOSECONDS / self._rig.odometry.rate))
        for stamp in _ticks(begin, end, self._rig.odometry.rate):
            yield TruePose(stamp, self.pose(stamp))
            yield next(m for m in odometry if m.stamp == stamp)

    def _odometry(self, period: int) -> Iterator[WheelOdometry]:
        """Gyro-integrated odometry from the start of time, noise per period as the rig says."""
        noise, wrong, dt = self._rig.odometry, self._wrong.odometry, period / NANOSECONDS
        random = np.random.Generator(np.random.PCG64(self._seed))
        bias = wrong.gyro_bias * random.standard_normal()
        gyro = noise.gyro_noise / math.sqrt(max(1.0, noise.gyro_rate * dt))
        previous, odometry = self.pose(0), SE2()
        stamp, linear, angular = 0, 0.0, 0.0
        while True:
            yield WheelOdometry(stamp, odometry, linear, angular)
            stamp += period
            pose = self.pose(stamp)
            turn = wrap_angle(pose.theta - previous.theta)
            distance = pose.distance_to(previous)
            slip = wrong.slip * math.sqrt(distance) * random.standard_normal()
            linear = (distance * (1.0 + wrong.scale) + slip) / dt
            angular = turn / dt + bias + gyro * random.standard_normal()
            half = 0.5 * angular * dt
            step = SE2(linear * dt * math.cos(half), linear * dt * math.sin(half), angular * dt)
            odometry, previous = odometry @ step, pose

    def _scan(self, stamp: int, lidar: Lidar2D) -> LaserScan:
        turn = round(NANOSECONDS / lidar.rate / lidar.samples) if lidar.rolling else 0
        seconds = (stamp - turn * np.arange(lidar.samples - 1, -1, -1)) / NANOSECONDS
        x, y, _ = lidar.mount.xyz
        laser = compose(self._in_room(seconds), np.array([x, y, lidar.mount.rpy[2]]))
        ranges = planar_distances(laser, lidar.angles())
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

    def _cloud(self, stamp: int, lidar: Lidar3D) -> PointCloud:
        """One turn, ring by ring from the lowest, within a ring by azimuth from -pi."""
        azimuths = -np.pi + 2.0 * np.pi / lidar.samples * np.arange(lidar.samples)
        elevations = np.linspace(lidar.elevation_min, lidar.elevation_max, lidar.rings)
        elevation, azimuth = (grid.ravel() for grid in np.meshgrid(elevations, azimuths, indexing="ij"))
        directions = np.stack(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1
        )
        ages = np.arange(lidar.samples - 1, -1, -1) * (NANOSECONDS / lidar.rate / lidar.samples) * lidar.rolling
        sweep = np.tile(-np.round(ages).astype(np.int32), lidar.rings)
        base = self._in_room((stamp + sweep.astype(np.int64)) / NANOSECONDS)
        T = lidar.mount.matrix()
        origins = _turned(base[:, 2], np.broadcast_to(T[:3, 3], directions.shape))
        origins[:, :2] += base[:, :2]
        ranges = spatial_distances(origins, _turned(base[:, 2], directions @ T[:3, :3].T))
        seen = (ranges >= lidar.range_min) & (ranges <= lidar.range_max)
        random = np.random.Generator(np.random.PCG64([self._seed, 2, stamp]))
        ranges += lidar.noise * random.standard_normal(len(ranges))
        ring = np.repeat(np.arange(lidar.rings, dtype=np.uint16), lidar.samples)
        points = (directions[seen] * ranges[seen, None]).astype(np.float32)
        return PointCloud(stamp, points, ring[seen], sweep[seen])

    def _looked(self, stamps: range, look: Look) -> Iterator[Measurement]:
        for stamp in stamps:
            yield look(stamp, SE2(*self._in_room(np.array([stamp / NANOSECONDS]))[0].tolist()))

    def _inertial(self, stamp: int, imu: Imu) -> ImuSamples:
        """The mean over the period that ends at `stamp`, with the biases of the seed and noise of the stamp."""
        bias = np.random.Generator(np.random.PCG64([self._seed, 3])).standard_normal(6)
        noise = np.random.Generator(np.random.PCG64([self._seed, 3, stamp])).standard_normal(6)
        ends = stamp / NANOSECONDS + np.array([-1.0 / imu.rate, 0.0])
        poses, velocities = self._in_room(ends), self._velocity(ends, np.array(imu.mount.xyz))
        turn = wrap_angle(poses[1, 2] - poses[0, 2]) * imu.rate
        middle = poses[0, 2] + 0.5 * turn / imu.rate
        force = _turned(np.array([-middle]), (velocities[1:] - velocities[:1]) * imu.rate)[0]
        force[2] += _GRAVITY
        R_imu_base = imu.mount.matrix()[:3, :3].T
        gyro = (
            R_imu_base @ np.array([0.0, 0.0, turn]) + self._wrong.imu.gyro_bias * bias[:3] + imu.gyro_noise * noise[:3]
        )
        accel = R_imu_base @ force + self._wrong.imu.accel_bias * bias[3:] + imu.accel_noise * noise[3:]
        return ImuSamples(stamp, np.array([stamp], np.int64), gyro[None], accel[None])

    def _velocity(self, seconds: FloatArray, lever: FloatArray) -> FloatArray:
        """(N, 3) velocity in the room of a point at `lever` in the base."""
        heading = self._in_room(seconds)[:, 2]
        aside = self._in_room(seconds + _INSTANT_S)[:, 2] - self._in_room(seconds - _INSTANT_S)[:, 2]
        rate = wrap(aside) / (2 * _INSTANT_S)
        speed = _SPEED * np.clip(seconds - self._still, 0.0, 1.0)
        in_base = np.stack([speed - rate * lever[1], rate * lever[0], np.zeros_like(rate)], axis=-1)
        return _turned(heading, in_base)


def _ticks(begin: int, end: int, rate: float) -> range:
    """Whole periods (ns) in begin <= stamp < end."""
    period = round(NANOSECONDS / rate)
    return range(-(-begin // period) * period, end, period)


def _turned(heading: FloatArray, vectors: FloatArray) -> FloatArray:
    """(N, 3) vectors, each turned about z by its (N,) heading."""
    c, s = np.cos(heading), np.sin(heading)
    x, y, z = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)
