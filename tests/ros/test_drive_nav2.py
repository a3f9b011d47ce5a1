"""A tour driven by somebody's Nav2: an action server of our own, over the bridge, on our served simulator."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from ros.served import Served
from small_tour import write_tour
from taskslam.benchmark.robot_tour import on_robot, stack_for, stack_name
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage
from taskslam.errors import InputError
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, MethodNotice, RoundEnded, load_run
from taskslam.ros.connection import Connection
from taskslam.ros.opening import join_graph
from taskslam.scenario import load_scenario
from taskslam.stopping import StoppedError

GOALS = [[0.4, 0.0, 0.0], [0.4, 0.3, 1.5]]
PAGE = Path(__file__).parents[2] / "docs" / "served_robot.md"


@pytest.fixture(scope="module")
def setup(ros2_messages):
    return ros2_messages


@pytest.fixture(scope="module")
def tour(tmp_path_factory):
    return write_tour(tmp_path_factory.mktemp("tour"), GOALS, "rounds: 1, pause: 0.5, still_start: 0.2")


@pytest.fixture(scope="module")
def served(setup, tour, tmp_path_factory):
    robot = Served(tour, tmp_path_factory.mktemp("nav2") / "served", "--ros", "2", "--setup", setup)
    yield robot
    robot.stop(signal.SIGKILL)


@pytest.fixture
def join(monkeypatch):
    def speak(served):
        """This process speaks in the robot's domain, and waits long for a busy machine to find others."""
        monkeypatch.setattr("taskslam.benchmark.ros_platform._READY_S", 60.0)
        for variable, value in served.variables.items():
            monkeypatch.setenv(variable, value)
        return served

    return speak


@pytest.fixture
def joined(served, join):
    return join(served)


@pytest.fixture
def joined_alone(join, setup, tour, tmp_path):
    """In the domain of a robot that no other test meets: somebody is killed there."""
    robot = Served(tour, tmp_path / "served", "--ros", "2", "--setup", setup)
    yield join(robot)
    robot.stop(signal.SIGKILL)


class SmallNav2:
    """The action server in a process of its own, and what it has said."""

    def __init__(self, served, setup, peers, fault="", **variables):
        command = f'. {setup} && exec python3 {peers / "nav2_node.py"} --fault "{fault}"'
        environment = os.environ | served.variables | variables
        self.process = subprocess.Popen(["bash", "-c", command], env=environment, stdout=subprocess.PIPE, text=True)
        self.said = []
        self.reader = threading.Thread(target=lambda: self.said.extend(map(str.strip, self.process.stdout)))
        self.reader.start()

    def until(self, word, alive=lambda: True):
        """Until it has said a word, as long as something else lives."""
        deadline = time.monotonic() + 120.0
        while word not in self.said:
            assert self.process.poll() is None, "it has ended"
            assert alive(), "nobody sends goals any more"
            assert time.monotonic() < deadline, f"it never said '{word}'"
            time.sleep(0.02)

    def __enter__(self):
        self.until("ready")
        return self

    def __exit__(self, *_):
        """It leaves the graph: what a killed one leaves in shared memory may swallow what the next one is told."""
        self.process.terminate()
        try:
            self.process.wait(30.0)
        except subprocess.TimeoutExpired:  # it hangs in a callback
            self.process.kill()
            self.process.wait()
        self.reader.join()


def drive(stage, out, setup, observer=None, **connection):
    observer, stage = observer or Observer(), on_robot(stage)
    described = Connection.model_validate({"look": 2.5, "setup": setup, **connection})
    connect = lambda: join_graph(2, "/tour", "", setup)  # noqa: E731
    platform, driver = stack_for(stage, 2, connect, described, observer)
    spec = stage.spec(stack_name(2, described), Mode.WITHOUT_MAP)
    directory, complete = run(stage, spec, out, observer, platform=platform, driver=driver)
    return load_run(directory), complete


def stage_of(tour, **keys):
    return set_stage(load_scenario(tour, [f"protocol.{key}={value}" for key, value in keys.items()]), [], Observer())


def of_kind(record, kind):
    return [event for event in record.events if isinstance(event, kind)]


def test_a_tour_driven_by_somebodys_nav2_in_rounds_between_which_it_drives_to_the_start(
    joined, setup, peers, tour, tmp_path
):
    with SmallNav2(joined, setup, peers, fault="nan"):
        record, complete = drive(stage_of(tour, rounds=2), tmp_path, setup, to_start="goal", stack={"name": "small"})
    assert complete
    arrivals = of_kind(record, Arrival)
    assert [(one.round, one.goal) for one in arrivals] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for one in arrivals:
        goal = GOALS[one.goal]
        assert one.truth is None
        assert one.estimate.array() == pytest.approx(goal, abs=0.1)
        assert one.odometry.array()[:2] == pytest.approx(goal[:2], abs=0.2)
    said = [event.text for event in of_kind(record, MethodNotice)]
    assert any("put down at (0.00, 0.00, 0.00)" in text for text in said)
    assert any(text.startswith("the robot drove to the start (0.00, 0.00, 0.00); its odometry read") for text in said)
    assert any("the stack's map is the floor plan's" in text for text in said)
    assert record.manifest.method == "small"
    estimate = record.trajectory(1, "estimate")
    assert len(estimate.poses) > 20
    assert np.isfinite(estimate.poses).all()


@pytest.mark.parametrize(
    ("fault", "outcome", "words"),
    [
        (
            "abort",
            Outcome.NO_PLAN,
            'aborted with error code 208 (planner: there is no valid path): "no way there"',
        ),
        ("reject", Outcome.NO_PLAN, 'the goal was not accepted: "/navigate_to_pose does not accept it"'),
        ("hang", Outcome.GOAL_TIMEOUT, "not reached within 2 s"),
    ],
)
def test_how_a_goal_failed_is_told_in_words_and_it_is_canceled(
    joined, setup, peers, tour, tmp_path, fault, outcome, words
):
    with SmallNav2(joined, setup, peers, fault) as nav2:
        record, complete = drive(stage_of(tour, goal_timeout=2), tmp_path, setup)
        if fault == "hang":
            nav2.until("canceled")
    assert not complete
    (failed,) = of_kind(record, GoalFailed)
    assert (failed.outcome, failed.detail) == (outcome, words)
    assert of_kind(record, RoundEnded)[0].outcome is outcome


def test_a_goal_whose_server_is_killed_ends_by_itself(joined_alone, setup, peers, tour, tmp_path):
    profile = tmp_path / "short_lease.xml"
    text = Path(joined_alone.variables["FASTDDS_DEFAULT_PROFILES_FILE"]).read_text()
    lease = "<leaseDuration><sec>3</sec></leaseDuration><leaseAnnouncement><sec>1</sec></leaseAnnouncement>"
    profile.write_text(text.replace("<discovery_config>", f"<discovery_config>{lease}"))
    with SmallNav2(joined_alone, setup, peers, "hang", FASTDDS_DEFAULT_PROFILES_FILE=str(profile)) as nav2:
        killer = threading.Thread(target=lambda: (nav2.until("driving"), nav2.process.kill()))
        killer.start()
        record, complete = drive(stage_of(tour, goal_timeout=1000), tmp_path / "out", setup)
        killer.join()
    assert not complete
    (failed,) = of_kind(record, GoalFailed)
    assert failed.outcome is Outcome.CRASHED
    assert failed.detail.startswith("whoever drove to the goal is gone")


class StopsUnderWay(Observer):
    """A signal that comes while a goal is under way."""

    def __init__(self, nav2):
        self.nav2, self.driving = nav2, False

    def heading_for(self, index, count):
        self.driving = True

    def ticked(self, now):
        if self.driving:
            self.nav2.until("driving")
            raise StoppedError(signal.SIGINT)


def test_a_signal_cancels_the_goal(joined, setup, peers, tour, tmp_path):
    with SmallNav2(joined, setup, peers) as nav2:
        with pytest.raises(StoppedError):
            drive(stage_of(tour), tmp_path, setup, StopsUnderWay(nav2))
        nav2.until("canceled")


def test_the_bridge_cancels_the_goal_of_a_tour_that_is_killed(joined, setup, peers, tour, tmp_path):
    """The command of the page."""
    (tmp_path / "my_robot.yaml").write_text(f"setup: {setup}\nlook: 2.5\n")
    (tmp_path / "my_tour.yaml").write_text(tour.read_text())
    (line,) = (line for line in PAGE.read_text().splitlines() if "--drive nav2 --platform" in line)
    words = line.partition("&& taskslam ")[2].split()
    main = "from taskslam.cli.main import main; main()"
    command = [sys.executable, "-c", main, *words, "--quiet"]
    with SmallNav2(joined, setup, peers) as nav2, subprocess.Popen(command, cwd=tmp_path) as ours:
        nav2.until("driving", lambda: ours.poll() is None)
        ours.kill()
        nav2.until("canceled")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (None, r"nobody publishes /tf|nobody takes goals on /navigate_to_pose"),
        ("wrong", r"no transform connects 'map' and 'base_footprint': 'base_footprint' hangs below 'world'"),
    ],
)
def test_a_robot_without_nav2_or_with_another_frame_is_refused_before_it_moves(
    joined, setup, peers, tour, tmp_path, monkeypatch, fault, words
):
    monkeypatch.setattr("taskslam.benchmark.ros_platform._READY_S", 5.0)
    nav2 = nullcontext() if fault is None else SmallNav2(joined, setup, peers, fault)
    with nav2, pytest.raises(InputError, match=words):
        drive(stage_of(tour), tmp_path, setup)
