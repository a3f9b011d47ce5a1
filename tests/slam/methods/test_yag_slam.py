"""The adapter of yag-slam, and `karto` measured against it on the same drive."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError, RecordError
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.methods.karto import Karto
from taskslam.slam.methods.yag_slam import YagSlam

RIG = load_robot("turtlebot2").rig

try:  # a dependency of yag-slam warns about its own syntax when first compiled
    _INSTALLED = importlib.util.find_spec("yag_slam") is not None and importlib.util.find_spec("cv2") is not None
except ImportError:
    _INSTALLED = False
needs_yag = pytest.mark.skipif(not _INSTALLED, reason="yag-slam is not installed (extra yag-slam, CPython 3.11 only)")


@pytest.fixture(scope="module")
def recorded(drives):
    """A round in the hall, and a second one with other noise."""
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4) + drives.box(0, 5.2, 0.5, 5.9))
    tour = np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5), (1.5, 5.5), (1.5, 1.5)])
    return drives.drive(walls, tour, speed=0.5), drives.drive(walls, tour, speed=0.5, seed=5)


def started(method):
    method.start(RIG)
    return method


def test_importing_the_adapter_imports_no_gpl_package() -> None:
    code = "import sys, taskslam.slam.methods.yag_slam; print([m for m in sys.modules if 'yag' in m or 'karto_s' in m])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['taskslam.slam.methods.yag_slam']"


def test_its_absence_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yag_slam.graph_slam", None)
    monkeypatch.setitem(sys.modules, "yag_slam", None)
    with pytest.raises(MethodUnavailableError, match=r"pip install '?\"?taskslam\[yag-slam\]"):
        YagSlam().start(RIG)


def test_a_robot_without_lidar_is_refused() -> None:
    with pytest.raises(InputError, match="yag_slam needs a 2D LiDAR"):
        YagSlam().start(SensorRig(odometry=RIG.odometry))


def test_an_unknown_option_is_named() -> None:
    with pytest.raises(InputError, match="Did you mean 'max_laser_range'"):
        YagSlam(max_lazer_range=3.0)


def test_it_keeps_its_own_name() -> None:
    assert YagSlam.card.name == "yag_slam"
    assert "slam_toolbox" not in YagSlam.card.summary
    assert YagSlam.card.licence.startswith("GPL-3.0")


@needs_yag
def test_karto_is_at_least_as_accurate_and_five_times_as_fast(drives, recorded) -> None:
    """Per scan that a method matched: karto matches every scan, yag-slam its keyframes."""
    drive = recorded[0]
    ours, theirs = started(Karto()), started(YagSlam())
    done = drives.follow(ours, drive)
    seconds, keyframes, estimates = 0.0, 0, drives.follow(theirs, drive)
    keyframes = theirs.keyframes
    seconds = estimates.seconds.sum() / keyframes
    assert estimates.errors.mean() < 0.15  # the reference itself works
    assert keyframes > 60
    assert done.errors.mean() <= estimates.errors.mean()
    assert done.errors.max() <= estimates.errors.max()
    assert seconds > 5 * done.seconds.mean()


@needs_yag
def test_a_second_round_on_a_loaded_map(drives, recorded, tmp_path) -> None:
    method = started(YagSlam())
    drives.follow(method, recorded[0])
    path = tmp_path / "hall.yag"
    method.save_map(path)
    again = started(YagSlam())
    again.load_map(path)
    done = drives.follow(again, recorded[1])
    assert done.errors.max() < 0.15
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(RecordError, match=r"hall\.yag"):
        started(YagSlam()).load_map(path)
    with pytest.raises(RecordError, match="nowhere"):
        started(YagSlam()).load_map(tmp_path / "nowhere.yag")


@needs_yag
def test_empty_scans_are_lost_and_ride_on_odometry(drives, recorded) -> None:
    import dataclasses

    from taskslam.measurements import LaserScan

    measurements = [
        dataclasses.replace(m, ranges=np.full_like(m.ranges, np.inf))
        if isinstance(m, LaserScan) and 4e9 < m.stamp < 6e9
        else m
        for m in recorded[0].measurements[:600]
    ]
    count = sum(isinstance(m, LaserScan) for m in measurements)
    done = drives.follow(started(YagSlam()), drives.Drive(None, measurements, recorded[0].truth[:count]))
    assert "lost" in done.statuses
    assert done.statuses[-1] == "tracking"
    assert done.errors.max() < 0.15
