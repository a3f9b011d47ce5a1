import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import DiskFullError, InputError, MethodUnavailableError, UnknownMethodError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, TruePose, WheelOdometry
from taskslam.outcomes import Outcome
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.host import Limits, MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel

MILLISECOND = 1_000_000


def drive(host, measurements):
    """Feed and collect as the closed loop does; returns (ms when delivered, ms of the stamp)."""
    delivered = []
    for measurement in measurements:
        host.feed(measurement)
        now = measurement.stamp
        delivered += [(now // MILLISECOND, e.stamp // MILLISECOND) for e in host.collect(now)]
    return delivered


def test_wheel_odometry_reports_the_pose_since_its_first_message(host_of):
    host = host_of("wheel_odometry")
    host.start()
    first, second = SE2(1.0, 2.0, 0.5), SE2(1.5, 2.2, 0.9)
    host.feed(WheelOdometry(0, first, 0.0, 0.0))
    host.feed(WheelOdometry(20 * MILLISECOND, second, 0.0, 0.0))
    poses = [e.T_start_base for e in host.collect(20 * MILLISECOND)]
    np.testing.assert_array_equal(poses[0], np.eye(4))
    np.testing.assert_allclose(poses[1], (first.inverse() @ second).matrix(), atol=1e-15)


def test_ground_truth_repeats_the_true_pose(host_of):
    host = host_of("ground_truth")
    host.start()
    host.feed(TruePose(5, SE2(0.1, 0.2, 0.3)))
    (estimate,) = host.collect(5)
    np.testing.assert_array_equal(estimate.T_start_base, SE2(0.1, 0.2, 0.3).matrix())


def test_a_launched_method_starts_beside_what_else_is_made(host_of, tmp_path):
    host = host_of("SaysThatItStarts")
    with host.launched():
        deadline = time.monotonic() + 60.0
        while "started" not in (tmp_path / "method0.log").read_text():
            assert time.monotonic() < deadline, "it did not start before it was waited for"
            time.sleep(0.01)
        assert not host.started
        host.start()
        assert host.started
    with pytest.raises(ProcessLookupError):
        os.kill(host._process.pid, 0)


def test_a_launched_method_ends_with_whoever_launched_it(host_of):
    host, pids = host_of("Guest"), []

    def fail():
        with host.launched():
            pids.append(host._process.pid)
            os.kill(pids[0], 0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)


def test_an_estimate_arrives_one_latency_after_its_frame(host_of, still_robot):
    host = host_of("Guest")
    host.start()
    assert drive(host, still_robot(300)) == [(60, 0), (160, 100), (260, 200)]  # 50 ms, seen at the next odometry
    assert [e.stamp for e in host.collect(350 * MILLISECOND)] == [300 * MILLISECOND]
    assert (host.frames, host.dropped_frames) == (4, 0)


def test_zero_latency_delivers_at_once(host_of, still_robot):
    host = host_of("Guest", latency=LatencyModel(LatencyMode.ZERO))
    host.start()
    assert drive(host, still_robot(200)) == [(0, 0), (100, 100), (200, 200)]


def test_measured_latency_is_compute_time_scaled(host_of, still_robot):
    host = host_of("Guest", latency=LatencyModel(LatencyMode.MEASURED, cpu_scale=1e3))
    host.start()
    delivered = drive(host, still_robot(5000))
    assert delivered
    assert all(now > stamp for now, stamp in delivered)
    assert host.compute_s > 0


@pytest.mark.parametrize(
    ("guest", "outcome", "words"),
    [
        ("Segfault", Outcome.CRASHED, "killed by SIGSEGV"),
        (
            "AbortsWithAReason",
            Outcome.CRASHED,
            'SIGABRT after printing "omega is not finite" at',
        ),
        ("ReadsNull", Outcome.CRASHED, "killed by SIGSEGV"),
        ("Exits", Outcome.CRASHED, "exited with code 3"),
        ("ExitsPolitely", Outcome.CRASHED, "exited with code 4"),
        ("LeavesProcessBehind", Outcome.CRASHED, "exited with code 5"),
        ("Raises", Outcome.CRASHED, "ValueError: scan does not match"),
        ("Hangs", Outcome.STALLED, "gave no answer to the laser scan at 0.300 s within 1 s"),
        ("HangsUnkillable", Outcome.STALLED, "within 1 s"),
        ("PrintsWithoutEnd", Outcome.STALLED, "within 1 s"),
        ("ClosesEverything", Outcome.CRASHED, "closed its pipe"),
        ("NotFinite", Outcome.INVALID_OUTPUT, "not finite"),
        ("NotRigid", Outcome.INVALID_OUTPUT, "not a rigid transform"),
        ("WrongShape", Outcome.INVALID_OUTPUT, "shape (3, 3)"),
        ("HugeReply", Outcome.INVALID_OUTPUT, "shape (3000, 3000)"),
        ("WrongType", Outcome.INVALID_OUTPUT, "str; expected PoseEstimate"),
        ("BackInTime", Outcome.INVALID_OUTPUT, "back in time"),
        ("Prophet", Outcome.INVALID_OUTPUT, "of the future"),
        ("BadCovariance", Outcome.INVALID_OUTPUT, "covariance"),
        ("ScribblesIntoPipes", Outcome.INVALID_OUTPUT, "wrote into the reply pipe"),
    ],
)
def test_a_misbehaving_guest_is_named_when_its_answer_is_due(host_of, still_robot, guest, outcome, words):
    began = time.monotonic()
    host = host_of(guest)
    host.start()
    assert drive(host, still_robot(340)) == [(60, 0), (160, 100), (260, 200)]
    with pytest.raises(MethodFailedError) as caught:
        host.collect(350 * MILLISECOND)
    assert caught.value.outcome is outcome
    assert words in caught.value.detail
    with pytest.raises(MethodFailedError):  # and it stays failed
        host.collect(400 * MILLISECOND)
    host.stop()
    assert time.monotonic() - began < 20  # nothing waits for it without end


def test_memory_beyond_the_limit_ends_the_method(host_of, still_robot):
    host = host_of("EatsMemory", memory_bytes=300 << 20, frame_timeout_s=10)
    host.start()
    with pytest.raises(MethodFailedError, match="used more than 315 MB of memory") as caught:
        drive(host, still_robot(400))
    assert caught.value.outcome is Outcome.CRASHED
    assert 300 << 20 < host.peak_memory < 2 << 30


def test_the_peak_of_a_process_outlives_what_it_let_go_and_is_not_its_parents():
    script = (
        "from taskslam.processes.memory import own_peak_memory as peak; before = peak();"
        "ballast = b'x' * (200 << 20); del ballast; print(before, peak())"
    )
    parents = b"x" * (400 << 20)
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    before, after = map(int, said.split())
    assert before < len(parents)
    assert 150 << 20 < after - before < 250 << 20


def test_the_log_keeps_what_the_method_printed_up_to_its_bound(host_of, still_robot, tmp_path):
    host = host_of("PrintsMuchButWorks", log_bytes=10_000)
    host.start()
    drive(host, still_robot(500))
    host.stop()
    log = (tmp_path / "method0.log").read_bytes()
    assert log.startswith(b"x" * 10_000 + b"\n[taskslam]")
    assert len(log) < 10_200


def test_a_traceback_is_in_the_log(host_of, still_robot, tmp_path):
    host = host_of("Raises")
    host.start()
    with pytest.raises(MethodFailedError):
        drive(host, still_robot(400))
    assert "in misbehave" in (tmp_path / "method0.log").read_text()


def test_a_method_that_does_not_stop_is_killed(host_of):
    host = host_of("NeverStops", stop_timeout_s=0.5)
    host.start()
    began = time.monotonic()
    host.stop()
    host.stop()
    assert time.monotonic() - began < 20


def test_a_method_that_stops_slowly_as_on_a_busy_machine_has_not_failed(host_of):
    host = host_of("StopsSlowly")
    host.start()
    host.stop()
    assert host.stop_failure == ""


@pytest.mark.parametrize(
    ("guest", "options", "error", "words"),
    [
        ("FailsToStart", {}, MethodFailedError, "no licence file"),
        ("HangsAtStart", {}, MethodFailedError, "no answer to the request to start"),
        ("NeedsAbsentPackage", {}, MethodUnavailableError, "a_package_that_nobody_has"),
        ("TakesOptions", {"resolutoin": 1}, InputError, "Did you mean 'resolution'?"),
        ("TakesOptions", {"resolution": -1}, InputError, "resolution must be positive"),
        ("WantsTheTruth", {}, InputError, "only methods of kind reference"),
        ("Timeless", {}, InputError, "latency nan s"),
        ("NotAMethod", {}, InputError, "not a subclass"),
        ("Unfinished", {}, InputError, "card"),
        ("Absent", {}, InputError, "has no class 'Absent'"),
        ("kartoo", {}, UnknownMethodError, "Did you mean 'karto'?"),
    ],
)
def test_what_cannot_start_says_why(host_of, guest, options, error, words):
    host = host_of(guest, options, start_timeout_s=1.5 if guest == "HangsAtStart" else 60)
    with pytest.raises(error) as caught:
        host.start()
    assert words in str(caught.value)


def test_a_method_needs_the_sensors_that_it_asks_for(guests, rig, tmp_path):
    blind = rig.model_copy(update={"stereo": None})
    with pytest.raises(InputError, match="needs stereo_images, which the robot has not"):
        MethodHost("misbehaving:WantsCameras", {}, blind, tmp_path / "log").start()


def test_options_must_be_plain_values(rig, tmp_path):
    with pytest.raises(InputError, match="option value"):
        MethodHost("karto", {"callback": print}, rig, tmp_path / "log")


def test_true_poses_are_withheld_from_all_but_references(host_of):
    host = host_of("wheel_odometry")
    host.start()
    host.feed(TruePose(0, SE2()))
    assert host.collect(0) == []


def test_maps_go_out_and_in_through_the_host(host_of, tmp_path):
    scan = LaserScan(0, np.ones(8, dtype=np.float32), 0.0, 0.1, 0.1, 10.0)
    first = host_of("Mapper")
    first.start()
    for _ in range(3):
        first.feed(scan)
        first.collect(0)
    first.save_map(tmp_path / "map")
    assert (tmp_path / "map").read_text() == "3"
    second = host_of("Mapper")
    second.start()
    second.load_map(tmp_path / "map")
    second.feed(scan)
    second.save_map(tmp_path / "map")
    assert (tmp_path / "map").read_text() == "4"
    assert not list(tmp_path.glob("*.part"))


def test_maps_of_methods_without_maps_are_refused(host_of, tmp_path):
    host = host_of("wheel_odometry")
    host.start()
    with pytest.raises(InputError, match="cannot save maps"):
        host.save_map(tmp_path / "map")


def test_a_map_that_was_not_written_is_invalid_output(host_of, tmp_path):
    host = host_of("SavesNothing")
    host.start()
    with pytest.raises(MethodFailedError, match="wrote no file"):
        host.save_map(tmp_path / "map")


def test_a_map_that_the_method_refuses_is_its_failure(host_of, tmp_path):
    host = host_of("PickyMapper")
    host.start()
    (tmp_path / "map").write_text("other")
    with pytest.raises(MethodFailedError, match="not a map"):
        host.load_map(tmp_path / "map")
    with pytest.raises(MethodFailedError):
        host.collect(0)


def test_a_map_that_does_not_exist_is_an_input_error(host_of, tmp_path):
    host = host_of("Mapper")
    host.start()
    with pytest.raises(InputError, match="cannot read the map"):
        host.load_map(tmp_path / "absent")


def test_a_log_that_cannot_be_written_is_infrastructure(rig, tmp_path):
    host = MethodHost("wheel_odometry", {}, rig, tmp_path / "absent" / "method.log")
    with pytest.raises(DiskFullError, match="cannot write the method's log"):
        host.start()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_under_the_log_is_infrastructure(guests, rig, still_robot):
    host = MethodHost("misbehaving:PrintsMuchButWorks", {}, rig, Path("/dev/full"), None, Limits())
    host.start()
    with pytest.raises(DiskFullError, match="No space left"):
        drive(host, still_robot(10_000))
    with pytest.raises(DiskFullError, match="No space left"):
        host.stop()


def test_stopping_leaves_no_scratch_folder_and_no_process(host_of, still_robot):
    host = host_of("Guest")
    host.start()
    scratch, pid = host._process.files.folder, host._process.pid
    drive(host, still_robot(100))
    assert scratch.is_dir()
    host.stop()
    assert not scratch.exists()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_method_dies_with_its_host(guests, tmp_path):
    """Also when the host is killed outright and can clean up nothing."""
    script = (
        "import sys, time; from pathlib import Path; from taskslam.robot import load_robot;"
        "from taskslam.slam.guest.host import MethodHost;"
        f"host = MethodHost('wheel_odometry', {{}}, load_robot('turtlebot2').rig, Path({str(tmp_path / 'log')!r}));"
        "host.start(); print(host._process.pid, flush=True); time.sleep(60)"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=environment) as parent:
        child = int(parent.stdout.readline())
        os.kill(child, 0)
        parent.kill()
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline and is_running(child):
        time.sleep(0.05)
    assert not is_running(child)


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def test_measurements_out_of_order_are_the_callers_error(host_of):
    host = host_of("wheel_odometry")
    host.start()
    host.feed(WheelOdometry(10, SE2(), 0.0, 0.0))
    with pytest.raises(ValueError, match="stamp order"):
        host.feed(WheelOdometry(9, SE2(), 0.0, 0.0))
