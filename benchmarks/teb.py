"""The timed elastic band in ms per control step (5 Hz), on one core: a room full of pillars, and the small house.

    python benchmarks/teb.py [--goals 40]

A step is all that the local planner does: local goal, obstacles, homotopy classes, and the optimisation of every band.
A kinematic robot with a perfect pose and no laser follows the commands, so that the steps are those of a real drive;
the house needs its published floor plan in `TASKSLAM_DATA` and is left out without it.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from pathlib import Path

import numpy as np

from common import machine_line, pin_to_one_core
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.navigation.local_planner import ControlRequest
from taskslam.navigation.navigator import Navigator
from taskslam.navigation.settings import NavigationSettings
from taskslam.navigation.teb import TebPlanner
from taskslam.navigation.velocity_smoother import Velocity
from taskslam.outcomes import Outcome
from taskslam.robot import load_robot
from taskslam.world.floor_plan import OCCUPIED, FloorPlan
from taskslam.world.map_server import load_floor_plan

TICK = 0.05


class TimedPlanner(TebPlanner):
    """The planner with a stopwatch around each step."""

    def __init__(self) -> None:
        super().__init__(NavigationSettings().teb)
        self.milliseconds: list[float] = []
        self.classes: list[int] = []

    def command(self, request: ControlRequest) -> Velocity | None:
        """Time one control step; processor time, so that a busy machine does not count."""
        begun = time.process_time()
        command = super().command(request)
        self.milliseconds.append(1e3 * (time.process_time() - begun))
        self.classes.append(len(self.bands))
        return command


def pillars() -> FloorPlan:
    """12 x 12 m with a 0.2 m pillar every 1.5 m, shifted by up to 0.3 m."""
    random = np.random.default_rng(0)
    cells = np.zeros((240, 240), np.uint8)
    cells[[0, -1]], cells[:, [0, -1]] = OCCUPIED, OCCUPIED
    for row in range(30, 240, 30):
        for column in range(30, 240, 30):
            r, c = row + random.integers(-6, 7), column + random.integers(-6, 7)
            cells[r - 2 : r + 2, c - 2 : c + 2] = OCCUPIED
    return FloorPlan(cells, 0.05, SE2())


def drive(plan: FloorPlan, start: SE2, goals: list[SE2]) -> tuple[TimedPlanner, int, float]:
    """The planner after a tour, how many goals were reached, and the simulated seconds."""
    planner = TimedPlanner()
    navigator = Navigator(plan, load_robot("turtlebot2"), local_planner=planner)
    pose, linear, angular, now, reached = start, 0.0, 0.0, 0, 0
    for goal in goals:
        navigator.start_goal(goal, now)
        while True:
            step = navigator.step(now, SE2(), pose, linear, angular, False)
            linear, angular = step.linear, step.angular
            middle = pose.theta + 0.5 * angular * TICK
            pose = SE2(
                pose.x + linear * TICK * math.cos(middle),
                pose.y + linear * TICK * math.sin(middle),
                pose.theta + angular * TICK,
            )
            now += round(TICK * NANOSECONDS)
            if step.outcome is not None:
                reached += step.outcome is Outcome.REACHED
                break
    return planner, reached, now / NANOSECONDS


def report(name: str, plan: FloorPlan, start: SE2, goals: list[SE2]) -> None:
    """One line of the table."""
    drive(plan, start, goals[:2])  # compiles
    planner, reached, seconds = drive(plan, start, goals)
    ms, classes = np.array(planner.milliseconds), np.array(planner.classes)
    print(
        f"{name:16} p50 {np.median(ms):5.2f}  p95 {np.percentile(ms, 95):5.2f}  p99 {np.percentile(ms, 99):5.2f}"
        f"  max {ms.max():5.2f} ms; {len(ms)} steps, {np.mean(classes > 1):.0%} with several classes (at most"
        f" {classes.max()}); {ms.sum() / seconds:.1f} ms per simulated second; {reached}/{len(goals)} goals"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--goals", type=int, default=40)
    count = parser.parse_args().goals
    pin_to_one_core()
    print(machine_line())
    random = np.random.default_rng(1)
    corners = 0.75 + 1.5 * random.integers(0, 8, (count, 2))
    goals = [SE2(x, y, random.uniform(-math.pi, math.pi)) for x, y in corners]
    report("pillars", pillars(), SE2(0.75, 0.75, 0.0), goals)

    data = Path(os.environ.get("TASKSLAM_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if (data / "maps" / "aws_small_house.yaml").exists():
        waypoints = np.loadtxt(data / "waypoints" / "aws_small_house" / "waypoints.txt")[1:, 1:]
        tour = [SE2(*row) for row in waypoints]
        report("aws_small_house", load_floor_plan(data / "maps" / "aws_small_house.yaml"), SE2(), tour)


if __name__ == "__main__":
    main()
