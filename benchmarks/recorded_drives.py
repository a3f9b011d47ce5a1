"""Drives for open-loop comparisons: a robot tours waypoints, steered by its true pose, and all is recorded.

Every method then gets the same measurements, which the closed loop cannot offer: there each method steers its own way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from common import aws_world
from taskslam.benchmark.stage import set_stage
from taskslam.geometry import FloatArray, wrap_angle
from taskslam.measurements import NANOSECONDS, Measurement, Sensor, StereoImages
from taskslam.navigation.costmap import GlobalCostmap
from taskslam.navigation.global_planner import plan_path
from taskslam.navigation.settings import CostmapSettings, GlobalPlannerSettings
from taskslam.observer import Observer
from taskslam.robot import Robot
from taskslam.scenario import load_scenario
from taskslam.sensors import sensor_kind
from taskslam.simulation.simulator import DEFAULT_SENSORS, Simulator

CONTROL_PERIOD = NANOSECONDS // 20
PAUSE = 2 * NANOSECONDS
LOOK_AHEAD = 0.4  # metres
SPEED, TURN = 0.3, 0.8  # m/s, rad/s


@dataclass(frozen=True)
class Drive:
    """measurements in stamp order; truth: (number of frames, 3), the base seen from where it started.

    A frame is what a method answers: a scan, a cloud, a pair.
    """

    robot: Robot
    measurements: list[Measurement]
    truth: FloatArray


def record(
    scenario_name: str,
    rounds: int = 1,
    seed: int = 0,
    goals: int | None = None,
    sensors: frozenset[Sensor] = DEFAULT_SENSORS,
    still: int = NANOSECONDS,
    overrides: Sequence[str] = (),
) -> Drive:
    """Tour a scenario's waypoints along planned paths; a registered world, or an AWS world under TASKSLAM_DATA.

    goals: how many of the tour. The turns of a spinning LiDAR take their time. still: ns that it stands at first.
    overrides: of the scenario, as in `robot=turtlebot2_vga15`.
    """
    world = aws_world(scenario_name) if scenario_name.startswith("aws_") else None
    stage = set_stage(load_scenario(scenario_name, list(overrides)), [world] if world else [], Observer())
    start = stage.scenario.start.pose
    costmap = GlobalCostmap(stage.plan, CostmapSettings())
    assert stage.world is not None
    robot = with_rolling_lidar(stage.robot)
    simulator = Simulator(stage.world, robot, seed, sensors=sensors)
    simulator.reset(start)
    measurements: list[Measurement] = []
    truth: list[FloatArray] = []

    def advance(duration: int) -> None:
        for measurement in simulator.advance(simulator.now + duration):
            measurements.append(_kept(measurement))
            if sensor_kind(measurement.sensor).is_frame:
                truth.append((start.inverse() @ simulator.true_pose()).array())

    advance(still)
    for _ in range(rounds):
        for goal in stage.scenario.sequence.goals[:goals]:
            path = plan_path(costmap, simulator.true_pose(), goal.pose, GlobalPlannerSettings())
            if path is None:
                raise SystemExit(f"{scenario_name}: no path to {goal}")
            _follow(simulator, path, advance)
            _turn_to(simulator, goal.theta, advance)
            advance(PAUSE)
    return Drive(robot, measurements, np.array(truth))


def _kept(measurement: Measurement) -> Measurement:
    """The same, whose pictures are not drawn over."""
    if isinstance(measurement, StereoImages):
        return StereoImages(measurement.stamp, measurement.left.copy(), measurement.right.copy())
    return measurement


def with_rolling_lidar(robot: Robot) -> Robot:
    """The same robot, the turns of whose spinning LiDAR take their time."""
    if robot.rig.lidar_3d is None:
        return robot
    lidar = robot.rig.lidar_3d.model_copy(update={"rolling": True})
    return robot.model_copy(update={"rig": robot.rig.model_copy(update={"lidar_3d": lidar})})


def _follow(simulator: Simulator, path: FloatArray, advance: Callable[[int], None]) -> None:
    """Pure pursuit of (N, 2) points to within 5 cm of the last."""
    while True:
        pose = simulator.true_pose()
        distances = np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y)
        remaining = float(distances[-1])
        if remaining < 0.05:
            break
        nearest = int(np.argmin(distances))
        ahead = nearest + int(np.argmax(distances[nearest:] > LOOK_AHEAD))
        target = path[ahead] if distances[ahead] > LOOK_AHEAD else path[-1]
        error = wrap_angle(math.atan2(target[1] - pose.y, target[0] - pose.x) - pose.theta)
        speed = 0.0 if abs(error) > 0.6 else min(SPEED, 0.5 * remaining + 0.03) * math.cos(error)
        simulator.drive(speed, min(max(2.0 * error, -TURN), TURN))
        advance(CONTROL_PERIOD)
    simulator.drive(0.0, 0.0)
    advance(NANOSECONDS)


def _turn_to(simulator: Simulator, theta: float, advance: Callable[[int], None]) -> None:
    while abs(error := wrap_angle(theta - simulator.true_pose().theta)) > 0.05:
        simulator.drive(0.0, min(max(2.0 * error, -TURN), TURN))
        advance(CONTROL_PERIOD)
    simulator.drive(0.0, 0.0)
