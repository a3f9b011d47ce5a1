"""A ROS node in the loop: Debian's roscpp under our master, in lockstep, behind the wall; and what goes wrong."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.outcomes import Outcome
from taskslam.ros.check import check_node
from taskslam.ros.node_file import load_node
from taskslam.slam.cards import card_of
from taskslam.slam.content import place_of
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.latency import LatencyMode, LatencyModel
from taskslam.slam.registry import find_method

PEERS = Path(__file__).parent / "peers"


def running(binary: Path) -> list[int]:
    """Processes of a program, also ones that are stopped."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdecimal() and (process / "exe").readlink() == binary:
                found.append(int(process.name))
        except OSError:
            continue
    return found


def log_of(host):
    return host._log.read_text()


def test_every_scan_is_answered_with_the_odometry_of_its_own_stamp(host_of, write_node, rate_node, rig, drive):
    """Its worker sleeps in simulated time, and answers once it has the transform and the clock has come there."""
    host = host_of(write_node(rate_node, parameters={"whole": 7, "rate": 100.0}, reset="/reset"))
    host.start()
    estimates = drive(host, rig, 6.0)
    host.stop()
    wheels = host_of("wheel_odometry")
    wheels.start()
    expected = drive(wheels, rig, 6.0)
    at = {estimate.stamp: estimate.T_start_base for estimate in expected}
    assert [estimate.stamp for estimate in estimates] == [round(k * 0.1 * NANOSECONDS) for k in range(60)]
    for estimate in estimates:
        np.testing.assert_array_equal(estimate.T_start_base, at[estimate.stamp])
    log = log_of(host)
    assert "whole 7 rate 100" in log  # parameters arrive with their types
    assert "resets 1" in log
    assert "[ros] 60 frames, 60 answered, 0 missing, 0 late, 0 unmatched" in log
    assert running(rate_node) == []


def test_a_clock_of_another_beat_changes_no_pose(host_of, write_node, rate_node, rig, drive):
    poses = []
    for tick in (1.0, 7.0):
        host = host_of(write_node(rate_node, tick_ms=tick, parameters={"rate": 40.0}))
        host.start()
        poses.append([(e.stamp, e.T_start_base.tobytes()) for e in drive(host, rig)])
    assert poses[0] == poses[1]
    assert len(poses[0]) == 30


def test_two_runs_at_once_do_not_meet_nor_ask_the_users_master(host_of, write_node, rate_node, rig, monkeypatch, drive):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:11311")
    hosts = [host_of(write_node(rate_node)) for _ in range(2)]
    for host in hosts:
        host.start()
    assert len(running(rate_node)) == 2
    one = drive(hosts[0], rig, 2.0, each=lambda measurement: hosts[1].feed(measurement))
    other = hosts[1].collect(2 * NANOSECONDS)
    assert [e.T_start_base.tobytes() for e in one] == [e.T_start_base.tobytes() for e in other]
    assert len(one) == 20


def test_measured_latency_counts_the_work_of_the_node(host_of, write_node, rate_node, rig, drive):
    host = host_of(
        write_node(rate_node, parameters={"fault": "works", "after": 0}, queue=100), LatencyModel(LatencyMode.MEASURED)
    )
    host.start()
    drive(host, rig, 2.0)
    assert 20 * 0.020 <= host.compute_s < 20 * 0.2


def test_a_sparse_node_that_says_nothing_is_not_waited_for_long(host_of, write_node, rate_node, rig, drive):
    parameters = {"fault": "silent", "after": 5}
    host = host_of(write_node(rate_node, parameters=parameters, answers="sparse", patience=60.0, in_a_row=2))
    host.start()
    began = time.monotonic()
    assert len(drive(host, rig, 2.0)) == 5
    assert time.monotonic() - began < 55.0
    host.stop()
    assert "[ros] 20 frames, 5 answered, 15 missing" in log_of(host)


@pytest.mark.parametrize(
    ("fault", "outcome", "words"),
    [
        ("dies", Outcome.CRASHED, 'the node was killed by SIGABRT after printing ".*the map has no cells"'),
        ("hangs", Outcome.STALLED, r"the node has not answered 2 frames in a row \(.*3 answered"),
        ("silent", Outcome.STALLED, r"the node has not answered 2 frames in a row \(.*3 answered, 2 missing"),
        (
            "wrong_frame",
            Outcome.INVALID_OUTPUT,
            "a pose in the frame 'world'; expected 'map', at the laser scan at 0.300 s",
        ),
        ("nan", Outcome.INVALID_OUTPUT, "a pose that is not finite"),
        ("back", Outcome.STALLED, r"2 unmatched; the last answer of no frame was stamped -0\.050000 s"),
        ("ahead", Outcome.INVALID_OUTPUT, r"a pose stamped 0\.05 s after the newest frame"),
    ],
)
def test_a_fault_is_named_and_nothing_is_left_running(
    host_of, write_node, rate_node, rig, fault, outcome, words, drive
):
    host = host_of(write_node(rate_node, parameters={"fault": fault, "after": 3}, patience=0.7, in_a_row=2))
    host.start()
    with pytest.raises(MethodFailedError, match=words) as caught:
        drive(host, rig)
    assert caught.value.outcome is outcome
    assert running(rate_node) == []


def test_a_node_that_is_killed_is_named_and_so_is_a_master(host_of, write_node, rate_node, rig, drive):
    for victim, words in (("node", "the node was killed by SIGKILL"), ("master", "yaml killed by SIGKILL")):
        host = host_of(write_node(rate_node))
        host.start()
        drive(host, rig, 1.0)
        (process,) = running(rate_node)
        os.kill(process if victim == "node" else host._process.pid, signal.SIGKILL)
        with pytest.raises(MethodFailedError, match=words) as caught:
            drive(host, rig, 1.0, 1.0)
        assert caught.value.outcome is Outcome.CRASHED
        host.stop()
        assert running(rate_node) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"answer": {"topic": "/poses", "type": "geometry_msgs/PoseStamped"}},
            r"nobody publishes /poses: the node publishes .*/pose.* Did you mean '/pose'\?",
        ),
        (
            {"answer": {"topic": "/pose", "type": "geometry_msgs/PoseStamped"}},
            "/pose is of the type geometry_msgs/PoseWithCovarianceStamped; expected geometry_msgs/PoseStamped",
        ),
        ({"topics": {"/scan": "/scans"}}, r"nobody reads /scans: the node reads .*/scan.* Did you mean '/scan'\?"),
        ({"remaps": {"/scan": "/front/scan"}}, "nobody reads /scan: the node reads /front/scan"),
        ({"answer": {"transform": ["map", "odom"]}}, "nobody publishes /tf: the node publishes .*/pose"),
        ({"command": "bash -c 'NODE __name:=other & exec NODE'"}, "/other and /rate_node both publish /pose"),
        ({"command": "/usr/bin/false"}, "the node exited with code 1 without a word, before it was connected"),
        ({"command": "no_such_node"}, "the node's command 'no_such_node': there is no such program"),
        ({"setup": "/opt/ros/none/setup.bash"}, "the node's setup '/opt/ros/none/setup.bash': there is no such file"),
        ({"frames": {"lazer": "base_laser"}}, r"'lazer' is none of this robot's.* Did you mean 'laser'\?"),
        ({"reset": "/begin"}, "reset by the service /begin: .*no provider of the service /begin"),
    ],
)
def test_what_keeps_a_node_from_starting_is_said(write_node, rate_node, rig, changes, words, connect):
    command = changes.get("command", "NODE").replace("NODE", str(rate_node))
    file = load_node(write_node(rate_node, **{"start": 1.5, **changes, "command": command}))
    with pytest.raises(InputError, match=words):
        connect(file, rig)
    assert running(rate_node) == []


def test_an_option_that_is_no_parameter_is_refused(host_of, write_node, rate_node):
    host = host_of(write_node(rate_node, parameters={"rate": 100.0}), options={"rat": 3.0})
    with pytest.raises(InputError, match=r"rate_node has no option 'rat'.*Did you mean 'rate'\?"):
        host.start()


def test_what_a_node_says_of_itself_is_noted(host_of, write_node, rate_node, rig, drive):
    parameters = {"fault": "warns", "after": 0, "ratte": 5.0, "odom_frame": "odm"}
    host = host_of(write_node(rate_node, parameters=parameters))
    host.start()
    drive(host, rig, 1.0)
    host.stop()
    log = log_of(host)
    assert "[ros] no node asked for the parameter /rate_node/ratte. Did you mean '/rate_node/rate'?" in log
    assert "[ros] the parameter odom_frame names the frame 'odm'; it is told of" in log
    assert "Did you mean 'odom'?" in log
    assert '[ros] /rate_node warns: "the frame base_linc does not exist"' in log
    assert "[ros] nobody reads /odom." in log


def test_a_setup_script_is_sourced(host_of, write_node, rate_node, rig, tmp_path, drive):
    (tmp_path / "prefix").mkdir()
    (tmp_path / "prefix" / "setup.bash").write_text(f"export PATH={rate_node.parent}:$PATH ROS_MASTER_URI=http://x\n")
    needs = {"reads": [str(rate_node.parent)]}
    host = host_of(write_node("rate_node", setup=str(tmp_path / "prefix" / "setup.bash"), needs=needs))
    host.start()
    assert len(drive(host, rig, 1.0)) == 10


def test_an_answer_that_is_offered_with_the_first_frame_is_heard(host_of, write_node, rate_node, rig, drive):
    host = host_of(write_node(rate_node, parameters={"late": True}, patience=1.0))
    host.start()
    assert [round(e.stamp / NANOSECONDS, 1) for e in drive(host, rig, 0.5)] == [0.1, 0.2, 0.3, 0.4]


def test_an_answer_that_nobody_ever_offers_is_told(host_of, write_node, rate_node, rig, drive):
    answer = {"topic": "/poses", "type": "geometry_msgs/PoseWithCovarianceStamped"}
    host = host_of(write_node(rate_node, answer=answer, patience=0.7))
    host.start()
    with pytest.raises(MethodFailedError, match=r"nobody publishes /poses: .*/pose\. Did you mean '/pose'\?") as caught:
        drive(host, rig)
    assert caught.value.outcome is Outcome.STALLED


def test_the_card_of_a_node_file_is_learned_behind_the_wall(write_node, rate_node):
    file = write_node(rate_node)
    assert card_of(f"ros:{file}") == load_node(file).card()
    with pytest.raises(InputError, match="node 'none' is neither shipped"):
        card_of("ros:none")


def test_karto_as_a_node_gives_the_poses_of_karto_in_the_loop(host_of, write_node, rig, drive):
    loop = host_of("karto")
    loop.start()
    expected = drive(loop, rig, 8.0)
    kept = place_of("compiled", find_method("karto"))
    source = Path(__file__).parents[2] / "src"
    node = host_of(
        write_node(
            f"{sys.executable} {PEERS / 'karto_node.py'} 1",
            name="karto_node",
            frames=None,
            environment={"PYTHONPATH": str(source), "KARTO_COMPILED": str(kept)},
            needs={"reads": [str(source), str(kept), sys.prefix, str(PEERS)]},
            start=120.0,
        )
    )
    node.start()
    poses = drive(node, rig, 8.0)
    assert [e.stamp for e in poses] == [e.stamp for e in expected]
    assert len(poses) == 80
    for one, other in zip(poses, expected, strict=True):
        np.testing.assert_allclose(one.T_start_base, other.T_start_base, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(one.covariance, other.covariance)
    assert SE2.from_matrix(poses[-1].T_start_base).distance_to(SE2()) > 1.0


def test_a_check_of_a_node_file_tells_what_may_be_wrong(write_node, rate_node, rig):
    spelled_wrong = write_node(rate_node, parameters={"ratte": 5.0, "/common/topics": 7}, latency=0.05)
    found = check_node(str(spelled_wrong), rig, lambda *_: {})
    assert found.passed
    assert (found.frames, found.poses, len(found.wall_ms)) == (10, 10, 10)
    assert "no node asked for the parameter /rate_node/ratte. Did you mean '/rate_node/rate'?" in found.findings
    assert any(words.startswith("no node asked for the parameter /common/topics") for words in found.findings)
    assert not any("/rate_node/heard" in words for words in found.findings)  # the node's own


def test_a_check_goes_on_after_the_frames_that_need_no_answer(write_node, rate_node, rig):
    late = write_node(rate_node, parameters={"fault": "begins_late", "after": 4}, silent_start=0.4)
    found = check_node(str(late), rig, lambda *_: {})
    assert (found.frames, found.poses, found.passed) == (14, 10, True)
    assert not any("had no answer" in words for words in found.findings)


def test_a_check_of_a_node_that_dies_quotes_it(write_node, rate_node, rig):
    found = check_node(str(write_node(rate_node, parameters={"fault": "dies"})), rig, lambda *_: {})
    assert not found.passed
    assert "the map has no cells" in found.failure
