"""A tour driven by move_base: its action over topics, its messages by their sums, its death in the middle."""

import math
import threading

import pytest

from ros.served import Served
from small_tour import write_tour
from taskslam.benchmark.robot_tour import on_robot, stack_for, stack_name
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage
from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, load_run
from taskslam.ros import names
from taskslam.ros.connection import Connection
from taskslam.ros.navigation import End, judged
from taskslam.ros.opening import join_graph
from taskslam.ros.ros1.move_base import MoveBase
from taskslam.ros.ros1.transport import Ros1
from taskslam.scenario import load_scenario

GOALS = [[0.4, 0.0, 0.0], [0.4, 0.3, 1.5]]
SUMS = {
    "ActionGoal": "660d6895a1b9a16dce51fbdd9a64a56b",
    "ActionResult": "1eb06eeff08fa7ea874431638cb52332",
}
"""Of move_base_msgs, as its users' nodes ask for them."""


class SmallMoveBase:
    """Turns, drives straight to the goal, and turns; localised by odometry alone. Ends goals by `status` and `text`."""

    def __init__(self, where, status=3, text="Goal reached."):
        self.us, self.status, self.text = Ros1("/move_base", where), status, text
        self.mine = MoveBase(self.us, "/elsewhere")  # so that the messages are known here too
        encoder = self.encoder = RosEncoder(self.us.store)
        self.us.advertise("/move_base/status", "actionlib_msgs/msg/GoalStatusArray")
        self.us.advertise("/move_base/result", "move_base_msgs/msg/MoveBaseActionResult")
        self.us.advertise(names.COMMAND, names.KINDS[names.COMMAND])
        self.us.advertise(names.TF, names.KINDS[names.TF])
        for topic, kind in (
            ("/move_base/goal", "move_base_msgs/msg/MoveBaseActionGoal"),
            ("/move_base/cancel", "actionlib_msgs/msg/GoalID"),
            ("/odom", "nav_msgs/msg/Odometry"),
        ):
            self.us.subscribe(topic, kind)
        self.map_to_odom = lambda stamp: encoder.new(
            names.KINDS[names.TF],
            transforms=[encoder._transform(stamp, "map", "odom", [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])],
        )
        self.goal, self.ended, self.said, self.dies = None, False, [], False
        self.thread = threading.Thread(target=self.live, daemon=True)
        self.thread.start()

    def live(self):
        while not self.ended:
            for heard in self.us.hear(0.05):
                message = heard.content
                if heard.topic == "/move_base/goal":
                    self.goal = message
                    self.said.append("driving")
                elif heard.topic == "/move_base/cancel":
                    self.end(2, "canceled")
                else:
                    self.step(message)
                if self.dies and self.goal is not None:
                    self.ended = True
        self.us.close()

    def step(self, odometry):
        pose = odometry.pose.pose
        stamp = odometry.header.stamp.sec * 10**9 + odometry.header.stamp.nanosec
        self.us.publish(names.TF, self.map_to_odom(stamp))
        if self.goal is None:
            return
        if self.status != 3:
            self.end(self.status, self.text)
            return
        at = SE2(pose.position.x, pose.position.y, 2 * math.atan2(pose.orientation.z, pose.orientation.w))
        target = self.goal.goal.target_pose.pose
        to = SE2(target.position.x, target.position.y, 2 * math.atan2(target.orientation.z, target.orientation.w))
        there = at.inverse() @ to
        away, bearing = math.hypot(there.x, there.y), math.atan2(there.y, there.x)
        if away > 0.02 and abs(bearing) > 0.1:
            command = 0.0, math.copysign(0.8, bearing)
        elif away > 0.02:
            command = min(0.3, 0.05 + away), bearing
        elif abs(there.theta) > 0.05:
            command = 0.0, math.copysign(min(0.8, 0.1 + abs(there.theta)), there.theta)
        else:
            self.end(3, self.text)
            return
        self.us.publish(names.COMMAND, self.encoder.twist(*command))

    def end(self, status, text):
        if self.goal is None:
            return
        new = self.encoder.new
        state = new("actionlib_msgs/msg/GoalStatus", goal_id=self.goal.goal_id, status=status, text=text)
        result = new("move_base_msgs/msg/MoveBaseResult")
        header = self.encoder.header(0, "")
        self.said.append(text)
        self.goal = None
        self.us.publish(names.COMMAND, self.encoder.twist(0.0, 0.0))
        message = new("move_base_msgs/msg/MoveBaseActionResult", header=header, status=state, result=result)
        self.us.publish("/move_base/result", message)

    def close(self):
        self.ended = True
        self.thread.join()


@pytest.fixture(scope="module")
def tour(tmp_path_factory):
    return write_tour(tmp_path_factory.mktemp("tour"), GOALS, "rounds: 1, pause: 0.3, still_start: 0.2")


@pytest.fixture(scope="module")
def served(tour, tmp_path_factory):
    robot = Served(tour, tmp_path_factory.mktemp("move_base") / "served")
    yield robot
    robot.stop()


@pytest.fixture
def move_base(served, monkeypatch):
    monkeypatch.setattr("taskslam.benchmark.ros_platform._READY_S", 60.0)
    made = []

    def start(*words):
        made.append(SmallMoveBase(served.where, *words))
        return made[-1]

    yield start
    for one in made:
        one.close()


def drive(tour, out, where, **protocol):
    keys = [f"protocol.{key}={value}" for key, value in protocol.items()]
    stage, connection = on_robot(set_stage(load_scenario(tour, keys), [], Observer())), Connection(look=2.5)
    robot, driver = stack_for(stage, 1, lambda: join_graph(1, "/tour", where), connection, Observer())
    spec = stage.spec(stack_name(1, connection), Mode.WITH_MAP)
    directory, complete = run(stage, spec, out, platform=robot, driver=driver)
    return load_run(directory), complete


def of_kind(record, kind):
    return [event for event in record.events if isinstance(event, kind)]


def test_its_messages_are_those_of_everybody(served):
    us = Ros1("/sums", served.where)
    MoveBase(us, "/move_base")
    for name, digest in SUMS.items():
        assert us.store.generate_msgdef(f"move_base_msgs/msg/MoveBase{name}", ros_version=1)[1] == digest
    us.close()


def test_a_tour_driven_by_move_base(served, move_base, tour, tmp_path):
    move_base()
    record, complete = drive(tour, tmp_path, served.where)
    assert complete
    arrivals = of_kind(record, Arrival)
    assert [(one.round, one.goal) for one in arrivals] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for one in arrivals:
        assert one.estimate.array() == pytest.approx(GOALS[one.goal], abs=0.1)
    assert record.manifest.method == "move_base"


def test_what_it_says_of_a_goal_is_our_outcome(served, move_base, tour, tmp_path):
    words = "Failed to find a valid plan. Even after executing recovery behaviors."
    move_base(4, words)
    record, complete = drive(tour, tmp_path, served.where)
    assert not complete
    (failed,) = of_kind(record, GoalFailed)
    assert (failed.outcome, failed.detail) == (Outcome.NO_PLAN, f'aborted: "{words}"')


def test_one_that_dies_under_way_ends_the_goal(served, move_base, tour, tmp_path):
    move_base().dies = True
    record, complete = drive(tour, tmp_path, served.where)
    assert not complete
    (failed,) = of_kind(record, GoalFailed)
    assert failed.outcome is Outcome.CRASHED


@pytest.mark.parametrize(
    ("end", "outcome", "words"),
    [
        (End("succeeded", 0), Outcome.REACHED, ""),
        (End("aborted"), Outcome.NO_CONTROL, "aborted, and no reason is told"),  # Humble
        (End("aborted", 105), Outcome.OSCILLATION, "aborted with error code 105 (controller: no progress)"),  # Jazzy
        (
            End("aborted", 202, "map to base"),
            Outcome.LOST,
            'aborted with error code 202 (planner: a transform is missing or too old): "map to base"',
        ),  # Kilted
        (End("aborted", 4711), Outcome.NO_CONTROL, "aborted with error code 4711"),
        (End("canceled"), Outcome.NO_CONTROL, "somebody else canceled the goal"),
        (End("aborted", None, "Robot is oscillating."), Outcome.OSCILLATION, 'aborted: "Robot is oscillating."'),
    ],
)
def test_how_a_goal_ended_in_every_distribution(end, outcome, words):
    assert judged(end) == (outcome, words)
