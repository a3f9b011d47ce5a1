"""`Simulator`: advances integer time, moves the robot, and yields measurements in stamp order.

Reads no wall clock. The same world, robot, seed and commands give the same measurements bit for bit. Physics steps are
5 ms of constant acceleration; a sensor may look at any instant in between, so its rate need not fit the steps.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from operator import attrgetter

from taskslam.errors import ScenarioError
from taskslam.geometry import SE2, wrap_angle
from taskslam.measurements import NANOSECONDS, Measurement, Sensor
from taskslam.robot import Robot
from taskslam.sensors import fitted
from taskslam.simulation.carpets import Carpets
from taskslam.simulation.contact import ContactGrid, contact_grid
from taskslam.simulation.drive import ramp, step_arc
from taskslam.simulation.fitting import LateClock
from taskslam.simulation.motion import Motion
from taskslam.simulation.motors import Motors
from taskslam.simulation.sensors.simulated_sensor import SimulatedSensor, Surroundings, simulated
from taskslam.simulation.sensors.wheel_odometry import WheelOdometer
from taskslam.world import World

STEP = NANOSECONDS // 200
DEFAULT_SENSORS = frozenset({Sensor.WHEEL_ODOMETRY, Sensor.LASER_SCAN})


@dataclass
class _Scheduled:
    """A sensor, the stamp of its next measurement, and how much earlier that is truly taken, ns."""

    device: SimulatedSensor
    clock: LateClock
    since: int
    taken: int = -1
    due: int = 0
    late: int = 0

    def __post_init__(self) -> None:
        self.step()

    def step(self) -> None:
        """The next measurement is due."""
        self.taken += 1
        self.late = self.clock.next()
        self.due = self.since + round((self.taken + 1) * NANOSECONDS / self.device.rate) + self.late

    def take(self, motion: Motion) -> Measurement:
        """What is due."""
        stamp, told = self.due, motion.late(self.late) if self.late else motion
        self.step()
        return self.device.measure(stamp, told)


class Simulator:
    """One robot in one world.

    lidar_geometry: `visual` as Gazebo's GPU ray sensor, `collision` as its CPU one. sensors: what is measured at all;
    a sensor that nobody listens to costs nothing.
    """

    def __init__(
        self,
        world: World,
        robot: Robot,
        seed: int,
        lidar_geometry: str = "visual",
        sensors: Collection[Sensor] = DEFAULT_SENSORS,
    ) -> None:
        self._robot = robot
        self._contact: ContactGrid = contact_grid(world, robot.footprint)
        self._odometer = WheelOdometer(robot.rig.odometry, robot.imperfections.odometry, seed)
        self._gyro_every = _whole_steps(robot.rig.odometry.gyro_rate, "odometry.gyro_rate")
        _whole_steps(robot.rig.odometry.rate, "odometry.rate")
        surroundings = Surroundings(world, seed, lidar_geometry, robot.imperfections)
        wanted = [kind for name, kind in fitted(robot.rig).items() if name in sensors and kind.device]
        by_rank = sorted(wanted, key=lambda kind: kind.rank)
        self._devices = [self._odometer, *(simulated(kind, robot.rig, surroundings) for kind in by_rank)]
        fields = ("odometry", *(kind.field for kind in by_rank))
        self._clocks = [LateClock(robot.imperfections.fitting(field), seed, field) for field in fields]
        self._motors = Motors(robot.imperfections.motors)
        self._carpets = Carpets(robot.imperfections.carpets, seed)
        self._resets = -1
        self.now = 0
        self.reset(SE2())

    def reset(self, pose: SE2) -> None:
        """Put the robot down at `pose` in `map`, at rest, with zeroed odometry; time goes on."""
        self._resets += 1
        self._x, self._y, self._theta = pose.x, pose.y, pose.theta
        self._linear = self._angular = 0.0
        self._distance = self._turned = 0.0
        self._command = (0.0, 0.0)
        self._command_until = self.now
        self._bumped = False
        self._motion = Motion(self.now, pose)
        self._steps = 0
        self._motors.reset()
        for device, clock in zip(self._devices, self._clocks, strict=True):
            device.reset(self._resets)
            clock.reset(self._resets)
        self._schedule = [
            _Scheduled(device, clock, self.now) for device, clock in zip(self._devices, self._clocks, strict=True)
        ]

    def go_on(self, now: int, resets: int) -> None:
        """Be as a simulator at time `now` (ns) after so many calls of `reset`; the next of them decides the rest."""
        self.now, self._resets = now, resets

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

    def advance(self, until: int) -> Iterator[Measurement]:
        """Run to simulated time `until` (ns), yielding measurements in stamp order, odometry first among equals."""
        while self.now + STEP <= until:
            self._move()
            while True:
                nearest = min(self._schedule, key=attrgetter("due"))
                if nearest.due > self.now:
                    break
                yield nearest.take(self._motion)

    def _move(self) -> None:
        limits, dt = self._robot.drive, STEP / NANOSECONDS
        linear, angular = self._command if self.now < self._command_until else (0.0, 0.0)
        linear, angular = self._motors.driven(linear, angular, dt)
        before = self._linear, self._angular
        self._linear = ramp(self._linear, linear, limits.max_linear_acceleration * dt)
        self._angular = ramp(self._angular, angular, limits.max_angular_acceleration * dt)
        # Acceleration is constant within a step, so the mean velocity carries the robot exactly as far.
        mean = 0.5 * (before[0] + self._linear), 0.5 * (before[1] + self._angular)
        x, y, theta = step_arc(self._x, self._y, self._theta, mean[0], mean[1], dt)
        counted, x, y = self._carpets.driven_over(mean[0] * dt, x, y)
        if (x, y) != (self._x, self._y) and self._contact.touches(x, y):
            # The obstacle holds the base; wheels slip no further than that, a turn in place still works.
            self._bumped = True
            x, y = self._x, self._y
            self._linear, counted = 0.0, 0.0
        self._x, self._y, self._theta = x, y, theta
        self._distance += counted
        self._turned += mean[1] * dt
        self.now += STEP
        self._motion.push(self.now, x, y, theta, self._linear, self._angular)
        self._steps += 1
        if self._steps % self._gyro_every == 0:
            self._odometer.integrate(self._distance, self._turned, self._gyro_every * dt)
            self._distance = self._turned = 0.0


def _whole_steps(rate: float, what: str) -> int:
    """Physics steps per period.

    Raises:
        ScenarioError: the period is not a whole number of physics steps.
    """
    period = NANOSECONDS / rate
    steps = round(period / STEP)
    if steps < 1 or abs(steps * STEP - period) > 1.0:
        raise ScenarioError(
            f"robot: {what} is {rate:g} Hz: its period must be a whole multiple of the physics step, {STEP / 1e6:g} ms"
        )
    return steps
