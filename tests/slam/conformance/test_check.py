"""The suite against our own methods, and against guests that it must catch."""

import re

import pytest

from taskslam.errors import InputError, MethodUnavailableError, UnknownMethodError
from taskslam.slam.conformance.check import Verdict, check_method


def verdicts(method, rig, **options):
    return {r.name: (r.verdict, r.detail) for r in check_method(method, options, rig, minutes=1)}


@pytest.mark.parametrize("method", ["wheel_odometry", "ground_truth", "karto", "hector"])
def test_our_methods_conform(method, rig):
    results = check_method(method, {}, rig, minutes=1)
    assert [r.name for r in results if r.verdict is Verdict.FAILED] == []
    skipped = {r.name for r in results if r.verdict is Verdict.SKIPPED}
    assert skipped == (set() if method in {"karto", "hector"} else {"map_round_trip", "latency"})


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


def test_a_card_is_told_what_a_frame_takes(guests, rig):
    results = verdicts("karto", rig)
    assert results["latency"][0] is Verdict.PASSED
    assert re.fullmatch(
        r"a frame takes \d+\.\d ms of processor time here, \d+\.\d at p95; its card says 20 ms", results["latency"][1]
    )
    verdict, detail = verdicts("nonconforming:Unhurried", rig)["latency"]
    assert verdict is Verdict.SKIPPED
    took, fitting = re.search(r", (\d+\.\d) at p95; its card names no latency: latency=(\S+) would", detail).groups()
    assert float(took) <= 1e3 * float(fitting) <= float(took) + 1.05


def test_there_must_be_something_to_check(guests, rig):
    with pytest.raises(UnknownMethodError):
        check_method("kartoo", {}, rig)
    with pytest.raises(MethodUnavailableError):
        check_method("misbehaving:NeedsAbsentPackage", {}, rig)
    with pytest.raises(InputError, match="at least 1"):
        check_method("wheel_odometry", {}, rig, minutes=0.5)
