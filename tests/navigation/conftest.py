"""A kinematic robot in a grid, with a perfect pose: enough to close the loop around the navigator alone."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from scipy import ndimage

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.navigation.navigator import Navigator
from taskslam.outcomes import Outcome
from taskslam.robot import load_robot
from taskslam.world.floor_plan import OCCUPIED, FloorPlan

IDENTITY = SE2()
PERIOD = NANOSECONDS // 20


@njit  # no cache: pytest gives this file a module name that cannot be imported again
def _cast(occupied, resolution, x, y, angles, limit):
    rows, columns = occupied.shape
    ranges = np.full(len(angles), np.inf)
    for i in range(len(angles)):
        c, s = math.cos(angles[i]), math.sin(angles[i])
        u, v = math.floor(x / resolution), math.floor(y / resolution)
        step_u, step_v = (1 if c > 0 else -1), (1 if s > 0 else -1)
        next_u = ((u + (c > 0)) * resolution - x) / c if c != 0 else np.inf
        next_v = ((v + (s > 0)) * resolution - y) / s if s != 0 else np.inf
        travelled = 0.0
        while travelled < limit:
            if next_u < next_v:
                travelled = next_u
                next_u += resolution / abs(c)
                u += step_u
            else:
                travelled = next_v
                next_v += resolution / abs(s)
                v += step_v
            if u < 0 or v < 0 or u >= columns or v >= rows:
                break
            if occupied[v, u]:
                ranges[i] = travelled
                break
    return ranges


@dataclass
class Drive:
    """What one goal, or a tour, left behind."""

    outcome: Outcome | None
    detail: str
    seconds: float
    poses: np.ndarray = field(repr=False)
    clearance: float = math.inf


class Simulation:
    """A unicycle with acceleration limits and an exact laser in the `real` grid; the navigator knows `plan` only."""

    def __init__(self, plan: FloorPlan, pose: SE2, real: FloorPlan | None = None, drift: SE2 = IDENTITY, seed: int = 0):
        self.robot = load_robot("turtlebot2")
        self.real = real if real is not None else plan
        self.occupied = self.real.cells == OCCUPIED
        self.clearances = ndimage.distance_transform_edt(~self.occupied) * self.real.resolution
        self.navigator = Navigator(plan, self.robot)
        self.pose, self.linear, self.angular, self.now = pose, 0.0, 0.0, 0
        self.T_map_odom = drift
        self.random = np.random.default_rng(seed)
        self.bumped = False

    def scan(self) -> LaserScan:
        lidar = self.robot.rig.lidar_2d
        laser = self.real.origin.inverse() @ self.pose @ SE2.from_matrix(lidar.mount.matrix())
        ranges = _cast(
            self.occupied, self.real.resolution, laser.x, laser.y, lidar.angles() + laser.theta, lidar.range_max
        )
        ranges += self.random.normal(0.0, lidar.noise, len(ranges))
        return LaserScan(
            self.now,
            ranges.astype(np.float32),
            lidar.angle_min,
            lidar.angle_increment,
            lidar.range_min,
            lidar.range_max,
        )

    def step(self):
        """20 Hz: scan every other step, then 50 ms of driving under the drive's limits."""
        T_map_odom = self.T_map_odom
        T_odom_base = self.pose  # odometry is exact; the drift stands in map -> odom alone
        if self.now // PERIOD % 2 == 0:
            self.navigator.sense(self.scan(), T_map_odom, T_odom_base)
        step = self.navigator.step(self.now, T_map_odom, T_odom_base, self.linear, self.angular, self.bumped)
        dt = PERIOD / NANOSECONDS
        drive = self.robot.drive
        dv, dw = drive.max_linear_acceleration * dt, drive.max_angular_acceleration * dt
        self.linear += min(max(step.linear - self.linear, -dv), dv)
        self.angular += min(max(step.angular - self.angular, -dw), dw)
        middle = self.pose.theta + 0.5 * self.angular * dt
        self.pose = SE2(
            self.pose.x + self.linear * dt * math.cos(middle),
            self.pose.y + self.linear * dt * math.sin(middle),
            self.pose.theta + self.angular * dt,
        )
        self.now += PERIOD
        return step

    def idle(self, seconds: float) -> None:
        for _ in range(round(seconds * 20)):
            self.step()

    def clearance(self) -> float:
        row, column = self.real.cells_of(np.array([[self.pose.x, self.pose.y]]))[0]
        return float(self.clearances[row, column]) - 0.5 * self.real.resolution

    def go(self, goal: SE2, limit_s: float = 300.0) -> Drive:
        self.navigator.start_goal(goal, self.now)
        begun, poses, nearest = self.now, [], math.inf
        while self.now - begun < limit_s * NANOSECONDS:
            step = self.step()
            poses.append((self.pose.x, self.pose.y, self.pose.theta, self.linear, self.angular))
            nearest = min(nearest, self.clearance())
            if step.outcome is not None:
                return Drive(step.outcome, step.detail, (self.now - begun) / NANOSECONDS, np.array(poses), nearest)
        return Drive(None, "", limit_s, np.array(poses), nearest)


def grid(width: float, height: float, boxes: list[tuple[float, float, float, float]], resolution: float) -> FloorPlan:
    cells = np.zeros((round(height / resolution), round(width / resolution)), np.uint8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    for x0, y0, x1, y1 in boxes:
        rows = slice(round(y0 / resolution), round(y1 / resolution))
        cells[rows, round(x0 / resolution) : round(x1 / resolution)] = OCCUPIED
    return FloorPlan(cells, resolution, SE2())


@pytest.fixture
def make_plan():
    """(width, height, boxes [(x0, y0, x1, y1)], resolution) -> a walled room with boxes, corner at (0, 0)."""

    def make(width, height, boxes=(), resolution=0.05):
        return grid(width, height, list(boxes), resolution)

    return make


@pytest.fixture
def simulate():
    return Simulation


@pytest.fixture
def data() -> Path:
    folder = Path(os.environ.get("TASKSLAM_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no test data at {folder}: set TASKSLAM_DATA")
    return folder
