"""Tracking: standstill, turns on the spot, when the map takes a scan in, and when the robot is lost."""

import numpy as np
import pytest

from taskslam.geometry import wrap
from taskslam.slam.base import Status
from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.settings import HectorSettings

PERIOD = 100_000_000


def test_standing_still_neither_drifts_nor_grows_the_map(scan_at) -> None:
    mapper = HectorMapper(HectorSettings())
    mapper.process(scan_at(0, 0, 0), 0)
    before = mapper.levels[0].log_odds.copy()
    poses = np.array([mapper.process(scan_at(0, 0, 0, seed=k), k * PERIOD).pose for k in range(1, 601)])
    np.testing.assert_array_equal(mapper.levels[0].log_odds, before)
    first, last = poses[:100].mean(axis=0), poses[-100:].mean(axis=0)
    assert np.hypot(*(last - first)[:2]) < 0.001
    assert abs(last[2] - first[2]) < np.radians(0.02)


def turn(mapper: HectorMapper, scan_at, rate: float, turns: float = 1.0) -> tuple[float, Status]:
    """Spin on the spot, speeding up and slowing down within half a second; the largest error of heading."""
    heading, speed, errors, status = 0.0, 0.0, [], Status.STARTING
    for k in range(10_000):
        outcome = mapper.process(scan_at(0, 0, heading, seed=k), k * PERIOD)
        errors.append(abs(float(wrap(outcome.pose[2] - heading))))
        status = outcome.status
        speed = min(rate, speed + rate / 5) if heading < 2 * np.pi * turns else speed - rate / 5
        if speed <= 0:
            break
        heading += speed * PERIOD * 1e-9
    return max(errors), status


def test_a_turn_on_the_spot_is_followed(scan_at) -> None:
    error, status = turn(HectorMapper(HectorSettings()), scan_at, rate=0.8)
    assert error < np.radians(2)
    assert status is Status.TRACKING


def test_prediction_follows_turns_that_the_last_pose_loses(scan_at) -> None:
    error, status = turn(HectorMapper(HectorSettings(predict_motion=True)), scan_at, rate=2.5)
    assert error < np.radians(3)
    assert status is Status.TRACKING
    error, _ = turn(HectorMapper(HectorSettings(predict_motion=False)), scan_at, rate=2.5)
    assert error > np.radians(30)


@pytest.mark.parametrize(("step", "taken"), [((0.39, 0.0, 0.0), False), ((0.45, 0.0, 0.0), True), ((0, 0, 0.07), True)])
def test_the_map_takes_a_scan_in_after_travel_or_turn(mapper, scan_at, step, taken) -> None:
    mapper.process(scan_at(0, 0, 0), 0)
    before = mapper.levels[0].log_odds.copy()
    for k in range(1, 11):
        mapper.process(scan_at(*(np.array(step) * k / 10), seed=k), k * PERIOD)
    assert bool((mapper.levels[0].log_odds != before).any()) == taken


def test_a_robot_that_was_carried_off_is_lost_after_a_second_and_leaves_the_map_alone(mapper, scan_at) -> None:
    for k in range(5):
        assert mapper.process(scan_at(0, 0, 0, seed=k), k * PERIOD).status is Status.TRACKING
    before = mapper.levels[0].log_odds.copy()
    statuses = [mapper.process(scan_at(3.9, 1.5, 2.0, seed=k), k * PERIOD).status for k in range(5, 20)]
    assert statuses[:10] == [Status.TRACKING] * 10
    assert statuses[10:] == [Status.LOST] * 5
    np.testing.assert_array_equal(mapper.levels[0].log_odds, before)


def test_in_the_dark_the_pose_stays_the_covariance_grows_and_light_brings_it_back(mapper, scan_at, drives) -> None:
    lit = mapper.process(scan_at(0, 0, 0), 0)
    nothing = scan_at(0, 0, 0, walls=np.array(drives.box(-90, -90, 90, 90)))
    dark = [mapper.process(nothing, k * PERIOD) for k in range(1, 15)]
    assert [outcome.status for outcome in dark] == [Status.TRACKING] * 10 + [Status.LOST] * 4
    np.testing.assert_array_equal(dark[-1].pose, lit.pose)
    assert np.all(np.diag(dark[-1].covariance) > np.diag(dark[0].covariance))
    assert mapper.process(scan_at(0.03, 0, 0), 15 * PERIOD).status is Status.TRACKING


def test_before_anything_is_seen_it_is_starting(scan_at, drives) -> None:
    nothing = scan_at(0, 0, 0, walls=np.array(drives.box(-90, -90, 90, 90)))
    outcome = HectorMapper(HectorSettings()).process(nothing, 0)
    assert outcome.status is Status.STARTING
    np.testing.assert_array_equal(outcome.pose, np.zeros(3))
