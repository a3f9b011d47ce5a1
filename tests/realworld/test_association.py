"""Arrivals against made-up looks: each ends in one of three ways, with the reason and the image."""

import re
from pathlib import Path

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.realworld.arrivals import LoggedArrival
from taskslam.realworld.association import MeasuredArrival, Verdict, judge
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.looks import Frame, Look
from taskslam.realworld.sighting import Fault, NoSighting, Sighting, Station
from taskslam.realworld.tags.detector import Tag

SECOND = 10**9
CORNERS = np.array([[0.0, 0], [50, 0], [50, 50], [0, 50]])
PAUSE = 5.0


def judged(shown: list[tuple[float, float | Fault]], offset: float = 0.0, frames: int = 3) -> MeasuredArrival:
    """An arrival stamped 100 s; shown: time (s) of each look, and the tag's x (px) or why there is no pose."""
    looks = []
    for time, what in shown:
        tags = () if isinstance(what, Fault) else (Tag(1, "tag36h11", 0, 50.0, CORNERS + what),)
        looks.append(Look(Frame(round(time * SECOND), Path(f"{time:g}.jpg")), tags))

    def measure(row: int) -> Sighting | NoSighting:
        what = shown[row][1]
        if isinstance(what, Fault):
            return NoSighting(what, f"{what}!")
        return Sighting(SE2(what / 100, 0.0, 3.14), np.eye(3) * 1e-6, 0.1, 30.0)

    station = Station("camera east", (0,), looks, Camera.pinhole("east", 640, 480, 500.0), "east", None, measure)
    stamps = [look.frame.stamp for look in looks]
    return judge(LoggedArrival(100 * SECOND, 0, 0, priming=False), station, stamps, offset, PAUSE, frames)


def rest(x: float = 100.0, begin: float = 95.5, count: int = 9, step: float = 0.5) -> list[tuple[float, float | Fault]]:
    return [(begin + step * i, x) for i in range(count)]


def test_a_robot_at_rest_is_measured_by_the_median():
    shown = rest()
    shown[4] = (shown[4][0], 100.4)
    found = judged(shown)
    assert found.verdict is Verdict.MEASURED
    assert found.frames == 9
    assert found.pose == SE2(1.0, 0.0, pytest.approx(3.14))
    assert 0 < found.spread_m < 0.003


def test_images_before_the_robot_stood_do_not_count():
    found = judged([(95.1, 300.0), (95.6, 200.0), *rest(begin=96.0, count=8)])
    assert found.verdict is Verdict.MEASURED
    assert found.pose.x == pytest.approx(1.0)


def test_the_camera_s_clock_is_taken_into_account():
    assert judged(rest(begin=135.5), offset=40.0).verdict is Verdict.MEASURED
    found = judged(rest(begin=135.5))
    assert found.verdict is Verdict.AMBIGUOUS
    assert "camera east took no image during the pause; the nearest, 135.5.jpg, is 35.5 s away" in found.reason


@pytest.mark.parametrize("fault", [Fault.NO_TAG, Fault.CUT])
def test_a_camera_that_looked_and_saw_no_whole_tag_says_not_seen(fault):
    found = judged([(time, fault) for time, _ in rest()])
    assert found.verdict is Verdict.NOT_SEEN
    assert found.reason == f"{fault}! in 97.5.jpg, one of 9 images"
    assert found.image == "97.5.jpg"


@pytest.mark.parametrize(("times", "half"), [((95.1, 96.0, 97.2), "first"), ((97.6, 99.0), "second")])
def test_images_from_one_half_of_the_pause_prove_no_absence(times, half):
    found = judged([(time, Fault.NO_TAG) for time in times])
    assert found.verdict is Verdict.AMBIGUOUS
    assert f"all are from the {half} half of the pause" in found.reason


def test_two_images_without_a_tag_prove_absence_where_both_halves_have_one():
    assert judged([(96.0, Fault.NO_TAG), (98.0, Fault.CUT)]).verdict is Verdict.NOT_SEEN
    assert judged([(96.0, Fault.NO_TAG)], frames=1).verdict is Verdict.NOT_SEEN


@pytest.mark.parametrize("fault", [Fault.TWICE, Fault.RESIDUAL, Fault.PROBLEM])
def test_images_that_cannot_be_used_decide_nothing(fault):
    found = judged([(time, fault) for time, _ in rest()])
    assert found.verdict is Verdict.AMBIGUOUS
    assert found.reason == f"{fault}! in 97.5.jpg"


def test_one_image_with_two_robots_makes_the_pause_ambiguous():
    assert judged([*rest(count=6), (98.7, Fault.TWICE)]).verdict is Verdict.AMBIGUOUS


def test_a_blurred_or_broken_image_among_good_ones_is_left_out():
    found = judged([*rest(count=7), (99.2, Fault.RESIDUAL), (99.4, Fault.PROBLEM), (99.6, Fault.NO_TAG)])
    assert found.verdict is Verdict.MEASURED
    assert found.frames == 7


@pytest.mark.parametrize(
    ("shown", "reason"),
    [
        ([(95.5 + 0.5 * i, 100.0 + 30 * i) for i in range(9)], r"not at rest: up to 42\.4 px from image to image"),
        (rest(count=2), r"only 2 of the 3 images that are needed show the tag, the last 96\.jpg"),
        (rest(count=5, step=0.1), r"for 0\.4 s only, between 95\.5\.jpg and 95\.9\.jpg"),
        ([*rest(count=5), *rest(x=300.0, begin=98.0, count=5)], r"stood at two places during the pause, in 95\.5\.jpg"),
    ],
)
def test_a_robot_that_does_not_rest_is_ambiguous(shown, reason):
    found = judged(shown)
    assert found.verdict is Verdict.AMBIGUOUS
    assert found.pose is None
    assert re.search(reason, found.reason)


def test_one_image_is_enough_only_where_the_setup_says_so():
    assert judged([(98.0, 100.0)]).verdict is Verdict.AMBIGUOUS
    assert judged([(98.0, 100.0)], frames=1).verdict is Verdict.MEASURED


def test_no_image_at_all_is_said():
    found = judged([])
    assert (found.verdict, found.reason, found.image) == (Verdict.AMBIGUOUS, "camera east took no image", None)
