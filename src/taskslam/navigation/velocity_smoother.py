"""The last link of the velocity chain: no command asks the base for more acceleration than it has (protocol 3.6)."""

from __future__ import annotations

from dataclasses import dataclass

from taskslam.robot.robot import Drive


@dataclass(frozen=True, slots=True)
class Velocity:
    """A body velocity: linear in m/s along x, angular in rad/s about z."""

    linear: float = 0.0
    angular: float = 0.0


class VelocitySmoother:
    """Ramps the last command towards the target, one call per period.

    Both increments shrink by the same factor when either is too large, so a ramp keeps its direction in the
    (linear, angular) plane: the rule of the yocs velocity smoother. Speeds are limited first.
    """

    def __init__(self, drive: Drive, period: float) -> None:
        self._drive = drive
        self._linear_step = drive.max_linear_acceleration * period
        self._angular_step = drive.max_angular_acceleration * period
        self.last = Velocity()

    def reset(self) -> None:
        """Forget the last command: the base stands still."""
        self.last = Velocity()

    def step(self, target: Velocity) -> Velocity:
        """The command of this period on the way to `target`."""
        drive = self._drive
        linear = min(max(target.linear, -drive.max_backward), drive.max_linear)
        angular = min(max(target.angular, -drive.max_angular), drive.max_angular)
        d_linear, d_angular = linear - self.last.linear, angular - self.last.angular
        share = 1.0
        if abs(d_linear) > self._linear_step:
            share = self._linear_step / abs(d_linear)
        if abs(d_angular) * share > self._angular_step:
            share = self._angular_step / abs(d_angular)
        if share == 1.0:
            self.last = Velocity(linear, angular)
        else:
            self.last = Velocity(self.last.linear + share * d_linear, self.last.angular + share * d_angular)
        return self.last
