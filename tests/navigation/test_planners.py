"""Local planners by name, ours and those that a package from outside registers."""

from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import PlannerError
from taskslam.geometry import SE2
from taskslam.navigation.costmap import LocalCostmap
from taskslam.navigation.local_planner import ControlRequest
from taskslam.navigation.planners import build_planner, planner_version, registered_planners
from taskslam.navigation.settings import CostmapSettings
from taskslam.navigation.velocity_smoother import Velocity
from taskslam.robot import load_robot

PROJECT = Path(__file__).parent / "third_party"


@pytest.fixture(autouse=True)
def third_party(install, monkeypatch):
    monkeypatch.syspath_prepend(str(install(PROJECT)))


@pytest.fixture
def request_ahead(make_plan):
    """A robot at rest in an empty room with its goal 2 m straight ahead."""
    start, goal = SE2(1.0, 2.0, 0.0), SE2(3.0, 2.0, 0.0)
    costmap = LocalCostmap(make_plan(4.0, 4.0), CostmapSettings())
    costmap.update(None, SE2(), start)
    path = np.linspace((1.0, 2.0), (3.0, 2.0), 41)
    return ControlRequest(1_500_000_000, start, Velocity(), path, goal, costmap)


def test_a_package_from_outside_adds_a_planner():
    assert {"teb", "pure_pursuit"} <= registered_planners().keys()
    assert planner_version("pure_pursuit") == {"pure-pursuit": "0.3"}


@pytest.mark.parametrize("name", ["teb", "pure_pursuit"])
def test_it_sets_off_towards_a_goal_straight_ahead(name, request_ahead):
    planner = build_planner(name, load_robot("turtlebot2"))
    planner.reset()
    command = planner.command(request_ahead)
    assert command.linear > 0.05
    assert abs(command.angular) < 0.05


def test_an_unknown_name_lists_the_known_and_suggests_one():
    with pytest.raises(PlannerError, match=r"known: .*pure_pursuit.*teb.*Did you mean 'pure_pursuit'\?"):
        build_planner("pure_pursiut", load_robot("turtlebot2"))


@pytest.mark.parametrize(("name", "words"), [("absent", "ModuleNotFoundError"), ("half_a_planner", "has no `reset")])
def test_what_is_no_planner_says_why(name, words):
    with pytest.raises(PlannerError, match=f"'{name}'.*{words}"):
        build_planner(name, load_robot("turtlebot2"))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("raises", "ValueError: no idea where to go"),
        ("not_a_number", r"gave Velocity\(linear=nan.*expected a finite Velocity"),
        ("not_a_velocity", r"gave \(0\.3, 0\.0\)"),
    ],
)
def test_a_planner_that_breaks_its_contract_is_named_with_the_instant(name, words, request_ahead):
    planner = build_planner(name, load_robot("turtlebot2"))
    with pytest.raises(PlannerError, match=f"planner '{name}' at 1.50 s: {words}"):
        planner.command(request_ahead)


def test_a_planner_may_have_no_command(request_ahead):
    assert build_planner("gives_up", load_robot("turtlebot2")).command(request_ahead) is None


def test_the_guide_shows_the_very_planner_that_is_tested_here():
    guide = Path(__file__).parents[2] / "CONTRIBUTING.md"
    assert f"```python\n{(PROJECT / 'pure_pursuit.py').read_text()}```" in guide.read_text()
