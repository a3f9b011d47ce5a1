"""A tour on a robot: our served simulator through both doors, what a look finds before anything moves, and faults."""

import os
import signal
import subprocess
import sys
import threading
import time
from datetime import datetime

import numpy as np
import pytest

from ros.served import Served
from taskslam.benchmark.robot_tour import AtTheKeyboard, on_robot, robot_for
from taskslam.benchmark.ros_platform import RobotFailedError, RosPlatform
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage
from taskslam.datasets.bag_sensor import messages_of
from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan, WheelOdometry
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.record import Arrival, DrivenBy, MethodNotice, RoundEnded, load_run
from taskslam.record.run_directory import find_partial_runs, find_runs
from taskslam.record.served import load_served
from taskslam.ros import names
from taskslam.ros.connection import Connection
from taskslam.ros.opening import join_graph
from taskslam.ros.ros1.transport import Ros1
from taskslam.scenario import load_scenario
from taskslam.simulation.simulator import DEFAULT_SENSORS

LONG = pytest.mark.skipif(not os.environ.get("TASKSLAM_TORTURE"), reason="whole tours in processes: make torture")
NEAR = [[-1.4, -1.0, 0.0], [-1.4, -0.6, 1.5]]


@pytest.fixture
def serve(world_file, tmp_path):
    made = []

    def start(*words):
        made.append(Served(world_file, tmp_path / f"served{len(made)}", *words))
        return made[-1]

    yield start
    for served in made:
        if served.process.returncode is None:
            served.process.kill()
            served.process.communicate()


@pytest.fixture
def stage_of(world_file):
    return lambda rounds: set_stage(load_scenario(world_file, [f"protocol.rounds={rounds}"]), [], Observer())


class Notices(Observer):
    def __init__(self):
        self.said = []

    def notice(self, text):
        self.said.append(text)


def drive(stage, served, out, mode, ros=1, observer=None, **connection):
    """The tour on a robot; its record, and whether every goal was reached."""
    observer, stage = observer or Observer(), on_robot(stage)
    connection = Connection.model_validate({"look": 1.5, **connection})
    platform = robot_for(stage, lambda: join_graph(ros, "/tour", served.where), connection, observer)
    directory, complete = run(stage, stage.spec("karto", mode), out, observer, platform=platform)
    return load_run(directory), complete


def of_kind(record, kind):
    return [event for event in record.events if isinstance(event, kind)]


def zero_of(record):
    zero = datetime.fromisoformat(record.manifest.started_utc)
    return round(zero.timestamp() * 1e6) * 1000


@pytest.mark.parametrize(
    ("ros", "mode", "rounds"),
    [
        (1, Mode.WITHOUT_MAP, 1),
        (2, Mode.WITHOUT_MAP, 1),
        pytest.param(1, Mode.WITHOUT_MAP, 3, marks=LONG),
        pytest.param(1, Mode.WITH_MAP, 1, marks=LONG),
        pytest.param(2, Mode.WITH_MAP, 1, marks=LONG),
    ],
)
def test_a_tour_through_both_doors_is_the_tour_of_the_simulator(
    serve, stage_of, tmp_path, request, monkeypatch, ros, mode, rounds
):
    stage = stage_of(rounds)
    directory, _ = run(stage, stage.spec("karto", mode), tmp_path / "simulated")
    simulated = load_run(directory)
    if ros == 2:
        request.getfixturevalue("ros2")
    served = serve("--ros", str(ros))
    for variable, value in served.variables.items():
        monkeypatch.setenv(variable, value)
    record, complete = drive(stage, served, tmp_path / "driven", mode, ros)
    assert served.stop() == 0
    _, truth = load_served(served.out)
    assert complete
    assert record.manifest.driven_by is DrivenBy.ROBOT
    assert any("put down at" in event.text for event in of_kind(record, MethodNotice))
    ours, theirs = of_kind(record, Arrival), of_kind(simulated, Arrival)
    assert [(one.round, one.goal) for one in ours] == [(one.round, one.goal) for one in theirs]
    for driven, expected in zip(ours, theirs, strict=True):
        assert driven.truth is None
        at = truth.poses[np.searchsorted(truth.stamps, driven.t + zero_of(record))]
        same = 1e-9 if ros == 1 else 0.02  # in ROS 2 a command may meet another period
        assert at == pytest.approx(expected.truth.array(), abs=same)
        assert driven.estimate.array() == pytest.approx(expected.estimate.array(), abs=same)
    if ros == 1:
        assert record.trajectory(0, "estimate").poses == pytest.approx(simulated.trajectory(0, "estimate").poses)


def test_a_look_says_all_that_is_not_as_it_must_be_and_nothing_moves(serve, stage_of, tmp_path):
    stage = stage_of(1)
    served = serve()
    wrong = {
        "topics": {"/scan": "/scna", "/cmd_vel": "/mobile_base/cmd_vel"}, "stop": "/emergency_stop", "base": "trunk"
    }  # fmt: skip
    with pytest.raises(InputError) as refused:
        drive(stage, served, tmp_path / "driven", Mode.WITHOUT_MAP, **wrong)
    for words in (
        "the robot was looked at before it moves: nobody publishes /scna (laser_scan, ",
        "; of its type there is /scan",
        "the stop button: /emergency_stop is published by nobody; expected std_msgs/msg/Bool",
        "nobody reads /mobile_base/cmd_vel, on which we command",
    ):
        assert words in str(refused.value)
    with pytest.raises(InputError, match="no static transform connects the frame 'laser' of /scan to the base 'trunk'"):
        drive(stage, served, tmp_path / "driven", Mode.WITHOUT_MAP, base="trunk")
    assert find_runs(tmp_path / "driven") == find_partial_runs(tmp_path / "driven") == []
    served.stop()
    assert (load_served(served.out)[1].poses == [0.0, 0.0, 0.0]).all()
    platform = robot_for(on_robot(stage), lambda: None, Connection(), Observer())
    with pytest.raises(InputError, match="is told the truth, which a robot does not know"):
        run(stage, stage.spec("ground_truth", Mode.WITHOUT_MAP), tmp_path / "driven", platform=platform)


@LONG
def test_rounds_that_ended_are_kept_when_the_robot_dies(serve, stage_of, tmp_path):
    stage = stage_of(3)
    served = serve()

    def kill_in_the_second_round():
        while sum("put the robot" in text for text in served.notices()) < 2:
            time.sleep(0.05)
        time.sleep(0.2)
        served.process.kill()

    killer = threading.Thread(target=kill_in_the_second_round)
    killer.start()
    with pytest.raises(RobotFailedError, match=r"(nobody|no odometry|has stood).*: the robot was told to stand"):
        drive(stage, served, tmp_path / "driven", Mode.WITHOUT_MAP)
    killer.join()
    (partial,) = find_partial_runs(tmp_path / "driven")
    assert (partial / "round00" / "estimate.tum").exists()
    with pytest.raises(InputError, match="before the end of the rounds that were driven already: it was set back"):
        drive(stage, serve(), tmp_path / "driven", Mode.WITHOUT_MAP)


@LONG
def test_a_tour_that_is_stopped_leaves_the_robot_standing_and_goes_on(serve, world_file, tmp_path):
    served = serve()
    words = ["run", str(world_file), "-m", "karto", "--mode", "without-map", "--rounds", "3", "--platform", "ros1"]
    command = [
        sys.executable,
        "-c",
        "from taskslam.cli.main import main; main()",
        *words,
        "--out",
        str(tmp_path / "out"),
    ]
    environment = {**os.environ, "ROS_MASTER_URI": served.where}

    def start():
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )

    tour = start()
    deadline = time.monotonic() + 120
    while sum("put the robot" in text for text in served.notices()) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    tour.send_signal(signal.SIGINT)
    _, said = tour.communicate(timeout=60)
    assert tour.returncode == 128 + signal.SIGINT, said
    assert "1 round ended, after which the next start goes on" in said
    again = start()
    _, said = again.communicate(timeout=120)
    assert again.returncode == 0, said
    assert "goes on after 1 round that ended" in said
    record = load_run(tmp_path / "out" / "tour" / "karto" / "without-map" / "seed0")
    stamps = [event.t for event in record.events]
    assert stamps == sorted(stamps)
    assert len(of_kind(record, RoundEnded)) == 3
    served.stop()
    truth = load_served(served.out)[1].poses
    assert np.array_equal(truth[-1], truth[-2])


class WallRobot:
    """A robot on the wall's clock that only says that it moves as it is told, and may fall silent."""

    def __init__(self, rig, scan):
        self.us = Ros1("/base", None)
        self.where = self.us.variables["ROS_MASTER_URI"]
        for topic in ("/odom", "/scan", "/stop"):
            kind = {"/odom": "nav_msgs/msg/Odometry", "/scan": "sensor_msgs/msg/LaserScan"}.get(
                topic, "std_msgs/msg/Bool"
            )
            self.us.advertise(topic, kind)
        self.us.subscribe(names.COMMAND, names.KINDS[names.COMMAND])
        self.commands, self.silent, self.x, self.ended = [], False, 5.0, False
        self.late_every, self.late = 10**9, NANOSECONDS // 2  # one message in so many bears another stamp
        self._rig, self._scan, self._encoder = rig, scan, RosEncoder(self.us.store)
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def press(self):
        self.us.publish("/stop", self._encoder.new("std_msgs/msg/Bool", data=True))

    def close(self):
        self.ended = True
        self._thread.join()
        self.us.close()

    def _live(self):
        for tick in range(10**9):
            if self.ended:
                return
            for heard in self.us.hear(0.02):
                self.commands.append((time.monotonic(), heard.content.linear.x, heard.content.angular.z))
            speed = self.commands[-1][1] if self.commands else 0.0
            self.x += 0.02 * speed
            now = time.time_ns() - ((tick + 1) % self.late_every == 0) * self.late
            said = [] if self.silent else [WheelOdometry(now, SE2(self.x, 2.0, 0.0), speed, 0.0)]
            if tick % 5 == 0:
                said.append(LaserScan(now, self._scan, -3.14, 0.00614, 0.1, 10.0))
            for one in said:
                for topic, _, message in messages_of(self._encoder, self._rig, one):
                    self.us.publish(topic, message)


class Carrier:
    """A person who says at once that the robot stands at the start."""

    def answered(self):
        time.sleep(0.05)
        return True


@pytest.fixture
def wall_robot(make_stage, rig):
    made = []

    def start(**connection):
        robot = WallRobot(rig, np.full(rig.lidar_2d.samples, 3.0, np.float32))
        made.append(robot)
        observer = Notices()
        platform = RosPlatform(
            on_robot(make_stage(NEAR)), lambda: Ros1("/tour", robot.where),
            Connection.model_validate({"look": 1.0, "fresh": 0.3, **connection}), DEFAULT_SENSORS, Carrier(), observer,
        )  # fmt: skip
        return robot, platform, observer

    yield start
    for robot in made:
        robot.close()


def stood_by_itself(robot, platform, within_s=5.0):
    """Whether the last command that reached the robot is to stand, though nobody gave it."""
    deadline = time.monotonic() + within_s
    while (not robot.commands or robot.commands[-1][1:] != (0.0, 0.0)) and time.monotonic() < deadline:
        time.sleep(0.02)
    return robot.commands[-1][1:] == (0.0, 0.0)


def test_a_robot_on_the_walls_clock_begins_where_a_person_put_it(wall_robot):
    robot, platform, observer = wall_robot(stop="/stop", limits={"linear": 0.1, "angular": 0.5})
    with platform:
        said = platform.place(SE2(-2.0, -1.0, 0.0))
        assert (
            said
            == "a person put the robot at the start (-2.00, -1.00, 0.00); its odometry read (5.000, 2.000, 0.000) then"
        )
        assert any("press Enter here" in text for text in observer.said)
        assert abs(platform.zero_utc.timestamp() - time.time()) < 60
        heard = []
        for _ in range(20):
            heard += platform.advance(platform.now + NANOSECONDS // 20)
            platform.drive(0.3, 0.6)
        stamps = [one.stamp for one in heard]
        assert stamps == sorted(stamps)
        assert {type(one) for one in heard} == {WheelOdometry, LaserScan}
        first = next(one for one in heard if isinstance(one, WheelOdometry))
        assert first.T_odom_base.x == pytest.approx(0.0, abs=1e-6)
        assert robot.commands[-1][1:] == pytest.approx((0.1, 0.2))  # scaled as a whole
    assert stood_by_itself(robot, platform)


def test_a_tour_is_not_gone_on_with_on_a_clock_that_was_set_back(wall_robot):
    _, platform, _ = wall_robot()
    with platform:
        zero = platform.zero_utc
        platform.go_on(0, 1, zero)
        assert platform.zero_utc == zero
        with pytest.raises(InputError, match=r"is \d+ s before the end of the rounds that were driven already"):
            platform.go_on(3600 * NANOSECONDS, 1, zero)


@pytest.mark.parametrize(("late", "words"), [(1, r"0\.[5-9]\d s behind"), (-1, r"0\.[1-5]\d s ahead of")])
def test_a_clock_that_is_off_is_refused(wall_robot, late, words):
    robot, platform, _ = wall_robot()
    robot.late_every, robot.late = 1, late * NANOSECONDS // 2
    with pytest.raises(InputError, match=rf"stamps of /odom are {words} this machine's time"):
        platform.open()
    platform.close()


@pytest.mark.parametrize("late", [1, -1])
def test_one_message_with_another_stamp_is_not_a_clock_that_is_off(wall_robot, late):
    robot, platform, _ = wall_robot()
    robot.late_every, robot.late = 10, late * NANOSECONDS // 2
    with platform:
        platform.place(SE2(-2.0, -1.0, 0.0))
        before = platform.now
        list(platform.advance(before + NANOSECONDS // 20))
        assert platform.now > before


def test_the_dead_man_stops_a_robot_that_nobody_commands(wall_robot):
    robot, platform, observer = wall_robot()
    with platform:
        platform.place(SE2(-2.0, -1.0, 0.0))
        list(platform.advance(platform.now + NANOSECONDS // 20))
        platform.drive(0.2, 0.0)
        while not any(linear == 0.2 for _, linear, _ in robot.commands):
            time.sleep(0.01)
        assert stood_by_itself(robot, platform)
        assert "no command for 0.3 s: the robot was told to stand" in observer.said


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            lambda robot: setattr(robot, "silent", True),
            r"no odometry for 0\.\d s on /odom: the robot was told to stand",
        ),
        (WallRobot.press, r"the stop button was pressed \(/stop\): the robot was told to stand"),
        (WallRobot.close, r"nobody (publishes /odom|reads /cmd_vel) any more|no odometry"),
    ],
    ids=["no fresh pose", "stop button", "gone"],
)
def test_a_fault_under_way_stops_the_robot_first_and_is_named(wall_robot, fault, words):
    robot, platform, _ = wall_robot(stop="/stop")
    with platform:
        platform.place(SE2(-2.0, -1.0, 0.0))

        def go():
            for _ in range(100):
                list(platform.advance(platform.now + NANOSECONDS // 20))
                platform.drive(0.2, 0.0)
                if platform.now > began + NANOSECONDS // 2 and fault not in done:
                    done.append(fault)
                    fault(robot)

        began, done = platform.now, []
        with pytest.raises(RobotFailedError, match=words):
            go()
        assert robot.ended or stood_by_itself(robot, platform, 1.0)


def test_a_person_answers_at_the_keyboard(tmp_path):
    reading, writing = os.pipe()
    with os.fdopen(reading) as stream:
        person = AtTheKeyboard(stream)
        assert not person.answered()
        os.write(writing, b"\n")
        assert person.answered()
        assert not person.answered()
        os.close(writing)
        assert not person.answered()  # nobody is there any more
        assert not person.answered()
