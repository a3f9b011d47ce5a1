from __future__ import annotations

from pathlib import Path

import pytest

from taskslam.errors import ScenarioError
from taskslam.scenario import load_scenario, shipped_scenarios

MINIMAL = """
name: mine
world: {name: house}
start: {x: 0, y: 0, theta: 0}
sequence:
  waypoints:
    - [0, 0, 0]
    - [1, 0, 1.5]
  path: [0, 1, 0]
"""


@pytest.fixture
def write(tmp_path: Path):  # type: ignore[no-untyped-def]
    def to_file(text: str) -> Path:
        file = tmp_path / "mine.yaml"
        file.write_text(text)
        return file

    return to_file


def test_the_first_entry_of_a_path_is_the_start_and_not_a_goal(write) -> None:  # type: ignore[no-untyped-def]
    goals = load_scenario(write(MINIMAL)).sequence.goals
    assert [(g.x, g.y) for g in goals] == [(1, 0), (0, 0)]


@pytest.mark.parametrize(
    ("name", "goals"),
    [
        ("aws_small_house", 12),
        ("aws_small_warehouse", 16),
        ("aws_hospital", 19),
        ("tsrb", 17),
        ("tsrb_short", 9),
        ("tsrb_long", 16),
        ("house", 12),
        ("warehouse", 16),
        ("hospital", 19),
        ("office", 17),
    ],
)
def test_shipped_scenarios_have_the_waypoint_counts_of_the_paper(name: str, goals: int) -> None:
    assert name in shipped_scenarios()
    scenario = load_scenario(name)
    assert len(scenario.sequence.goals) == goals
    assert scenario.protocol.rounds == 5
    assert scenario.protocol.pause == 5.0
    assert scenario.units.robot_diameter == 0.30


@pytest.mark.parametrize("name", ["aws_small_house", "aws_small_warehouse", "aws_hospital", "tsrb"])
def test_published_files_read_as_they_are_give_the_shipped_tour(name: str, data: Path, write) -> None:  # type: ignore[no-untyped-def]
    folder = data / "waypoints" / name
    text = f"""
name: mine
world: {{name: house}}
start: {{x: 0, y: 0, theta: 0}}
sequence: {{waypoints_file: {folder}/waypoints.txt, path_file: {folder}/path0.txt}}
"""
    assert load_scenario(write(text)).sequence.goals == load_scenario(name).sequence.goals


def test_overrides_reach_nested_keys(write) -> None:  # type: ignore[no-untyped-def]
    scenario = load_scenario(write(MINIMAL), ["protocol.rounds=2", "world.lidar_geometry=collision"])
    assert scenario.protocol.rounds == 2
    assert scenario.world.lidar_geometry == "collision"


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("protocol.ruonds=2",), r"unknown key 'protocol\.ruonds'.*Did you mean 'rounds'"),
        (("protocol.rounds=0",), r"protocol\.rounds: .*greater than or equal to 1 \(got 0\)"),
        (("start.x=.nan",), r"start\.x: .*finite"),
        (("sequence.path=[0, 7]",), r"sequence: path\[1\] is 7, but the waypoint table has rows 0 to 1"),
        (("sequence.path=[0]",), "sequence is empty"),
        (("world.file=a.world",), "give one of `name`"),
        (("protocol",), r"expected a\.b=value"),
        (("name.x=1",), "'name' holds a value"),
    ],
)
def test_what_is_wrong_is_said_with_its_key(change: tuple[str, ...], complaint: str, write) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ScenarioError, match=complaint):
        load_scenario(write(MINIMAL), change)


def test_an_unknown_scenario_is_named_with_a_guess() -> None:
    with pytest.raises(ScenarioError, match=r"'aws_smal_house'.*Did you mean 'aws_small_house'"):
        load_scenario("aws_smal_house")


def test_broken_files_are_named(write, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ScenarioError, match="not valid YAML"):
        load_scenario(write("name: ["))
    with pytest.raises(
        ScenarioError, match="not keys with values but a list; expected the keys title, start, sequence"
    ):
        load_scenario(write("- 1"))
    with pytest.raises(ScenarioError, match="cannot read the scenario"):
        load_scenario(tmp_path / "absent.yaml")
    with pytest.raises(ScenarioError, match="'start' is missing"):
        load_scenario(write("name: mine\nworld: {name: house}\nsequence: {waypoints: [[0, 0, 0]]}"))


@pytest.mark.parametrize(
    ("waypoints", "path", "complaint"),
    [
        ("0 1 2\n", "0\n", r"waypoints\.txt, line 1: expected four finite numbers"),
        ("# x\n0 a 2 3\n", "0\n", r"waypoints\.txt, line 2: expected `index x y theta`"),
        ("0 1 2 nan\n", "0\n", "finite"),
        ("0 1 2 3\n", "0\n\n1.5\n", r"path\.txt, line 3: expected the number of a waypoint row, found '1\.5'"),
    ],
)
def test_broken_waypoint_files_are_named_with_their_line(
    waypoints: str,
    path: str,
    complaint: str,
    tmp_path: Path,
    write,  # type: ignore[no-untyped-def]
) -> None:
    (tmp_path / "waypoints.txt").write_text(waypoints)
    (tmp_path / "path.txt").write_text(path)
    text = """
name: mine
world: {name: house}
start: {x: 0, y: 0, theta: 0}
sequence: {waypoints_file: waypoints.txt, path_file: path.txt}
"""
    with pytest.raises(ScenarioError, match=complaint):
        load_scenario(write(text))


def test_a_path_index_of_5000_digits_is_refused(write, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "waypoints.txt").write_text("0 1 2 3\n")
    (tmp_path / "path.txt").write_text("9" * 5000)
    scenario = write(
        "name: mine\nworld: {name: house}\nstart: {x: 0, y: 0, theta: 0}\n"
        "sequence: {waypoints_file: waypoints.txt, path_file: path.txt}\n"
    )
    with pytest.raises(ScenarioError, match=r"path\.txt, line 1: expected the number of a waypoint row, found '9{80}'"):
        load_scenario(scenario)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("start.x=9e18", r"start\.x: .*less than or equal to 10000000"),
        ("floor_plan.resolution=1e-300", r"floor_plan\.resolution: .*greater than or equal to"),
        ("floor_plan.slice_high=9e18", r"floor_plan\.slice_high: .*less than or equal to 10000"),
        ("protocol.rounds=4000000000", r"protocol\.rounds: .*less than or equal to 1000"),
    ],
)
def test_a_number_beyond_all_bounds_is_refused(override: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        load_scenario("house", [override])


@pytest.mark.parametrize(
    "text",
    [
        "- {x: 1.0, y: 2.0, yaw: 0.5}\n- [3.0, 2.0, 0.0]\n",
        "start: {x: 0, y: 0, yaw: 0}\nwaypoints:\n- {x: 1, y: 2, yaw: 0.5}\n- {x: 3, y: 2, yaw: 0}\n",
    ],
    ids=["a list", "under a key"],
)  # fmt: skip
def test_waypoints_may_be_a_yaml_file_as_ros_tools_write_it(text: str, write, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "goals.yaml").write_text(text)
    file = write(
        "name: t\nworld: {name: house}\nstart: {x: 0, y: 0, yaw: 1.5}\nsequence: {waypoints_file: goals.yaml}\n"
    )
    scenario = load_scenario(file)
    assert scenario.start.theta == 1.5
    assert [(goal.x, goal.y, goal.theta) for goal in scenario.sequence.goals] == [(1.0, 2.0, 0.5), (3.0, 2.0, 0.0)]


def test_a_yaml_file_without_waypoints_is_refused(write, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "goals.yaml").write_text("goals: 3\n")
    file = write(
        "name: t\nworld: {name: house}\nstart: {x: 0, y: 0, theta: 0}\nsequence: {waypoints_file: goals.yaml}\n"
    )
    with pytest.raises(ScenarioError, match=r"goals\.yaml: no list of waypoints; expected one of \{x, y, yaw\}"):
        load_scenario(file)
