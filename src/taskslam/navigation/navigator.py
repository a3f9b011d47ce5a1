"""`Navigator`: drives to one goal at a time and says how it ended, on the SLAM-based pose alone.

What move_base does with recovery behaviours off (protocol 1.5, 3.2): a plan at 1 Hz, control at 5 Hz, costmaps at their
own rates, and four reasons to give up, plus our own time limit. Time is the simulated `now`, in ns; no clock is read
and no true pose is ever seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import SE2, FloatArray, transform_points, wrap_angle
from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.navigation.costmap import GlobalCostmap, LocalCostmap
from taskslam.navigation.global_planner import plan_path
from taskslam.navigation.local_planner import ControlRequest, LocalPlanner
from taskslam.navigation.obstacle_layer import PlacedScan
from taskslam.navigation.patience import Patience
from taskslam.navigation.settings import NavigationSettings
from taskslam.navigation.teb import TebPlanner
from taskslam.navigation.velocity_smoother import Velocity, VelocitySmoother
from taskslam.outcomes import Outcome
from taskslam.robot.robot import Robot
from taskslam.world.floor_plan import FloorPlan


@dataclass(frozen=True, slots=True)
class Step:
    """One smoother period: the command for the drive (m/s, rad/s), and how the goal ended, if it did just now.

    detail: where and why, one sentence; empty while the goal is under way or there is none.
    """

    linear: float
    angular: float
    outcome: Outcome | None = None
    detail: str = ""


@dataclass(frozen=True, slots=True)
class NavigatorView:
    """A look inside for figures. path: the newest global path in `map`, (N, 2), or None; costmaps live, not copied."""

    path: FloatArray | None
    global_costmap: GlobalCostmap
    local_costmap: LocalCostmap
    local_planner: LocalPlanner


class _Timer:
    """Due at once, then every period, in simulated time."""

    def __init__(self, rate: float) -> None:
        self._period = round(NANOSECONDS / rate)
        self._next: int | None = None

    def reset(self) -> None:
        self._next = None

    def due(self, now: int) -> bool:
        if self._next is not None and now < self._next:
            return False
        late = self._next is None or now - self._next >= self._period
        self._next = (now if self._next is None or late else self._next) + self._period
        return True


class Navigator:
    """One goal at a time. Call `sense` for every scan and `step` every smoother period (20 Hz)."""

    def __init__(
        self,
        plan: FloorPlan,
        robot: Robot,
        settings: NavigationSettings | None = None,
        local_planner: LocalPlanner | None = None,
    ) -> None:
        self._settings = s = settings if settings is not None else NavigationSettings()
        self._global = GlobalCostmap(plan, s.costmap)
        self._local = LocalCostmap(plan, s.costmap)
        self._planner: LocalPlanner = local_planner if local_planner is not None else TebPlanner(s.teb)
        self._smoother = VelocitySmoother(robot.drive, 1.0 / s.smoother_rate)
        lidar = robot.rig.lidar_2d
        self._T_base_laser = SE2.from_matrix(lidar.mount.matrix()) if lidar is not None else SE2()
        self._control_timer = _Timer(s.controller_rate)
        self._local_timer = _Timer(s.costmap.local_rate)
        self._global_timer = _Timer(s.costmap.global_rate)
        self._plan_timer = _Timer(s.global_planner.rate)
        self._scan: PlacedScan | None = None
        self._goal: SE2 | None = None
        self._patience: Patience | None = None
        self._path: FloatArray | None = None
        self._planning = True
        self._target = Velocity()

    def reset(self) -> None:
        """A new round without map: costmaps, plans, scans and the last command are forgotten."""
        self._global.reset()
        self._local.reset()
        self._smoother.reset()
        for timer in (self._control_timer, self._local_timer, self._global_timer):
            timer.reset()
        self._scan = None
        self._forget_goal()

    def start_goal(self, goal: SE2, now: int) -> None:
        """Set off for a goal in `map`; the present one, if any, is dropped."""
        self._forget_goal()
        self._goal = goal
        self._patience = Patience(self._settings.goal, now)

    def halt(self) -> None:
        """The goal is dropped and the robot stands: the next command starts from zero speed."""
        self._smoother.reset()
        self._forget_goal()

    def sense(self, scan: LaserScan, T_map_odom: SE2, T_odom_base: SE2) -> None:
        """Keep a scan for the next costmap update; T_odom_base at the scan's stamp."""
        self._scan = PlacedScan.of(scan, T_map_odom, T_odom_base, self._T_base_laser)

    def scan_in_map(self) -> FloatArray:
        """(N, 2) points in `map` that the newest scan has hit, where localization put them; none before the first."""
        scan = self._scan
        if scan is None:
            return np.empty((0, 2))
        rays = np.column_stack([np.cos(scan.angles), np.sin(scan.angles)])
        return transform_points(scan.T_map_laser, scan.ranges[:, None] * rays)

    def step(self, now: int, T_map_odom: SE2, T_odom_base: SE2, linear: float, angular: float, bumped: bool) -> Step:
        """The command for the next period. linear, angular: measured by odometry, m/s and rad/s."""
        pose = T_map_odom @ T_odom_base
        if self._local_timer.due(now):
            self._local.update(self._scan, T_map_odom, T_odom_base)
        if self._global_timer.due(now):
            self._global.update(self._scan, pose)
        outcome, detail = None, ""
        if self._goal is not None and self._patience is not None:
            outcome, detail = self._pursue(
                self._goal, self._patience, now, T_map_odom, T_odom_base, Velocity(linear, angular), bumped
            )
            if outcome is not None:
                self._forget_goal()
        command = self._smoother.step(self._target)
        return Step(command.linear, command.angular, outcome, detail)

    @property
    def debug(self) -> NavigatorView:
        """What the planners are thinking, for figures and tests."""
        return NavigatorView(self._path, self._global, self._local, self._planner)

    def _forget_goal(self) -> None:
        self._goal = None
        self._patience = None
        self._path = None
        self._planning = True
        self._target = Velocity()
        self._plan_timer.reset()
        self._planner.reset()

    def _pursue(
        self,
        goal: SE2,
        patience: Patience,
        now: int,
        T_map_odom: SE2,
        T_odom_base: SE2,
        velocity: Velocity,
        bumped: bool,
    ) -> tuple[Outcome | None, str]:
        pose = T_map_odom @ T_odom_base
        where = f"at ({pose.x:.2f}, {pose.y:.2f}), {pose.distance_to(goal):.2f} m from the goal"
        if bumped:
            return Outcome.BUMPED, f"The bumper was pressed {where}."
        if self._plan_timer.due(now):
            self._replan(goal, pose, patience, now)
        if self._control_timer.due(now):
            if self._reached(goal, pose, velocity):
                error = wrap_angle(pose.theta - goal.theta)
                return Outcome.REACHED, f"Reached {where}, heading {error:+.2f} rad off."
            patience.moved(pose, now)
            self._control(goal, pose, patience, now, T_map_odom, T_odom_base, velocity)
        return patience.exhausted(now, self._planning, where)

    def _reached(self, goal: SE2, pose: SE2, velocity: Velocity) -> bool:
        g = self._settings.goal
        return (
            pose.distance_to(goal) < g.xy_tolerance
            and abs(wrap_angle(pose.theta - goal.theta)) < g.yaw_tolerance
            and abs(velocity.linear) < g.trans_stopped_velocity
            and abs(velocity.angular) < g.theta_stopped_velocity
        )

    def _replan(self, goal: SE2, pose: SE2, patience: Patience, now: int) -> None:
        path = plan_path(self._global, pose, goal, self._settings.global_planner)
        if path is None:
            return  # while control goes well, the robot goes on along its last path, as under move_base
        if self._path is None:
            length = np.hypot(*np.diff(path, axis=0).T).sum()
            patience.allow_time(now, float(length), self._settings.teb.max_vel_x)
        self._path = path
        self._planning = False
        patience.planned(now)

    def _control(
        self, goal: SE2, pose: SE2, patience: Patience, now: int, T_map_odom: SE2, T_odom_base: SE2, velocity: Velocity
    ) -> None:
        if self._planning or self._path is None:
            self._target = Velocity()
            return
        T_odom_map = T_map_odom.inverse()
        request = ControlRequest(
            now=now,
            pose=T_odom_base,
            velocity=velocity,
            path=transform_points(T_odom_map, self._path),
            goal=T_odom_map @ goal,
            costmap=self._local,
        )
        command = self._planner.command(request)
        if command is None:
            # stand still and ask for a new plan at once
            self._target = Velocity()
            self._planning = True
            patience.planned(now)
            self._replan(goal, pose, patience, now)
            return
        self._target = command
        patience.controlled(now)
