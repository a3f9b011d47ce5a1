"""Arrivals as seen from the goal: x ahead of it, y to its left, heading against its own."""

from __future__ import annotations

from taskslam.evaluation import WaypointMetrics
from taskslam.evaluation.metrics_file import PoseRow, Visit
from taskslam.geometry import SE2


def seen_from_goal(waypoint: WaypointMetrics) -> list[tuple[Visit, SE2 | None, SE2 | None]]:
    """Each visit, its true pose and the one that SLAM believed, in the goal's frame; None where unknown."""
    T_goal_map = SE2(*waypoint.target).inverse()

    def seen(pose: PoseRow | None) -> SE2 | None:
        return None if pose is None else T_goal_map @ SE2(*pose)

    return [(visit, seen(visit.truth), seen(visit.estimate)) for visit in waypoint.arrivals]


def middle(waypoint: WaypointMetrics) -> tuple[float, float]:
    """The mean true arrival, which a panel is centred on; the goal where fewer than two have no spread to enlarge."""
    known = sum(visit.truth is not None for visit in waypoint.arrivals)
    if waypoint.mean_pose is None or known < 2:
        return (0.0, 0.0)
    mean = SE2(*waypoint.target).inverse() @ SE2(*waypoint.mean_pose)
    return (mean.x, mean.y)
