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
from taskslam.ros.ros2.domain import abandoned
from taskslam.slam.content import place_of
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.registry import find_method

PEERS = Path(__file__).parents[1] / "peers"
NODE = PEERS / "rclpy_node.py"


@pytest.fixture
def write(ros2, write_node, tmp_path):
    """Node files of `rclpy_node.py`, under our own interpreter; what they start is told by a variable."""

    def written(**changes):
        content = {"name": "echo", "ros": 2, "frames": None, "needs": {"reads": [str(PEERS)]}, **changes}
        content["environment"] = {"MARK": str(tmp_path), **content.get("environment", {})}
        return write_node(content.pop("command", f"python3 {NODE}"), **content)

    return written


@pytest.fixture
def running(tmp_path):
    """`running(program)`: processes that a node file of this test has started."""

    def is_one(process, program):
        try:
            marked = f"MARK={tmp_path}".encode() in (process / "environ").read_bytes()
            return marked and program.encode() in (process / "cmdline").read_bytes()
        except OSError:  # somebody else's, or it ended just now
            return False

    def found(program=""):
        return [int(process.name) for process in Path("/proc").glob("[0-9]*") if is_one(process, program)]

    return found


@pytest.fixture
def leaves_nothing(running, eventually):
    """Of its processes, and of what was new in shared memory; others may be at work there meanwhile."""
    before = abandoned()
    yield
    eventually(lambda: not running() and abandoned() <= before)


def log_of(host):
    return host._log.read_text()


@pytest.mark.usefixtures("leaves_nothing")
def test_two_at_once_answer_every_scan_with_the_odometry_of_its_stamp(host_of, write, rig, drive, running):
    """Two nodes at once, in domains of their own, and the same bytes; parameters come with their types."""
    hosts = [host_of(write(parameters={"whole": 7, "rate": 100.0}, reset="/reset")) for _ in range(2)]
    for host in hosts:
        host.start()
    assert len(running(NODE.name)) == 2
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


@pytest.mark.usefixtures("leaves_nothing")
@pytest.mark.parametrize(
    ("fault", "outcome", "words"),
    [
        ("dies", Outcome.CRASHED, 'the node was killed by SIGABRT after printing ".*the map has no cells'),
        ("hangs", Outcome.STALLED, r"the node has not answered 2 frames in a row \(.*3 answered, 2 missing"),
        ("silent", Outcome.STALLED, r"the node has not answered 2 frames in a row \(.*3 answered, 2 missing"),
        ("back", Outcome.STALLED, r"2 unmatched; the last answer of no frame was stamped -1\.000000 s"),
        (
            "wrong_frame",
            Outcome.INVALID_OUTPUT,
            "a pose in the frame 'world'; expected 'map', at the laser scan at 0.3",
        ),
        ("nan", Outcome.INVALID_OUTPUT, "a pose that is not finite"),
    ],
)
def test_a_fault_is_named_and_nothing_is_left(host_of, write, rig, drive, fault, outcome, words):
    host = host_of(write(parameters={"fault": fault, "after": 3}, patience=0.7, in_a_row=2))
    host.start()
    with pytest.raises(MethodFailedError, match=words) as caught:
        drive(host, rig)
    assert caught.value.outcome is outcome
    host.stop()


@pytest.mark.usefixtures("leaves_nothing")
@pytest.mark.parametrize("victim", ["node", "bridge"])
def test_what_is_killed_is_named_and_leaves_nothing(host_of, write, rig, drive, running, victim):
    host = host_of(write())
    host.start()
    drive(host, rig, 1.0)
    (node,), (bridge,) = running(NODE.name), running("bridge_process.py")
    os.kill({"node": node, "bridge": bridge}[victim], signal.SIGKILL)
    words = {"node": "the node was killed by SIGKILL", "bridge": "the bridge to ROS 2 has ended"}
    with pytest.raises(MethodFailedError, match=words[victim]) as caught:
        drive(host, rig, 1.0, 1.0)
    assert caught.value.outcome is Outcome.CRASHED
    host.stop()


@pytest.mark.usefixtures("leaves_nothing")
@pytest.mark.parametrize(
    ("changes", "words"),
    [
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
        (
            {"command": f"bash -c 'python3 {NODE} --ros-args -r __node:=other & exec python3 {NODE}'"},
            "/other and /some_name both publish /pose",
        ),
        ({"reset": "/rest"}, r"nobody offers the service /rest. Did you mean '/reset'\?"),
        ({"setup": "/dev/null"}, "no bridge to ROS 2: .*python3.*: No module named 'rclpy'"),
    ],
)
def test_what_keeps_a_node_from_starting_is_said(write, rig, connect, changes, words):
    file = load_node(write(start=15.0, **changes))
    with pytest.raises(InputError, match=words):
        connect(file, rig)


def test_qualities_of_the_file_make_ends_fit_and_an_answer_may_be_late(host_of, write, rig, drive, tmp_path):
    """By a setup script that leaves an interpreter which has the wheels."""
    setup = tmp_path / "setup.bash"
    setup.write_text(f"PATH={Path(sys.executable).parent}:$PATH\n")
    quality = {"reliability": "best_effort"}
    environment = {"SAYS": "best_effort", "READS": "best_effort"}
    file = write(
        environment=environment, qos={"/scan": quality, "/pose": quality}, parameters={"late": True}, patience=1,
        setup=str(setup),
    )  # fmt: skip
    host = host_of(file)
    host.start()
    assert [round(estimate.stamp / NANOSECONDS, 1) for estimate in drive(host, rig, 0.5)] == [0.1, 0.2, 0.3, 0.4]


def test_a_check_tells_what_may_be_wrong(write, rig):
    file = write(parameters={"ratte": 5.0, "odom_frame": "odm", "fault": "warns"})
    found = check_node(str(file), rig, lambda *_: {})
    assert found.passed
    assert (found.frames, found.poses) == (10, 10)
    assert "the node has no parameter ratte. Did you mean 'rate'?" in found.findings
    assert '/echo warns: "the frame base_linc does not exist"' in found.findings
    assert any("odom_frame names the frame 'odm'" in words for words in found.findings)
    assert any("nothing is said on /tf:" in words for words in found.findings)


def test_with_the_types_that_wheels_lack_transforms_are_told_too(write, rig, ros2_messages):
    found = check_node(str(write(setup=ros2_messages)), rig, lambda *_: {})
    assert (found.passed, found.poses) == (True, 10)
    assert not any("nothing is said on /tf" in words for words in found.findings)


def test_karto_as_a_node_gives_the_poses_of_karto_in_the_loop(host_of, write, rig, drive):
    loop = host_of("karto")
    loop.start()
    expected = drive(loop, rig, 4.0)
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
    poses = drive(node, rig, 4.0)
    assert [e.stamp for e in poses] == [e.stamp for e in expected]
    assert len(poses) == 40
    for one, other in zip(poses, expected, strict=True):
        np.testing.assert_allclose(one.T_start_base, other.T_start_base, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(one.covariance, other.covariance)
