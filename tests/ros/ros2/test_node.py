"""A ROS 2 node in the loop, behind the wall: rclpy from wheels, in lockstep; and what goes wrong."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS
from taskslam.outcomes import Outcome
from taskslam.ros.check import check_node
from taskslam.ros.node_file import load_node
from taskslam.ros.ros2.domain import SHARED_MEMORY
from taskslam.slam.content import place_of
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.latency import LatencyMode, LatencyModel
from taskslam.slam.registry import find_method

PEERS = Path(__file__).parents[1] / "peers"
NODE = PEERS / "rclpy_node.py"
POSE = {"topic": "/pose", "type": "geometry_msgs/PoseWithCovarianceStamped", "world": "map"}


@pytest.fixture
def write(ros2, write_node):
    """Node files of `rclpy_node.py`, under our own interpreter."""

    def written(**changes):
        content = {"name": "echo", "ros": 2, "frames": None, "needs": {"reads": [str(PEERS)]}, **changes}
        return write_node(content.pop("command", f"python3 {NODE}"), **content)

    return written


def running(name):
    """Processes whose command line names this."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdecimal() and name.encode() in (process / "cmdline").read_bytes():
                found.append(int(process.name))
        except OSError:
            continue
    return found


def leaves_nothing(before):
    return not running(str(NODE)) and not running("bridge_process.py") and shared() == before


def shared():
    return {entry.name for entry in SHARED_MEMORY.iterdir() if "fastdds" in entry.name}


def log_of(host):
    return host._log.read_text()


def test_every_scan_is_answered_with_the_odometry_of_its_own_stamp_twice_and_at_once(host_of, write, rig, drive):
    """Two nodes at once, in domains of their own, and the same bytes; parameters come with their types."""
    before = shared()
    hosts = [host_of(write(parameters={"whole": 7, "rate": 100.0}, reset="/reset")) for _ in range(2)]
    for host in hosts:
        host.start()
    assert len(running(str(NODE))) == 2
    estimates = drive(hosts[0], rig, 3.0, each=hosts[1].feed)
    others = hosts[1].collect(3 * NANOSECONDS)
    for host in hosts:
        host.stop()
    wheels = host_of("wheel_odometry")
    wheels.start()
    at = {estimate.stamp: estimate.T_start_base for estimate in drive(wheels, rig, 3.0)}
    assert [estimate.stamp for estimate in estimates] == [round(k * 0.1 * NANOSECONDS) for k in range(30)]
    for one, other in zip(estimates, others, strict=True):
        np.testing.assert_array_equal(one.T_start_base, at[one.stamp])
        assert one.T_start_base.tobytes() == other.T_start_base.tobytes()
    log = log_of(hosts[0])
    assert "whole 7 rate 100.0" in log
    assert "resets 1" in log
    assert "[ros] 30 frames, 30 answered, 0 missing, 0 late, 0 unmatched" in log
    assert leaves_nothing(before)


@pytest.mark.parametrize(
    ("fault", "outcome", "words"),
    [
        ("dies", Outcome.CRASHED, 'the node was killed by SIGABRT after printing ".*the map has no cells'),
        ("hangs", Outcome.STALLED, r"the node has not answered 2 frames in a row \(.*3 answered, 2 missing"),
        ("wrong_frame", Outcome.INVALID_OUTPUT, "a pose in the frame 'world'; expected 'map'"),
        ("nan", Outcome.INVALID_OUTPUT, "a pose that is not finite"),
    ],
)
def test_a_fault_is_named_and_nothing_is_left(host_of, write, rig, drive, fault, outcome, words):
    before = shared()
    host = host_of(write(parameters={"fault": fault, "after": 3}, patience=0.7, in_a_row=2))
    host.start()
    with pytest.raises(MethodFailedError, match=words) as caught:
        drive(host, rig)
    assert caught.value.outcome is outcome
    host.stop()
    assert leaves_nothing(before)


@pytest.mark.parametrize("victim", ["node", "bridge", "method"])
def test_what_is_killed_is_named_and_leaves_nothing(host_of, write, rig, drive, victim):
    before = shared()
    host = host_of(write())
    host.start()
    drive(host, rig, 1.0)
    (node,), (bridge,) = running(str(NODE)), running("bridge_process.py")
    os.kill({"node": node, "bridge": bridge, "method": host._process.pid}[victim], signal.SIGKILL)
    words = {"node": "the node was killed by SIGKILL", "bridge": "the bridge to ROS 2 has ended"}
    with pytest.raises(MethodFailedError, match=words.get(victim, "killed by SIGKILL")) as caught:
        drive(host, rig, 1.0, 1.0)
    assert caught.value.outcome is Outcome.CRASHED
    host.stop()
    assert leaves_nothing(before)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"answer": {"topic": "/pose", "type": "geometry_msgs/PoseStamped"}},
            "/pose is of the type geometry_msgs/PoseWithCovarianceStamped; expected geometry_msgs/PoseStamped",
        ),
        ({"topics": {"/scan": "/scans"}}, r"nobody reads /scans: the node reads .*/scan.* Did you mean '/scan'\?"),
        (
            {"environment": {"SAYS": "best_effort"}},
            "/pose does not come through between us and /echo: it is published best_effort and read reliable; say",
        ),
        (
            {"qos": {"/scan": {"reliability": "best_effort"}}},
            "/scan does not come through between us and /echo: it is published best_effort and read reliable; say",
        ),
        ({"parameters": {"rate": 100}}, 'exited with code 1 after printing ".*rate.*INTEGER.*DOUBLE'),
        ({"answer": {"transform": ["map", "odom"]}}, "has no type tf2_msgs/msg/TFMessage"),
        ({"reset": "/rest"}, r"nobody offers the service /rest. Did you mean '/reset'\?"),
        ({"setup": "/opt/ros/none/setup.bash"}, "setup '/opt/ros/none/setup.bash': there is no such file"),
    ],
)
def test_what_keeps_a_node_from_starting_is_said(write, rig, connect, changes, words):
    before = shared()
    file = load_node(write(start=6.0, **changes))
    with pytest.raises(InputError, match=words):
        connect(file, rig)
    assert leaves_nothing(before)


def test_qualities_of_the_file_make_ends_fit_and_an_answer_may_be_offered_late(host_of, write, rig, drive):
    quality = {"reliability": "best_effort"}
    environment = {"SAYS": "best_effort", "READS": "best_effort"}
    file = write(
        environment=environment, qos={"/scan": quality, "/pose": quality}, parameters={"late": True}, patience=2
    )
    host = host_of(file)
    host.start()
    assert [round(estimate.stamp / NANOSECONDS, 1) for estimate in drive(host, rig, 0.5)] == [0.1, 0.2, 0.3, 0.4]


def test_an_answer_that_nobody_ever_offers_is_told(host_of, write, rig, drive):
    host = host_of(write(answer={**POSE, "topic": "/poses"}, patience=0.7))
    host.start()
    with pytest.raises(MethodFailedError, match=r"nobody publishes /poses: .*/pose\. Did you mean '/pose'\?"):
        drive(host, rig)


def test_measured_latency_counts_the_work_of_the_node(host_of, write, rig, drive):
    host = host_of(write(parameters={"fault": "works"}, queue=100), LatencyModel(LatencyMode.MEASURED))
    host.start()
    drive(host, rig, 2.0)
    assert 20 * 0.020 <= host.compute_s < 20 * 0.2


def test_a_check_tells_what_may_be_wrong(write, rig):
    file = write(parameters={"ratte": 5.0, "odom_frame": "odm", "fault": "warns"})
    found = check_node(str(file), rig, lambda *_: {})
    assert found.passed
    assert (found.frames, found.poses) == (10, 10)
    assert "the node has no parameter ratte. Did you mean 'rate'?" in found.findings
    assert '/echo warns: "the frame base_linc does not exist"' in found.findings
    assert any("odom_frame names the frame 'odm'" in words for words in found.findings)
    assert any("nothing is said on /tf:" in words for words in found.findings)


def test_karto_as_a_node_gives_the_poses_of_karto_in_the_loop(host_of, write, rig, drive):
    loop = host_of("karto")
    loop.start()
    expected = drive(loop, rig, 6.0)
    kept = place_of("compiled", find_method("karto"))
    source = Path(__file__).parents[3] / "src"
    node = host_of(
        write(
            command=f"python3 {PEERS / 'karto_node.py'} 2",
            environment={"PYTHONPATH": str(source), "KARTO_COMPILED": str(kept)},
            needs={"reads": [str(source), str(kept), sys.prefix, str(PEERS)]},
            start=120.0,
        )
    )
    node.start()
    poses = drive(node, rig, 6.0)
    assert [e.stamp for e in poses] == [e.stamp for e in expected]
    assert len(poses) == 60
    for one, other in zip(poses, expected, strict=True):
        np.testing.assert_allclose(one.T_start_base, other.T_start_base, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(one.covariance, other.covariance)
