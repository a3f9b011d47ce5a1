"""`karto` as a method: what it answers to which measurement, and that it answers the same everywhere."""

import dataclasses
import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, WheelOdometry
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.base import Status
from taskslam.slam.methods.karto import Karto

DRIVES = Path(__file__).parents[1] / "karto" / "drives.py"
RIG = load_robot("turtlebot2").rig

_REPLAY = """
import hashlib, importlib.util, sys
from taskslam.measurements import LaserScan
spec = importlib.util.spec_from_file_location("karto_drives", sys.argv[1])
drives = importlib.util.module_from_spec(spec)
sys.modules["karto_drives"] = drives
spec.loader.exec_module(drives)
from taskslam.slam.methods.karto import Karto
import numpy as np
walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4))
tour = np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5), (1.5, 5.5), (1.5, 1.5), (5.0, 1.5)])
drive = drives.drive(walls, tour, speed=0.5, bias=0.005)
method = Karto()
method.start(drive.robot.rig)
digest = hashlib.sha256()
for measurement in drive.measurements:
    estimate = method.feed(measurement)
    if estimate is not None:
        digest.update(estimate.T_start_base.tobytes())
        digest.update(estimate.status.value.encode())
        if estimate.covariance is not None:
            digest.update(estimate.covariance.tobytes())
print(digest.hexdigest(), method.map_summary().loops_closed)
"""


@pytest.fixture(scope="module")
def drive(drives):
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4))
    return drives.drive(walls, np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 4.0)]), speed=0.5)


@pytest.fixture
def karto() -> Karto:
    method = Karto()
    method.start(RIG)
    return method


def test_a_robot_without_lidar_is_refused() -> None:
    with pytest.raises(InputError, match="karto needs a 2D LiDAR"):
        Karto().start(SensorRig(odometry=RIG.odometry))


def test_feeding_before_start_is_refused(drive) -> None:
    with pytest.raises(InputError, match="call start"):
        Karto().feed(drive.scans[0])


def test_loading_before_start_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="call start"):
        Karto().load_map(tmp_path / "map.npz")


def test_every_scan_is_answered_and_odometry_is_not(karto, drive) -> None:
    for measurement in drive.measurements[:300]:
        estimate = karto.feed(measurement)
        assert (estimate is not None) == isinstance(measurement, LaserScan)
        if estimate is not None:
            assert estimate.stamp == measurement.stamp
            assert estimate.covariance is not None
            assert np.all(np.linalg.eigvalsh(estimate.covariance) > 0)


def test_the_first_pose_is_the_origin_wherever_odometry_stands(karto, drive) -> None:
    assert karto.feed(drive.measurements[0]) is None
    estimate = karto.feed(drive.scans[0])
    assert estimate is not None
    assert estimate.T_start_base == pytest.approx(np.eye(4))
    assert estimate.status is Status.TRACKING


def test_a_scan_before_any_odometry_is_starting(karto, drive) -> None:
    estimate = karto.feed(drive.scans[0])
    assert estimate is not None
    assert estimate.status is Status.STARTING
    assert estimate.T_start_base == pytest.approx(np.eye(4))


@pytest.mark.parametrize("value", [np.inf, np.nan, 0.0, -1.0])
def test_empty_scans_ride_on_odometry_and_tracking_returns(karto, drives, drive, value) -> None:
    scans = 0
    measurements = []
    for m in drive.measurements:
        if isinstance(m, LaserScan):
            scans += 1
            if 60 <= scans < 90:
                m = dataclasses.replace(m, ranges=np.full_like(m.ranges, value))
        measurements.append(m)
    done = drives.follow(karto, drives.Drive(drive.robot, measurements, drive.truth))
    assert set(done.statuses[59:89]) == {"lost"}
    assert set(done.statuses[89:]) == {"tracking"}
    moved = np.hypot(*(done.truth[88] - done.truth[59])[:2])
    assert moved > 1.0
    assert done.errors.max() < 0.03


def test_a_run_that_begins_in_the_dark_starts_where_it_stood(karto, drives, drive) -> None:
    scans = 0
    measurements = []
    for m in drive.measurements:
        if isinstance(m, LaserScan):
            scans += 1
            if scans <= 40:
                m = dataclasses.replace(m, ranges=np.full_like(m.ranges, np.inf))
        measurements.append(m)
    done = drives.follow(karto, drives.Drive(drive.robot, measurements, drive.truth))
    assert set(done.statuses[:40]) == {"starting"}
    assert set(done.statuses[40:]) == {"tracking"}
    assert done.errors.max() < 0.03


def test_odometry_that_is_not_finite_is_ignored(karto, drive) -> None:
    for measurement in drive.measurements[:200]:
        if isinstance(measurement, WheelOdometry):
            karto.feed(WheelOdometry(measurement.stamp + 1, SE2(np.nan, 0, 0), 0.0, 0.0))
        estimate = karto.feed(measurement)
        assert estimate is None or np.isfinite(estimate.T_start_base).all()


def test_starting_again_forgets_everything(karto, drives, drive) -> None:
    first = drives.follow(karto, drive).estimates
    karto.start(RIG)
    assert karto.map_summary().keyframes == 0
    assert drives.follow(karto, drive).estimates.tobytes() == first.tobytes()


def test_the_same_bytes_whatever_the_threads_and_the_hash_seed() -> None:
    found = set()
    for threads, seed in (("1", "0"), ("2", "4242")):
        counts = dict.fromkeys(
            ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "TBB_NUM_THREADS"),
            threads,
        )
        done = subprocess.run(
            [sys.executable, "-c", _REPLAY, str(DRIVES)],
            env={**os.environ, **counts, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        digest, loops = done.stdout.split()
        assert int(loops) >= 1
        assert len(digest) == hashlib.sha256().digest_size * 2
        found.add(digest)
    assert len(found) == 1


def test_importing_the_method_imports_no_optimiser() -> None:
    code = "import sys, taskslam.slam.methods.karto; print('gtsam' in sys.modules, 'yag_slam' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
