"""`TebPlanner`: the local planner, a timed elastic band in several homotopy classes (protocol 3.5).

Sources: Roesmann et al. 2012 and 2013 (the band and its optimisation), 2017 (distinct homotopy classes).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taskslam.geometry import SE2, FloatArray, mean_heading, wrap_angle
from taskslam.measurements import NANOSECONDS
from taskslam.navigation.band import initial_band, warm_start
from taskslam.navigation.costmap import LocalCostmap
from taskslam.navigation.homotopy import ObstacleMap, distinct_paths, same_class, signature
from taskslam.navigation.inflation import INSCRIBED
from taskslam.navigation.local_planner import ControlRequest
from taskslam.navigation.settings import TebSettings
from taskslam.navigation.teb_problem import TebParameters
from taskslam.navigation.teb_solver import optimize
from taskslam.navigation.velocity_smoother import Velocity
from taskslam.robot.robot import Robot


@dataclass(slots=True)
class Band:
    """z: (capacity, 4) rows x, y, theta, dt; n poses used. `signature`: winding angles in the present obstacle map."""

    z: FloatArray
    n: int
    signature: FloatArray
    cost: float = math.inf

    def duration(self) -> float:
        """Seconds from first to last pose."""
        return float(self.z[: self.n - 1, 3].sum())

    def poses(self) -> FloatArray:
        """(n, 3) copy of the poses."""
        return self.z[: self.n, :3].copy()


def build_teb(_robot: Robot) -> TebPlanner:
    """The planner `teb`: as the paper tuned it for its own robot, the same for all."""
    return TebPlanner(TebSettings())


class TebPlanner:
    """Keeps the bands of the last step, best first, and optimises them anew from where the robot is now."""

    def __init__(self, settings: TebSettings) -> None:
        self._settings = settings
        self._parameters = TebParameters.of(settings)
        self._bands: list[Band] = []
        self._last_infeasible: int | None = None
        self._was_selected = False
        self._round = 0

    def reset(self) -> None:
        """Forget all bands and past failures."""
        self._bands = []
        self._last_infeasible = None
        self._was_selected = False
        self._round = 0

    @property
    def best(self) -> Band | None:
        """The band behind the last command."""
        return self._bands[0] if self._bands else None

    @property
    def bands(self) -> tuple[Band, ...]:
        """All bands of the last step, the selected one first."""
        return tuple(self._bands)

    def command(self, request: ControlRequest) -> Velocity | None:
        """The first interval's velocity of the best admissible band, within the speed limits; None if there is none."""
        pose, s = request.pose, self._settings
        line, goal = self._local_goal(request)
        obstacle_map = ObstacleMap.of(request.costmap)
        plan_signature = signature(line, len(line), obstacle_map.inside)
        self._renew(pose, goal, obstacle_map)
        self._explore(line, plan_signature, pose, goal, obstacle_map)

        obstacles = request.costmap.obstacles(pose, s.costmap_obstacles_behind_robot_dist)
        for index, band in enumerate(self._bands):
            self._optimize(band, request.velocity, obstacles)
            if index == 0 and self._was_selected:
                band.cost *= s.selection_cost_hysteresis
            elif same_class(band.signature, plan_signature):
                band.cost *= s.selection_prefer_initial_plan
        self._bands = [band for band in self._bands if math.isfinite(band.cost)]
        quickest = min((band.duration() for band in self._bands), default=0.0)
        limit = s.max_ratio_detours_duration * quickest
        self._bands = [
            band
            for index, band in enumerate(self._bands)
            if band.duration() <= limit and (index == 0 or not _sets_off_backwards(band, s.detours_start_length))
        ]
        self._bands.sort(key=lambda band: band.cost)
        while self._bands and not _feasible(self._bands[0], request.costmap, s.feasibility_check_no_poses):
            del self._bands[0]
        if not self._bands:
            self._last_infeasible = request.now
            return None
        return self._first_velocity(self._bands[0])

    def _local_goal(self, request: ControlRequest) -> tuple[FloatArray, SE2]:
        """The plan from the robot to the horizon, (K, 2), and the pose to end in (protocol 3.5)."""
        s, path, pose = self._settings, request.path, request.pose
        here = np.array([pose.x, pose.y])
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        away = np.hypot(*(path - here).T)
        # the plan started where the robot was a second ago, so it is near its beginning, not on a later leg close by
        near = int(np.argmin(np.where(along <= 1.0, away, np.inf)))
        horizon = s.horizon_factor * 0.5 * request.costmap.size * request.costmap.resolution
        beyond = np.flatnonzero(away[near:] > horizon)
        end = near + int(beyond[0]) - 1 if len(beyond) else len(path) - 1
        end = max(end, near)
        recently = self._last_infeasible is not None and (
            request.now - self._last_infeasible < s.shrink_horizon_min_duration * NANOSECONDS
        )
        if recently and end < len(path) - 1:
            end = max(near + (end - near) // 2, min(near + 1, end))
        line = np.vstack([here, path[near + 1 : end + 1]])
        if end >= len(path) - 1:
            goal = request.goal
            if len(line) == 1:
                line = np.vstack([here, [goal.x, goal.y]])
            return line, goal
        ahead = np.diff(path[end : end + 1 + s.moving_average_poses], axis=0)
        heading = mean_heading(np.arctan2(ahead[:, 1], ahead[:, 0]))
        if len(line) == 1:
            line = np.vstack([here, path[end]])
        return line, SE2(float(line[-1, 0]), float(line[-1, 1]), heading)

    def _renew(self, pose: SE2, goal: SE2, obstacle_map: ObstacleMap) -> None:
        """Carry the bands over to the new start and goal; one of each class stays, the selected one first."""
        s = self._settings
        if self._bands:
            last = self._bands[0]
            end = SE2(*(float(v) for v in last.z[last.n - 1, :3]))
            turned = abs(wrap_angle(goal.theta - end.theta))
            if end.distance_to(goal) >= s.force_reinit_new_goal_dist or turned >= s.force_reinit_new_goal_angular:
                self._bands = []
        self._was_selected = bool(self._bands)
        kept: list[Band] = []
        for band in self._bands:
            band.n = warm_start(
                band.z, band.n, pose.x, pose.y, pose.theta, goal.x, goal.y, goal.theta, s.min_samples
            )  # fmt: skip
            band.signature = signature(band.z, band.n, obstacle_map.inside)
            if not any(same_class(band.signature, other.signature) for other in kept):
                kept.append(band)
        self._bands = kept

    def _explore(
        self, line: FloatArray, plan_signature: FloatArray, pose: SE2, goal: SE2, obstacle_map: ObstacleMap
    ) -> None:
        """Add a band for the class of the global plan and for other classes, up to `max_classes`."""
        s = self._settings
        if not any(same_class(plan_signature, band.signature) for band in self._bands):
            self._bands.append(self._new_band(line, plan_signature, pose, goal))
        missing = s.max_classes - len(self._bands)
        if missing <= 0:
            return
        start = (pose.x, pose.y)
        self._round += 1
        for path in distinct_paths(obstacle_map, start, (goal.x, goal.y), s, self._round):
            winding = signature(path, len(path), obstacle_map.inside)
            if any(same_class(winding, band.signature) for band in self._bands):
                continue
            self._bands.append(self._new_band(path, winding, pose, goal))
            missing -= 1
            if missing == 0:
                return

    def _new_band(self, line: FloatArray, winding: FloatArray, pose: SE2, goal: SE2) -> Band:
        s = self._settings
        z, n = initial_band(
            line, pose.theta, goal.theta, s.max_vel_x, s.max_vel_theta, s.dt_ref, s.max_samples + 2
        )  # fmt: skip
        return Band(z, n, winding)

    def _optimize(self, band: Band, velocity: Velocity, obstacles: FloatArray) -> None:
        band.n, motion, obstacle = optimize(
            band.z, band.n, velocity.linear, velocity.angular, obstacles, self._parameters
        )  # fmt: skip
        band.cost = motion + self._settings.selection_obst_cost_scale * obstacle

    def _first_velocity(self, band: Band) -> Velocity:
        s = self._settings
        (x0, y0, t0, dt), (x1, y1, t1, _) = band.z[0], band.z[1]
        turn = wrap_angle(float(t1 - t0))
        middle = t0 + 0.5 * turn
        linear = (math.cos(middle) * (x1 - x0) + math.sin(middle) * (y1 - y0)) / dt
        return Velocity(
            min(max(float(linear), -s.max_vel_x_backwards), s.max_vel_x),
            min(max(float(turn / dt), -s.max_vel_theta), s.max_vel_theta),
        )


def _sets_off_backwards(band: Band, length: float) -> bool:
    """Whether the band leads away from its goal over its first `length` metres."""
    offsets = band.z[: band.n, :2] - band.z[0, :2]
    far = np.flatnonzero(np.hypot(offsets[:, 0], offsets[:, 1]) >= length)
    return len(far) > 0 and float(offsets[far[0]] @ offsets[-1]) <= 0.0


def _feasible(band: Band, costmap: LocalCostmap, poses: int) -> bool:
    """Whether the first `poses` poses keep the robot's inscribed circle off everything lethal."""
    return all(costmap.cost_at(float(band.z[i, 0]), float(band.z[i, 1])) < INSCRIBED for i in range(min(poses, band.n)))
