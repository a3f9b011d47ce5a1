"""`Simulator`: advances integer time, moves the robot, and yields measurements in stamp order.

Reads no wall clock. The same world, robot, seed and commands give the same measurements bit for bit. One physics step
is one gyro period (10 ms for the TurtleBot 2): motion is an exact arc within it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taskslam.errors import ScenarioError
from taskslam.geometry import SE2, FloatArray, wrap_angle
from taskslam.measurements import NANOSECONDS, LaserScan, WheelOdometry
from taskslam.robot import Robot
from taskslam.simulation.contact import ContactGrid, contact_grid
from taskslam.simulation.drive import ramp, step_arc
from taskslam.simulation.lidar import LaserScanner
from taskslam.simulation.raytracing import RayCaster
from taskslam.simulation.wheel_odometry import WheelOdometer
from taskslam.world import World


class Simulator:
    """One robot in one world. `lidar_geometry`: `visual` as Gazebo's GPU ray sensor, `collision` as its CPU one."""

    def __init__(self, world: World, robot: Robot, seed: int, lidar_geometry: str = "visual") -> None:
        self._robot = robot
        self._contact: ContactGrid = contact_grid(world, robot.footprint)
        self._odometer = WheelOdometer(robot.rig.odometry, seed)
        self._scanner: LaserScanner | None = None
        if robot.rig.lidar_2d is not None:
            mesh = world.visual if lidar_geometry == "visual" else world.collision
            self._scanner = LaserScanner(robot.rig.lidar_2d, RayCaster(mesh), seed)
        self._step = round(NANOSECONDS / robot.rig.odometry.gyro_rate)
        self._odometry_every = _steps(robot.rig.odometry.rate, self._step, "odometry")
        self._scan_every = _steps(robot.rig.lidar_2d.rate, self._step, "lidar_2d") if robot.rig.lidar_2d else 0
        self._resets = -1
        self.now = 0
        self.reset(SE2())

    def reset(self, pose: SE2) -> None:
        """Put the robot down at `pose` in `map`, at rest, with zeroed odometry; time goes on."""
        self._resets += 1
        self._x, self._y, self._theta = pose.x, pose.y, pose.theta
        self._linear = self._angular = 0.0
        self._command = (0.0, 0.0)
        self._command_until = self.now
        self._bumped = False
        self._odometer.reset(self._resets)
        if self._scanner is not None:
            self._scanner.reset(self._resets)
        self._history: list[tuple[float, float, float]] = [(pose.x, pose.y, pose.theta)]
        self._ticks = 0

    def drive(self, linear: float, angular: float) -> None:
        """Command body velocities (m/s, rad/s); they lapse after the drive's command timeout."""
        limits = self._robot.drive
        self._command = (
            min(max(linear, -limits.max_backward), limits.max_linear),
            min(max(angular, -limits.max_angular), limits.max_angular),
        )
        self._command_until = self.now + round(limits.command_timeout * NANOSECONDS)

    def true_pose(self) -> SE2:
        """The true pose of the base in `map`: for the record and for nobody who steers."""
        return SE2(self._x, self._y, wrap_angle(self._theta))

    def bumped(self) -> bool:
        """Whether the robot has touched anything since the last reset or the last call; the flag is then cleared."""
        was, self._bumped = self._bumped, False
        return was

    def touches(self, pose: SE2) -> bool:
        """Whether the robot would touch something if it stood at `pose`."""
        return self._contact.touches(pose.x, pose.y)

    def advance(self, until: int) -> Iterator[WheelOdometry | LaserScan]:
        """Run to simulated time `until` (ns), yielding measurements as they become due, odometry before scans."""
        while self.now + self._step <= until:
            self._move()
            self._ticks += 1
            if self._ticks % self._odometry_every == 0:
                yield self._odometer.read(self.now)
            if self._scanner is not None and self._ticks % self._scan_every == 0:
                yield self._scanner.scan(self.now, self._poses_of_scan(self._scanner))

    def _move(self) -> None:
        limits, dt = self._robot.drive, self._step / NANOSECONDS
        linear, angular = self._command if self.now < self._command_until else (0.0, 0.0)
        before = self._linear, self._angular
        self._linear = ramp(self._linear, linear, limits.max_linear_acceleration * dt)
        self._angular = ramp(self._angular, angular, limits.max_angular_acceleration * dt)
        # Acceleration is constant within a step, so the mean velocity carries the robot exactly as far.
        mean = 0.5 * (before[0] + self._linear), 0.5 * (before[1] + self._angular)
        x, y, theta = step_arc(self._x, self._y, self._theta, mean[0], mean[1], dt)
        if (x, y) != (self._x, self._y) and self._contact.touches(x, y):
            # The obstacle holds the base; wheels slip no further than that, a turn in place still works.
            self._bumped = True
            x, y = self._x, self._y
            self._linear, mean = 0.0, (0.0, mean[1])
        self._odometer.integrate(mean[0] * dt, mean[1] * dt, dt)
        self._x, self._y, self._theta = x, y, theta
        self.now += self._step
        self._history.append((x, y, theta))
        if len(self._history) > max(self._scan_every, 1) + 1:
            del self._history[0]

    def _poses_of_scan(self, scanner: LaserScanner) -> FloatArray:
        """(1, 3) the pose now, or for a rolling scan (samples, 3), each ray's pose interpolated in the last period."""
        if not scanner.time_increment:
            return np.array([[self._x, self._y, self._theta]])
        past = np.array(self._history)
        samples = self._robot.rig.lidar_2d.samples if self._robot.rig.lidar_2d else 0
        ages = np.arange(samples - 1, -1, -1) * scanner.time_increment
        steps_ago = np.minimum(ages / self._step, len(past) - 1.0)
        at = len(past) - 1 - steps_ago
        return np.stack([np.interp(at, np.arange(len(past)), past[:, k]) for k in range(3)], axis=1)


def _steps(rate: float, step: int, what: str) -> int:
    """Physics steps per measurement.

    Raises:
        ScenarioError: the sensor's period is not a whole number of physics steps.
    """
    period = NANOSECONDS / rate
    steps = round(period / step)
    if steps < 1 or abs(steps * step - period) > 1.0:
        raise ScenarioError(
            f"robot: {what}.rate {rate:g} Hz: its period must be a whole multiple of the gyro period, {step / 1e6:g} ms"
        )
    return steps
