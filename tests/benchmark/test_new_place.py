"""From a map, a picture or a world to a tour that can be driven."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from taskslam.benchmark.new_place import Wishes, new_place
from taskslam.benchmark.proposal import propose_goals, propose_start
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage
from taskslam.benchmark.survey import survey
from taskslam.errors import FloorPlanError, InputError, ScenarioError
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.scenario.writing import save_scenario
from taskslam.task import Sequence, Waypoint
from taskslam.world.floor_plan import FREE, OCCUPIED, FloorPlan
from taskslam.world.map_server import save_floor_plan


def drawn(scale: int = 1) -> np.ndarray:
    """Two rooms of 4 m x 4 m with a door, at 5 cm a pixel; dark is wall; row 0 is the top."""
    grey = np.full((84, 164), 255, np.uint8)
    grey[:2], grey[-2:], grey[:, :2], grey[:, -2:] = 0, 0, 0, 0
    grey[:30, 80:84], grey[54:, 80:84] = 0, 0
    return np.kron(grey, np.ones((scale, scale), np.uint8))


@pytest.fixture
def plan() -> FloorPlan:
    cells = np.where(drawn()[::-1] == 0, np.uint8(OCCUPIED), np.uint8(FREE))
    return FloorPlan(cells, 0.05, SE2(-1.0, 2.0))


def test_proposed_goals_are_apart_clear_and_reached(plan: FloorPlan) -> None:
    robot = load_robot("turtlebot2")
    start = propose_start(plan, robot)
    goals = propose_goals(plan, robot, start, 6)
    assert goals == propose_goals(plan, robot, start, 6)
    places = np.array([[goal.x, goal.y] for goal in goals])
    distances = np.linalg.norm(places[:, None] - places[None], axis=2) + 10 * np.eye(6)
    assert distances.min() > 1.0
    assert (places[:, 0] < 3.0).any()
    assert (places[:, 0] > 3.2).any(), "both rooms are toured"
    scenario = load_scenario("house").model_copy(update={"start": start, "sequence": Sequence(waypoints=goals)})
    looked = survey(scenario, plan, robot)
    assert not looked.faults
    assert looked.clearance_m >= 0.5
    assert looked.length_m < 25.0
    for leg in looked.legs:  # each looks in the direction in which the robot comes
        assert leg.path is not None
        came = leg.path[-1] - leg.path[-6]
        assert np.cos(np.arctan2(came[1], came[0]) - leg.goal.theta) > 0.8


def test_more_goals_than_fit_are_refused_with_their_number(plan: FloorPlan) -> None:
    robot = load_robot("turtlebot2")
    with pytest.raises(ScenarioError, match=r"\d+ goals fit on this floor plan, 1.00 m clear .* expected 60"):
        propose_goals(plan, robot, propose_start(plan, robot), 60, clearance=1.0)


def test_the_ground_around_a_building_is_not_where_a_tour_starts() -> None:
    cells = np.full((200, 200), FREE, np.uint8)
    cells[60:140, 60:140] = OCCUPIED
    cells[62:138, 62:138] = FREE
    start = propose_start(FloorPlan(cells, 0.05, SE2()), load_robot("turtlebot2"))
    assert 3.1 < start.x < 6.9
    assert 3.1 < start.y < 6.9


def test_a_map_without_free_floor_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"no free place for a robot of 0\.3\d m diameter"):
        propose_start(FloorPlan(np.full((40, 40), OCCUPIED, np.uint8), 0.05, SE2()), load_robot("turtlebot2"))


def test_every_fault_of_a_tour_is_named(plan: FloorPlan) -> None:
    goals = tuple(Waypoint(x=x, y=y, theta=0.0) for x, y in ((0.0, 3.0), (3.15, 2.5), (-0.85, 4.0), (40.0, 0.0)))
    tour = {"start": Waypoint(x=1.0, y=4.0, theta=0.0), "sequence": Sequence(waypoints=goals)}
    looked = survey(load_scenario("house").model_copy(update=tour), plan, load_robot("turtlebot2"))
    first, *wrong = (leg.fault for leg in looked.legs)
    assert first == ""
    assert [fault.partition(")")[2].split()[:2] for fault in wrong] == [
        ["lies", "inside"],
        ["is", "0.10"],
        ["lies", "outside"],
    ]
    assert looked.faults == tuple(wrong)


@pytest.mark.parametrize("kind", ["map", "picture"])
def test_a_place_becomes_a_tour_that_karto_drives(kind: str, plan: FloorPlan, tmp_path: Path) -> None:
    wishes = Wishes(goals=2)
    if kind == "map":
        source = tmp_path / "place.yaml"
        save_floor_plan(plan, source)
    else:
        source, wishes = tmp_path / "place.png", Wishes(goals=2, width=8.2)
        Image.fromarray(drawn(scale=3)).save(source)
    target = tmp_path / "tours" / "two_rooms.yaml"
    scenario, _ = new_place(source, target, wishes, Observer())
    save_scenario(scenario, target)
    loaded = load_scenario(target, ["protocol.rounds=1"])
    assert loaded.sequence == scenario.sequence
    stage = set_stage(loaded, [], Observer())
    _, complete = run(stage, stage.spec("karto", Mode.WITHOUT_MAP), tmp_path / "out")
    assert complete


def test_a_picture_needs_one_scale(tmp_path: Path) -> None:
    source = tmp_path / "plan.png"
    Image.fromarray(drawn()).save(source)
    for wishes, words in (
        (Wishes(goals=2), "no scale"),
        (Wishes(goals=2, scale=0.05, width=8.2), "two scales, --scale and --width"),
        (Wishes(goals=2, scale=-1.0), "a scale of -1; expected more than 0"),
    ):
        with pytest.raises(InputError, match=words):
            new_place(source, tmp_path / "tour.yaml", wishes, Observer())


def test_what_is_no_place_is_refused_in_a_sentence(tmp_path: Path) -> None:
    source = tmp_path / "plan.png"
    source.write_text("not a picture")
    with pytest.raises(FloorPlanError, match=r"plan\.png"):
        new_place(source, tmp_path / "tour.yaml", Wishes(goals=2, scale=0.05), Observer())
    with pytest.raises(InputError, match="expected --start"):
        new_place(tmp_path / "a.world", tmp_path / "tour.yaml", Wishes(goals=2), Observer())
    with pytest.raises(InputError, match="a scale is for a picture"):
        new_place(tmp_path / "a.yaml", tmp_path / "tour.yaml", Wishes(goals=2, scale=0.05), Observer())
