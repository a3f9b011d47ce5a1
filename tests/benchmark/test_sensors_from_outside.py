"""A sensor from another package is carried by a robot, heard by a method in its process, and named in the results."""

from pathlib import Path

import pytest

from taskslam.benchmark.conformance_eyes import conformance_looks
from taskslam.benchmark.export import ExportRequest, Format, export
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage
from taskslam.cli.doctor import Health, sensors
from taskslam.errors import DatasetError, InputError, RobotError
from taskslam.geometry import SE2
from taskslam.observer import Observer
from taskslam.record import Arrival, RoundEnded, load_run
from taskslam.report import write_report
from taskslam.report.cards import main_sensor, sensor_name, sensor_suite
from taskslam.robot import load_robot
from taskslam.sensors import fitted, sensor_kind, sensor_kinds
from taskslam.task import Mode

PROJECT = Path(__file__).parent / "third_party"
ROBOT = """
built_on: turtlebot2
name: ranging
rig:
  wall_distance: {rate: 20.0, height: 0.2, range_max: 9.0, noise: 0.001}
"""


class Notices(Observer):
    """Keeps what is noticed."""

    def __init__(self):
        self.heard = []

    def notice(self, text):
        self.heard.append(text)


@pytest.fixture(autouse=True)
def third_party(install, monkeypatch):
    monkeypatch.syspath_prepend(str(install(PROJECT)))


@pytest.fixture
def robot(tmp_path):
    file = tmp_path / "ranging.yaml"
    file.write_text(ROBOT)
    return load_robot(file)


@pytest.fixture
def stage(make_stage, robot):
    straight_ahead = make_stage([[1.0, -1.0, 0.0]], rounds=1)
    return Stage(straight_ahead.scenario, straight_ahead.world, straight_ahead.plan, robot)


def test_a_robot_carries_it_beside_our_sensors(robot):
    assert robot.rig.parts()["wall_distance"].rate == 20.0
    assert list(fitted(robot.rig))[-1] == "wall_distance"
    assert type(robot).model_validate_json(robot.model_dump_json()) == robot
    assert robot.model_dump()["rig"]["wall_distance"]["noise"] == 0.001


@pytest.mark.parametrize(
    ("edit", "complaint"),
    [
        (("wall_distance", "wall_distnace"), r"unknown key 'rig.wall_distnace'; expected one of odometry, lidar_2d"),
        (("noise", "nose"), r"rig.wall_distance.noise.* missing|unknown key 'rig.wall_distance.nose'"),
        (("wall_distance", "absent"), r"rig: sensor 'absent' \(wall_ranger_absent:KIND\) cannot be loaded: No module"),
    ],
)
def test_what_is_wrong_with_its_part_is_said(tmp_path, edit, complaint):
    file = tmp_path / "ranging.yaml"
    file.write_text(ROBOT.replace(*edit))
    with pytest.raises(RobotError, match=complaint):
        load_robot(file)


def test_a_row_bears_the_name_of_its_entry_point():
    with pytest.raises(InputError, match=r"sensor 'another_name' .* expected a SensorKind"):
        sensor_kind("another_name")
    with pytest.raises(InputError, match="Did you mean 'wall_distance'"):
        sensor_kind("wall_distanse")


def test_one_that_is_broken_hides_no_other_and_the_doctor_names_it():
    assert "wall_distance" in [kind.sensor for kind in sensor_kinds()]
    found = {finding.what: finding for finding in sensors()}
    assert (found["sensor wall_distance"].health, found["sensor wall_distance"].detail) == (Health.GOOD, "wall ranger")
    assert found["sensor absent"].health == Health.NOTE
    assert "No module named 'wall_ranger_absent'" in found["sensor absent"].detail


def test_a_method_steers_by_it_and_the_results_name_it(stage, tmp_path):
    notices = Notices()
    directory, complete = run(stage, stage.spec("wall_follower", Mode.WITHOUT_MAP, 1), tmp_path / "runs", notices)
    record = load_run(directory)
    assert complete
    assert notices.heard[0].startswith("wall_follower: its card names no latency, so every estimate arrives the moment")
    (arrival,) = (event for event in record.events if isinstance(event, Arrival))
    assert arrival.truth.distance_to(arrival.estimate) < 0.03  # the odometry alone is 0.29 % short
    (ended,) = (event for event in record.events if isinstance(event, RoundEnded))
    assert ended.frames > 100
    card = record.manifest.method_card
    assert card["sensors"] == ["wall_distance", "wheel_odometry"]
    assert main_sensor(card) == "wall_distance"
    assert sensor_suite(card) == "wall ranger + wheel odometry"
    assert sensor_name("wall_distance") == "wall ranger"
    assert "wall ranger + wheel odometry" in write_report([tmp_path / "runs"], tmp_path / "report.html").read_text()
    again, _ = run(stage, stage.spec("wall_follower", Mode.WITHOUT_MAP, 1), tmp_path / "again")
    assert (again / "journal.jsonl").read_bytes() == (directory / "journal.jsonl").read_bytes()
    other, _ = run(stage, stage.spec("wall_follower", Mode.WITHOUT_MAP, 2), tmp_path / "other")
    assert (other / "journal.jsonl").read_bytes() != (directory / "journal.jsonl").read_bytes()


def test_a_robot_without_it_cannot_run_the_method(make_stage, tmp_path):
    bare = make_stage(rounds=1)
    with pytest.raises(InputError, match="needs wall_distance, which the robot has not"):
        run(bare, bare.spec("wall_follower", Mode.WITHOUT_MAP), tmp_path)


def test_it_is_heard_on_the_conformance_drive(robot):
    look = conformance_looks(robot.rig, {"wall_distance"})["wall_distance"]
    measurement = look(7, SE2(0.0, -1.8, 0.0))
    assert measurement.stamp == 7
    assert 0.5 < measurement.distance < 9.0


def test_a_format_that_cannot_hold_it_says_so(stage, tmp_path):
    asked = ExportRequest(Format.MCAP, frozenset({sensor_kind("wall_distance").sensor}), seconds=0.5)
    with pytest.raises(DatasetError, match="nobody says how a bag holds wall_distance"):
        export(stage, asked, tmp_path / "bag")


def test_the_guide_shows_the_very_sensor_that_is_tested_here():
    guide = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text()
    for file in ("wall_ranger.py", "wall_ranger_device.py"):
        assert f"```python\n{(PROJECT / file).read_text()}```" in guide
