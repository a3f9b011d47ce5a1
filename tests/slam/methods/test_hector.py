"""`hector` as a method, on the recorded drives."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.measurements import LaserScan, Sensor
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.base import Status
from taskslam.slam.methods.hector import Hector

DRIVES = Path(__file__).parents[1] / "karto" / "drives.py"
RIG = load_robot("turtlebot2").rig

_REPLAY = """
import hashlib, importlib.util, sys
spec = importlib.util.spec_from_file_location("karto_drives", sys.argv[1])
drives = importlib.util.module_from_spec(spec)
sys.modules["karto_drives"] = drives
spec.loader.exec_module(drives)
from taskslam.slam.methods.hector import Hector
import numpy as np
walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4))
drive = drives.drive(walls, np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5)]), speed=0.5)
method = Hector()
method.start(drive.robot.rig)
digest = hashlib.sha256()
for measurement in drive.measurements:
    estimate = method.feed(measurement)
    if estimate is not None:
        digest.update(estimate.T_start_base.tobytes() + estimate.covariance.tobytes())
        digest.update(estimate.status.value.encode())
print(digest.hexdigest())
"""


@pytest.fixture(scope="module")
def corridors(drives):
    """Once round the corridors and rooms, about 66 m."""
    return drives.drive(drives.rooms(), drives.ROOMS_TOUR)


@pytest.fixture
def hector() -> Hector:
    method = Hector()
    method.start(RIG)
    return method


def test_its_card_asks_for_scans_alone(hector) -> None:
    assert hector.card.sensors == (Sensor.LASER_SCAN,)
    assert not hector.card.odometry_prior


def test_a_robot_without_lidar_is_refused() -> None:
    with pytest.raises(InputError, match="hector needs a 2D LiDAR"):
        Hector().start(SensorRig(odometry=RIG.odometry))


def test_use_before_start_is_refused(corridors, tmp_path) -> None:
    with pytest.raises(InputError, match="call start"):
        Hector().feed(corridors.scans[0])
    with pytest.raises(InputError, match="call start"):
        Hector().load_map(tmp_path / "map.npz")


def test_an_unknown_option_is_named() -> None:
    with pytest.raises(InputError, match=r"hector has no option 'map_resolutoin'.*Did you mean 'map_resolution'"):
        Hector(map_resolutoin=0.1)


def test_a_long_round_trip_stays_within_centimetres(hector, drives, corridors) -> None:
    done = drives.follow(hector, corridors)
    assert set(done.statuses) == {"tracking"}
    assert done.errors.max() < 0.06
    assert np.degrees(done.headings.max()) < 0.5
    assert np.median(done.seconds) < 0.01


def test_a_bare_corridor_is_its_known_limit(hector, drives) -> None:
    """Without odometry nothing tells the way along two bare walls; across them the pose holds."""
    walls = np.array([(-60.0, 0.0, 60.0, 0.0), (60.0, 2.0, -60.0, 2.0)])
    done = drives.follow(hector, drives.drive(walls, np.array([(0.0, 1.0), (8.0, 1.0)])))
    assert done.errors[-1] > 4.0
    assert np.abs((done.estimates - done.truth)[:, 1]).max() < 0.1


def test_a_round_on_a_loaded_map_starts_where_the_first_did(hector, drives, tmp_path) -> None:
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4) + drives.box(0, 5.2, 0.5, 5.9))
    tour = np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5)])
    drives.follow(hector, drives.drive(walls, tour, speed=0.5))
    hector.save_map(tmp_path / "map.npz")
    second = Hector()
    second.start(RIG)
    second.load_map(tmp_path / "map.npz")
    done = drives.follow(second, drives.drive(walls, tour, speed=0.5, seed=5))
    assert set(done.statuses) == {"tracking"}
    assert done.errors.max() < 0.06


@pytest.mark.parametrize("value", [np.inf, np.nan, 0.0, -1.0])
def test_a_run_that_begins_in_the_dark_starts_where_it_stood(hector, corridors, value) -> None:
    for k in range(5):
        dark = np.full(1024, value, np.float32)
        estimate = hector.feed(LaserScan(k, dark, -3.14, 6.28 / 1023, 0.1, 10.0))
        assert estimate.status is Status.STARTING
        np.testing.assert_array_equal(estimate.T_start_base, np.eye(4))
    estimate = hector.feed(corridors.scans[1])
    assert estimate.status is Status.TRACKING
    np.testing.assert_array_equal(estimate.T_start_base, np.eye(4))


def test_the_same_bytes_whatever_the_threads_and_the_hash_seed() -> None:
    found = set()
    for threads, seed in (("1", "0"), ("2", "4242")):
        counts = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), threads)
        done = subprocess.run(
            [sys.executable, "-c", _REPLAY, str(DRIVES)],
            env={**os.environ, **counts, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        found.add(done.stdout.strip())
    assert len(found) == 1
    assert len(found.pop()) == hashlib.sha256().digest_size * 2
