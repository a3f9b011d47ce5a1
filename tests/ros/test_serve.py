"""The served robot as others meet it: our own node, Debian's rospy under Debian's master, and signals."""

import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing

import numpy as np
import pytest

from taskslam.benchmark.serve import ServeSettings, serve
from taskslam.datasets import ros_decoding
from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.errors import InputError, RecordError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan, WheelOdometry
from taskslam.record.journal import read_journal
from taskslam.record.served import EVENTS, load_served
from taskslam.ros import names
from taskslam.ros.encoding import EPOCH
from taskslam.ros.ros1.transport import Ros1
from taskslam.simulation.simulator import DEFAULT_SENSORS, Simulator
from taskslam.stopping import StoppedError

START = SE2(-2.0, -1.0, 0.0)


class Stoppable(Ros1):
    """As if a signal came, where a test runs the server in a thread."""

    stopped = False

    def hear(self, longest_s):
        if self.stopped:
            raise StoppedError(signal.SIGINT)
        return super().hear(longest_s)


class Server:
    """A served robot in a thread, and `us`: a node of ours that hears all of it."""

    def __init__(self, stage, out, **settings):
        self.out, self.error = out, None
        self.transport = Stoppable("/robot", None)
        self.settings = ServeSettings(**settings)
        self.us = Ros1("/us", self.transport.variables["ROS_MASTER_URI"])
        self.heard = []
        self.encoder = RosEncoder(self.us.store)
        self.us.advertise(names.COMMAND, names.KINDS[names.COMMAND])
        self.us.advertise(names.PLACE, names.KINDS[names.PLACE])
        self.thread = threading.Thread(target=self._run, args=(stage,))
        self.thread.start()

    def _run(self, stage):
        try:
            self.served = serve(stage, self.transport, self.settings, self.out)
        except Exception as error:
            self.error = error

    def until(self, holds, within_s=20.0):
        """Hear until something holds."""
        deadline = time.monotonic() + within_s
        while not (found := holds()):
            assert time.monotonic() < deadline, "it never came to hold"
            assert self.error is None, self.error
            self.heard += self.us.hear(0.05)
        return found

    def subscribe(self, *topics):
        self.until(lambda: set(topics) <= set(self.us.published()))
        for topic in topics:
            self.us.subscribe(topic, self.us.published()[topic])
        self.until(lambda: all(map(self.us.writers, topics)) and self.us.readers(names.COMMAND))

    def of(self, topic):
        return [heard.content for heard in self.heard if heard.topic == topic]

    def now(self):
        clocks = self.of(names.CLOCK)
        return (clocks[-1].clock.sec * NANOSECONDS + clocks[-1].clock.nanosec) / NANOSECONDS if clocks else 0.0

    def command(self, linear, angular):
        self.us.publish(names.COMMAND, self.encoder.twist(linear, angular))

    def notices(self):
        return [event.text for event in read_journal(self.out / EVENTS).events if hasattr(event, "text")]

    def close(self):
        self.transport.stopped = True
        self.thread.join(30)
        self.us.close()
        self.transport.close()


@pytest.fixture
def served(make_stage, tmp_path):
    made = []

    def start(**settings):
        made.append(Server(make_stage([[0.0, -1.0, 0.0]]), tmp_path / f"served{len(made)}", **settings))
        return made[-1]

    yield start
    for server in made:
        server.close()


def odometry(server):
    return [ros_decoding.odometry(message, None) for message in server.of("/odom")]


def test_it_says_what_the_simulator_measures_and_no_true_pose(served, make_stage):
    server = served(factor=4.0, seed=3)
    server.subscribe("/scan", "/odom", names.TF, names.TF_STATIC, names.CLOCK, names.MAP_TOPIC, names.BUMPER, "/points")
    server.until(lambda: len(server.of("/scan")) > 3 and server.of("/points"))
    stage = make_stage([[0.0, -1.0, 0.0]])
    rig = stage.robot.rig
    published = server.us.published()
    assert "/ground_truth/odom" not in published
    assert {"/imu", "/velodyne_points", "/points", "/stereo/left/image_rect", "/stereo/right/camera_info"} <= set(
        published
    )
    scan = ros_decoding.laser_scan(server.of("/scan")[-1], rig.lidar_2d)
    simulator = Simulator(stage.world, stage.robot, 3, sensors=DEFAULT_SENSORS)
    simulator.reset(START)
    simulator.go_on(0, 0)
    same = [one for one in simulator.advance(scan.stamp - EPOCH) if isinstance(one, LaserScan)][-1]
    assert np.array_equal(scan.ranges, same.ranges)
    said = odometry(server)[-1]
    transform = server.of(names.TF)[-1].transforms[0]
    assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_footprint")
    assert all(one.stamp % (NANOSECONDS // 50) == 0 for one in odometry(server))
    mounts = {one.child_frame_id: one.transform.translation.z for one in server.of(names.TF_STATIC)[0].transforms}
    assert mounts["laser"] == rig.lidar_2d.mount.xyz[2]
    (plan,) = server.of(names.MAP_TOPIC)
    assert (plan.info.height, plan.info.width) == stage.plan.cells.shape
    assert np.array_equal(
        np.asarray(plan.data, np.int8).view(np.uint8).reshape(stage.plan.cells.shape), stage.plan.cells
    )
    assert plan.info.origin.position.x == stage.plan.origin.x
    assert [message.data for message in server.of(names.BUMPER)] == [False]
    assert isinstance(said, WheelOdometry)
    clocks = [message.clock.sec * NANOSECONDS + message.clock.nanosec for message in server.of(names.CLOCK)]
    assert clocks == sorted(set(clocks))
    assert max(np.diff(clocks)) <= NANOSECONDS // 100


def test_pictures_are_drawn_for_who_looks_at_them(served):
    server = served(factor=1.0)
    server.subscribe("/stereo/left/image_rect", "/stereo/left/camera_info")
    server.until(lambda: server.of("/stereo/left/image_rect") and server.of("/stereo/left/camera_info"), 60.0)
    image, info = server.of("/stereo/left/image_rect")[0], server.of("/stereo/left/camera_info")[0]
    assert (image.width, image.height, image.encoding) == (info.width, info.height, "mono8") == (752, 480, "mono8")
    assert np.asarray(image.data).std() > 5.0


def test_the_true_pose_is_published_where_the_record_says_so(served):
    server = served(factor=4.0, publish_truth=True)
    server.subscribe("/ground_truth/odom", names.CLOCK)
    server.until(lambda: server.of("/ground_truth/odom"))
    assert server.of("/ground_truth/odom")[0].pose.pose.position.x == START.x
    server.close()
    record, truth = load_served(server.out)
    assert record.publishes_truth
    assert record.ended
    assert truth.poses[0].tolist() == [START.x, START.y, START.theta]


def test_in_step_a_command_is_a_period_and_a_person_who_stops_it_leaves_all_whole(served):
    server = served()
    server.subscribe("/odom", names.CLOCK)
    server.command(0.3, 0.0)
    server.until(lambda: server.now() and any(one.linear > 0 for one in odometry(server)))
    before = server.now()
    for _ in range(40):
        clock = server.now()
        server.command(0.3, 0.0)
        server.until(lambda clock=clock: server.now() >= clock + 0.05)
    passed = server.now() - before
    server.transport.stopped = True
    server.thread.join(20)
    assert 2.0 <= passed <= 2.2  # the first periods still passed by themselves
    record, truth = load_served(server.out)
    assert record.ended
    assert record.vain == 0
    assert not record.publishes_truth
    assert truth.poses[-1, 0] > START.x + 0.4
    assert np.array_equal(truth.poses[-1], truth.poses[-2])  # it stands
    assert server.notices()[-1] == "stopped by SIGINT: the robot stands, nothing more is served"


def test_a_robot_whose_commander_is_gone_stands(served):
    server = served(patience_s=60.0)
    server.subscribe("/odom", names.CLOCK)
    other = Ros1("/other", server.transport.variables["ROS_MASTER_URI"])
    with closing(other):
        other.advertise(names.COMMAND, names.KINDS[names.COMMAND])
        server.us.close()  # who alone would still command
        for _ in range(20):
            deadline = time.monotonic() + 10
            while not other.readers(names.COMMAND) and time.monotonic() < deadline:
                time.sleep(0.01)
            other.publish(names.COMMAND, server.encoder.twist(0.3, 0.0))
            time.sleep(0.01)
    deadline = time.monotonic() + 10
    while not any("is gone" in text for text in server.notices()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert "/other is gone and nobody commands any more: zero speed" in server.notices()
    server.close()
    _, truth = load_served(server.out)
    assert np.array_equal(truth.poses[-1], truth.poses[-2])


def test_what_no_robot_can_do_is_said_and_not_done(served):
    server = served()
    server.subscribe("/odom", names.PLACED, names.CLOCK)
    other = Ros1("/other", server.transport.variables["ROS_MASTER_URI"])
    with closing(other):
        other.advertise(names.COMMAND, names.KINDS[names.COMMAND])
        server.until(lambda: other.readers(names.COMMAND))
        server.command(math.nan, 0.0)
        server.until(lambda: any("not finite" in text for text in server.notices()))
        other.publish(names.COMMAND, server.encoder.twist(0.0, 0.0))
        server.until(lambda: any("both command" in text for text in server.notices()))
    for frame, pose in (("odom", START), ("map", SE2(2.0, 1.0, 0.0)), ("map", SE2(1.0, -1.0, 1.0))):
        count = len(server.notices())
        server.us.publish(names.PLACE, server.encoder.pose_stamped(0, frame, pose))
        server.until(lambda count=count: len(server.notices()) > count)
    server.until(lambda: server.of(names.PLACED))
    assert server.notices() == [
        "/us commands a speed that is not finite: zero speed",
        "/other and /us both command on /cmd_vel: the last one counts",
        "/us would put the robot down in the frame 'odom': expected 'map'",
        "/us would put the robot at (2.00, 1.00, 0.00), where it touches something: it stays where it is",
        "/us put the robot at (1.00, -1.00, 1.00)",
    ]
    (placed,) = server.of(names.PLACED)
    assert placed.pose.position.x == 1.0
    server.close()
    assert load_served(server.out)[1].poses[-1].tolist() == pytest.approx([1.0, -1.0, 1.0])


def test_a_folder_that_stands_and_a_period_that_is_none_are_refused(make_stage, tmp_path):
    stage = make_stage([[0.0, -1.0, 0.0]])
    with closing(Ros1("/robot", None)) as transport:
        with pytest.raises(RecordError, match="exists already"):
            serve(stage, transport, ServeSettings(seconds=0.1), tmp_path)
        with pytest.raises(InputError, match=r"--period 0\.003: expected a multiple of 0\.01 s"):
            serve(stage, transport, ServeSettings(period=0.003), tmp_path / "new")
    with pytest.raises(InputError, match=r"no ROS master answers at http://127\.0\.0\.1:1/"):
        Ros1("/robot", "http://127.0.0.1:1/")


def test_rospy_drives_it_under_debians_master(debian_python, run_peer, world_file, peers, tmp_path):
    master = run_peer("", str(peers / "debian_master.py"))
    uri = master.stdout.readline().strip()
    out = tmp_path / "served"
    command = [sys.executable, "-c", "from taskslam.cli.main import main; main()", "serve", str(world_file)]
    server = subprocess.Popen(
        [*command, "--join", uri, "--out", str(out), "-q"], stderr=subprocess.PIPE, text=True, env=dict(os.environ)
    )
    driver = run_peer(uri, str(peers / "rospy_driver.py"))
    said = json.loads(driver.stdout.readline())
    server.send_signal(signal.SIGINT)
    _, complaints = server.communicate(timeout=60)
    assert server.returncode == 0, complaints
    assert said["distance"] == pytest.approx(0.4, abs=0.2)  # 0.2 m/s for two seconds, less the ramp, and what lingers
    assert said["commands"] == pytest.approx(20, abs=3)  # at 10 Hz of simulated time
    assert said["rays"] == 1024
    record, truth = load_served(out)
    assert record.variables == {"ROS_MASTER_URI": uri}
    assert truth.poses[-1, 0] == pytest.approx(said["distance"], abs=0.1)
    assert np.array_equal(truth.poses[-1], truth.poses[-2])
