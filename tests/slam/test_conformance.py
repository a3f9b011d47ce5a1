"""The suite against our own methods, and against guests that it must catch."""

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError, UnknownMethodError
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.slam.conformance import Verdict, check_method
from taskslam.slam.conformance_drive import ConformanceDrive

SECOND = NANOSECONDS


def verdicts(method, rig, **options):
    return {r.name: (r.verdict, r.detail) for r in check_method(method, options, rig, minutes=1)}


@pytest.mark.parametrize("method", ["wheel_odometry", "ground_truth", "karto"])
def test_our_methods_conform(method, rig):
    results = check_method(method, {}, rig, minutes=1)
    assert [r.name for r in results if r.verdict is Verdict.FAILED] == []
    skipped = {r.name for r in results if r.verdict is Verdict.SKIPPED}
    assert skipped == (set() if method == "karto" else {"map_round_trip"})


@pytest.mark.parametrize(
    ("guest", "check", "words"),
    [
        ("WantsTheTruth", "needs_declared", "only methods of kind reference"),
        ("WrongUnits", "tracks_the_drive", "expected at most 0.5 m"),
        ("Parrot", "silence", "two poses carry the stamp"),
        ("Dice", "determinism", "differ from"),
        ("Hoarder", "memory", "growth over known ground"),
        ("Nomad", "restart", "expected the origin"),
        ("Mute", "poses", "none of them with status tracking"),
        ("Forgetful", "map_round_trip", "expected at most 0.5 m"),
        ("RaisesLate", "memory", "ValueError: too late"),
    ],
)
def test_what_does_not_conform_is_caught(guests, rig, guest, check, words):
    slow_odometry = rig.odometry.model_copy(update={"rate": 10.0})
    rig = rig.model_copy(update={"odometry": slow_odometry})
    results = verdicts(f"nonconforming:{guest}", rig)
    failed = {name for name, (verdict, _) in results.items() if verdict is Verdict.FAILED}
    assert failed == {check}
    assert words in results[check][1]


def test_there_must_be_something_to_check(guests, rig):
    with pytest.raises(UnknownMethodError):
        check_method("kartoo", {}, rig)
    with pytest.raises(MethodUnavailableError):
        check_method("misbehaving:NeedsAbsentPackage", {}, rig)
    with pytest.raises(InputError, match="at least 1"):
        check_method("wheel_odometry", {}, rig, minutes=0.5)


def test_the_drive_is_the_same_however_it_is_cut(rig):
    drive = ConformanceDrive(rig)
    whole = list(drive.measurements(0, 3 * SECOND))
    parts = [*drive.measurements(0, SECOND), *drive.measurements(SECOND, 3 * SECOND)]
    assert len(whole) == 3 * (2 * 50 + 10)
    for one, two in zip(whole, parts, strict=True):
        assert (one.sensor, one.stamp) == (two.sensor, two.stamp)
        if one.sensor is Sensor.LASER_SCAN:
            np.testing.assert_array_equal(one.ranges, two.ranges)
        else:
            assert one == two


def test_the_drive_begins_at_rest_at_the_origin_and_closes_its_lap(rig):
    drive = ConformanceDrive(rig, still=2.0)
    assert drive.pose(0) == drive.pose(2 * SECOND)
    assert drive.pose(0).distance_to(type(drive.pose(0))()) < 1e-12
    after_a_lap = drive.pose(round((2.0 + 0.5 + drive.lap) * SECOND))
    assert after_a_lap.distance_to(drive.pose(0)) < 1e-3


def test_ranges_of_the_drive_are_those_of_the_room(rig):
    """From the start the island lies 1.3 m to the left, the outer wall 1.2 m to the right."""
    noiseless = rig.lidar_2d.model_copy(
        update={"noise": 0.0, "mount": rig.lidar_2d.mount.model_copy(update={"xyz": (0.0, 0.0, 0.4)})}
    )
    drive = ConformanceDrive(rig.model_copy(update={"lidar_2d": noiseless}))
    scan = next(m for m in drive.measurements(0, SECOND) if m.sensor is Sensor.LASER_SCAN)
    angles = scan.angles()
    left, right = np.argmin(abs(angles - np.pi / 2)), np.argmin(abs(angles + np.pi / 2))
    assert scan.ranges[left] == pytest.approx(1.3, abs=1e-3)
    assert scan.ranges[right] == pytest.approx(1.2, abs=1e-3)
