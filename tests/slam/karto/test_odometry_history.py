import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import WheelOdometry
from taskslam.slam.karto.odometry_history import OdometryHistory

MS = 1_000_000


def arc(stamp: int, radius: float = 2.0, speed: float = 0.5) -> WheelOdometry:
    angle = speed / radius * stamp * 1e-9
    return WheelOdometry(stamp, SE2(radius * np.sin(angle), radius * (1 - np.cos(angle)), angle), speed, speed / radius)


@pytest.fixture
def history() -> OdometryHistory:
    history = OdometryHistory()
    for stamp in range(0, 1000 * MS, 20 * MS):
        history.add(arc(stamp))
    return history


@pytest.mark.parametrize("stamp", [0, 500 * MS, 507 * MS, 980 * MS, 1010 * MS])
def test_any_instant_is_read_between_samples_and_a_little_after(history, stamp) -> None:
    found, expected = history.at(stamp), arc(stamp).T_odom_base
    assert found.distance_to(expected) < 1e-5
    assert found.theta == pytest.approx(expected.theta, abs=1e-9)


def test_motion_within_a_scan_ends_at_the_identity(history) -> None:
    offsets = np.arange(-1023, 1, dtype=np.int64) * 97_656
    motion = history.motion_within(400 * MS, offsets)
    assert motion[-1] == pytest.approx(np.zeros(3), abs=1e-12)
    expected = arc(400 * MS).T_odom_base.inverse() @ arc(400 * MS + int(offsets[0])).T_odom_base
    assert motion[0] == pytest.approx(expected.array(), abs=1e-5)


def test_samples_that_are_old_or_not_finite_are_ignored(history) -> None:
    count = len(history)
    history.add(arc(500 * MS))
    history.add(WheelOdometry(2000 * MS, SE2(np.nan, 0.0, 0.0), 0.0, 0.0))
    assert len(history) == count


def test_memory_stays_bounded() -> None:
    history = OdometryHistory()
    for k in range(5000):
        history.add(arc(k * 20 * MS))
    assert len(history) < 600
    assert history.at(4999 * 20 * MS).distance_to(arc(4999 * 20 * MS).T_odom_base) < 1e-9
