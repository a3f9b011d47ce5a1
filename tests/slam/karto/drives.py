"""Recorded drives for tests: a planar world of walls, a robot that tours waypoints in it, its scans and odometry.

The sensors follow the turtlebot2 preset: 1024 beams, 10 m, sigma 1 cm, ranges in whole centimetres, 10 Hz; odometry
with gyro-integrated heading (protocol 4.6). A stand-in for the simulator that needs no world and no ray tracer.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from taskslam.geometry import SE2, compose, invert, wrap
from taskslam.measurements import LaserScan, Measurement, WheelOdometry
from taskslam.robot import Robot, load_robot
from taskslam.slam.base import SlamMethod

STEP = 20_000_000  # ns: 50 Hz
SCAN_EVERY = 5


@dataclass(frozen=True)
class Drive:
    """Measurements in stamp order; truth: (N, 3) pose of the base at each scan, seen from the first."""

    robot: Robot
    measurements: list[Measurement]
    truth: np.ndarray

    @property
    def scans(self) -> list[LaserScan]:
        return [m for m in self.measurements if isinstance(m, LaserScan)]


def box(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float, float, float]]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


def rooms() -> np.ndarray:
    """(N, 4) segments: a loop of corridors, about 60 m round, with rooms, doors and furniture."""
    walls = box(0, 0, 22, 14) + box(2.2, 2.2, 8, 11.8) + box(14, 2.2, 19.8, 11.8)
    walls += box(9.8, 4, 12.2, 9)
    walls += [(8, 7, 8.9, 7), (13.1, 6, 14, 6)]
    rng = np.random.default_rng(7)
    for _ in range(14):  # furniture along the walls
        side = rng.integers(4)
        along = rng.uniform(0.06, 0.94)
        w, d = rng.uniform(0.3, 0.9), rng.uniform(0.2, 0.45)
        x, y = [(22 * along, 0.0), (22 * along, 14 - d), (0.0, 14 * along), (22 - d, 14 * along)][side]
        walls += box(x, y, x + (w if side < 2 else d), y + (d if side < 2 else w))
    return np.array(walls)


def corridor(length: float) -> np.ndarray:
    """A straight corridor, 2 m wide, closed at both ends, with a door frame every 6 m on one side."""
    walls = box(0, 0, length, 2)
    for x in np.arange(3, length - 1, 6.0):
        walls += box(x, 1.9, x + 0.15, 2)
    return np.array(walls)


ROOMS_TOUR = np.array(
    [(1.1, 1.1), (11, 1.1), (20.9, 1.1), (20.9, 12.9), (13.1, 12.9), (13.1, 8.5), (13.1, 12.9), (1.1, 12.9), (1.1, 1.1)]
)


def drive(
    walls: np.ndarray,
    waypoints: np.ndarray,
    *,
    seed: int = 0,
    rounds: int = 1,
    pause: float = 1.0,
    bias: float | None = None,
    scale: float | None = None,
    rolling: bool = False,
    speed: float = 0.3,
) -> Drive:
    """Tour the waypoints (N, 2), stopping at each, `rounds` times."""
    rng = np.random.default_rng(seed)
    robot = load_robot("turtlebot2")
    truth = np.array(_trajectory(np.concatenate([waypoints] + [waypoints[1:]] * (rounds - 1)), pause, speed))
    odometry = _odometry(truth, robot, rng, bias, scale)
    measurements: list[Measurement] = []
    start = invert(truth[0])
    at_scans = []
    for k, (pose, odom) in enumerate(zip(truth, odometry, strict=True)):
        ahead = compose(invert(odometry[max(k - 1, 0)]), odom)
        rate = 1e9 / STEP
        sample = WheelOdometry(k * STEP, SE2(*odom), float(ahead[0] * rate), float(ahead[2] * rate))
        measurements.append(sample)
        if k % SCAN_EVERY == 0 and k + SCAN_EVERY < len(truth):
            previous = truth[max(k - SCAN_EVERY, 0)] if rolling else None
            measurements.append(_scan(walls, robot, previous, pose, k * STEP, rng))
            at_scans.append(compose(start, pose))
    return Drive(robot, measurements, np.array(at_scans))


def _trajectory(waypoints: np.ndarray, pause: float, speed: float) -> list[np.ndarray]:
    dt = STEP * 1e-9
    first = waypoints[1] - waypoints[0]
    pose = np.array([*waypoints[0], np.arctan2(first[1], first[0])])
    poses = [pose.copy()] * round(1.0 / dt)
    v = w = 0.0
    for goal in waypoints[1:]:
        while np.hypot(*(goal - pose[:2])) > 0.05:
            heading = np.arctan2(*(goal - pose[:2])[::-1])
            error = float(wrap(heading - pose[2]))
            remaining = float(np.hypot(*(goal - pose[:2])))
            want_w = float(np.clip(2.0 * error, -0.8, 0.8))
            want_v = 0.0 if abs(error) > 0.5 else min(speed, remaining + 0.05) * np.cos(error)
            v += float(np.clip(want_v - v, -0.6 * dt, 0.6 * dt))
            w += float(np.clip(want_w - w, -3.0 * dt, 3.0 * dt))
            pose = compose(pose, np.array([v * dt * np.cos(w * dt / 2), v * dt * np.sin(w * dt / 2), w * dt]))
            poses.append(pose)
        v = w = 0.0
        poses += [pose] * round(pause / dt)
    return poses


def _odometry(
    truth: np.ndarray, robot: Robot, rng: np.random.Generator, bias: float | None, scale: float | None
) -> np.ndarray:
    noise, wrong = robot.rig.odometry, robot.imperfections.odometry
    dt = STEP * 1e-9
    drift = rng.normal(0, wrong.gyro_bias) if bias is None else bias
    stretch = 1 + (wrong.scale if scale is None else scale)
    steps = compose(invert(truth[:-1]), truth[1:])
    length = np.hypot(steps[:, 0], steps[:, 1])
    factor = stretch + wrong.slip * rng.normal(size=len(steps)) / np.sqrt(np.maximum(length, 1e-6))
    steps[:, :2] *= np.where(length > 1e-9, factor, 1.0)[:, None]
    per_step = noise.gyro_noise / noise.gyro_rate * np.sqrt(noise.gyro_rate * dt)
    steps[:, 2] += drift * dt + per_step * rng.normal(size=len(steps))
    pose = np.array([3.0, -2.0, 0.7])  # odom is any frame
    out = [pose]
    for step in steps:
        pose = compose(pose, step)
        out.append(pose)
    return np.array(out)


def _scan(
    walls: np.ndarray,
    robot: Robot,
    previous: np.ndarray | None,
    pose: np.ndarray,
    stamp: int,
    rng: np.random.Generator,
) -> LaserScan:
    lidar = robot.rig.lidar_2d
    assert lidar is not None
    share = np.linspace(-1, 0, lidar.samples) if previous is not None else np.zeros(lidar.samples)
    step = -compose(invert(pose), previous) if previous is not None else np.zeros(3)
    poses = compose(np.broadcast_to(pose, (lidar.samples, 3)), share[:, None] * step)
    origins = poses[:, :2] + lidar.mount.xyz[0] * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    ranges = cast(walls, origins, poses[:, 2] + lidar.angles())
    ranges = ranges + rng.normal(0, lidar.noise, len(ranges))
    ranges = np.round(ranges / lidar.resolution) * lidar.resolution
    ranges[(ranges > lidar.range_max) | (ranges < lidar.range_min)] = np.inf
    gap = round(SCAN_EVERY * STEP / lidar.samples) if previous is not None else 0
    return LaserScan(
        stamp,
        ranges.astype(np.float32),
        lidar.angle_min,
        lidar.angle_increment,
        lidar.range_min,
        lidar.range_max,
        gap,
    )


@njit(cache=True)
def cast(walls: np.ndarray, origins: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(N,) distance to the first wall segment along each ray; +inf for none."""
    out = np.full(angles.shape[0], np.inf)
    for k in range(angles.shape[0]):
        dx, dy = np.cos(angles[k]), np.sin(angles[k])
        ox, oy = origins[k, 0], origins[k, 1]
        for w in range(walls.shape[0]):
            ax, ay = walls[w, 0] - ox, walls[w, 1] - oy
            ex, ey = walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
            cross = dx * ey - dy * ex
            if abs(cross) < 1e-12:
                continue
            t = (ax * ey - ay * ex) / cross
            u = (ax * dy - ay * dx) / cross
            if t > 0.0 and 0.0 <= u <= 1.0 and t < out[k]:
                out[k] = t
    return out


@dataclass(frozen=True)
class Followed:
    """What a method said at each scan, beside the truth."""

    estimates: np.ndarray
    truth: np.ndarray
    statuses: list[str]
    seconds: np.ndarray

    @property
    def errors(self) -> np.ndarray:
        """(N,) planar distance to the truth; both begin at the identity."""
        return np.hypot(*(self.estimates - self.truth)[:, :2].T)

    @property
    def headings(self) -> np.ndarray:
        return np.abs(wrap(self.estimates[:, 2] - self.truth[:, 2]))


def follow(method: SlamMethod, recorded: Drive) -> Followed:
    """Feed a drive to a started method; seconds: CPU time of each scan."""
    estimates, statuses, seconds = [], [], []
    for measurement in recorded.measurements:
        begun = time.process_time()
        estimate = method.feed(measurement)
        if estimate is None:
            continue
        seconds.append(time.process_time() - begun)
        assert estimate.stamp == measurement.stamp
        estimates.append(SE2.from_matrix(estimate.T_start_base).array())
        statuses.append(estimate.status.value)
    return Followed(np.array(estimates), recorded.truth, statuses, np.array(seconds))


def part(recorded: Drive, first: int, last: int) -> Drive:
    """Scans first to last of a drive with the odometry between them, seen from the first."""
    scans = [k for k, m in enumerate(recorded.measurements) if isinstance(m, LaserScan)]
    begin = scans[first] - 1  # odometry of the same instant stands before its scan
    end = scans[last] if last < len(scans) else len(recorded.measurements)
    truth = compose(invert(recorded.truth[first]), recorded.truth[first:last])
    return Drive(recorded.robot, recorded.measurements[begin:end], truth)


def joined(before: Drive, after: Drive) -> Drive:
    """One drive after another with the odometry and the time going on: the robot was carried in between."""
    last = [m for m in before.measurements if isinstance(m, WheelOdometry)][-1]
    first = next(m for m in after.measurements if isinstance(m, WheelOdometry))
    frame = last.T_odom_base @ first.T_odom_base.inverse()
    later = last.stamp + STEP - first.stamp
    moved: list[Measurement] = [
        replace(m, stamp=m.stamp + later, T_odom_base=frame @ m.T_odom_base)
        if isinstance(m, WheelOdometry)
        else replace(m, stamp=m.stamp + later)
        for m in after.measurements
    ]
    return Drive(before.robot, before.measurements + moved, np.concatenate([before.truth, after.truth]))
