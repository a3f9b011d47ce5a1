"""A tour on a robot that answers over ROS: the stage without a simulator, and what is checked before it moves."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TextIO

from taskslam.benchmark.platform import Platform
from taskslam.benchmark.ros_platform import RosPlatform
from taskslam.benchmark.run import Driver, navigation_settings
from taskslam.benchmark.stack_platform import StackPlatform
from taskslam.benchmark.stack_traveller import StackTraveller
from taskslam.benchmark.stage import Stage
from taskslam.benchmark.traveller import Traveller
from taskslam.errors import InputError
from taskslam.navigation.costmap import GlobalCostmap
from taskslam.navigation.global_planner import plan_path
from taskslam.navigation.settings import NavigationSettings
from taskslam.observer import Observer
from taskslam.record.run_directory import RunWriter
from taskslam.ros.connection import Connection
from taskslam.ros.opening import navigation_in
from taskslam.ros.transport import Transport
from taskslam.sensors import fitted
from taskslam.simulation.simulator import DEFAULT_SENSORS
from taskslam.slam.base import Kind, MapMode, MethodCard

_MOMENT_S = 0.1


class AtTheKeyboard:
    """A person who presses Enter. Where nobody can, as under nohup, only the topic counts."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream: TextIO | None = stream or sys.stdin

    def answered(self) -> bool:
        """Whether a line has come; waits for it a moment."""
        if self._stream is None:
            select.select([], [], [], _MOMENT_S)
            return False
        ready, _, _ = select.select([self._stream], [], [], _MOMENT_S)
        if not ready:
            return False
        if self._stream.readline():
            return True
        self._stream = None  # its end: nobody is there
        return False


def on_robot(stage: Stage) -> Stage:
    """The stage for a robot that brings a world of its own; the floor plan stays.

    Raises InputError: the first goal cannot be planned to.
    """
    start, goal = stage.scenario.start.pose, stage.scenario.sequence.goals[0].pose
    settings = NavigationSettings()
    if plan_path(GlobalCostmap(stage.plan, settings.costmap), start, goal, settings.global_planner) is None:
        raise InputError(
            f"scenario {stage.scenario.name}: no way can be planned from the start ({start.x:g}, {start.y:g}) to the"
            f" first goal ({goal.x:g}, {goal.y:g}) on the floor plan"
        )
    return replace(stage, world=None)


def robot_for(
    stage: Stage, connect: Callable[[], Transport], connection: Connection, observer: Observer
) -> Callable[[MethodCard], Platform]:
    """Makes the robot for a method. Raises InputError, when it is asked, for a method that needs the truth."""
    person = AtTheKeyboard()

    def make(card: MethodCard) -> Platform:
        if card.kind is Kind.REFERENCE:
            raise InputError(f"method '{card.name}' is told the truth, which a robot does not know")
        sensors = DEFAULT_SENSORS | set(card.hears(fitted(stage.robot.rig)))
        return RosPlatform(stage, connect, connection, sensors, person, observer)

    return make


def stack_for(
    stage: Stage, ros: int, connect: Callable[[], Transport], connection: Connection, observer: Observer
) -> tuple[Callable[[MethodCard], Platform], Driver]:
    """The robot and who drives it, where that is the robot's own navigation: Nav2 in ROS 2, move_base in ROS 1."""
    described, person = connection.stack, AtTheKeyboard()
    action = "NavigateToPose of Nav2" if ros == 2 else "move_base"
    card = MethodCard(
        name=stack_name(ros, connection),
        version="",
        licence="unknown",
        kind=Kind.SLAM,
        sensors=(),
        summary=f"the robot's own SLAM and navigation, sent to goals by {action}",
        map_mode=MapMode.CONTINUE,
        deterministic=False,
    )

    def robot(_: MethodCard) -> Platform:
        return StackPlatform(
            stage, connect, lambda graph: navigation_in(graph, described), connection, person, observer
        )

    def traveller(platform: Platform, record: RunWriter) -> Traveller:
        assert isinstance(platform, StackPlatform)
        patience = navigation_settings(stage.scenario).goal
        return StackTraveller(platform, record, stage.scenario.start.pose, patience, described.cancel, observer)

    return robot, Driver(card, traveller)


def stack_name(ros: int, connection: Connection) -> str:
    """By which results call it, as they call a method."""
    return connection.stack.name or ("nav2" if ros == 2 else "move_base")
