"""A tour of the AWS small house, recorded by the simulator: `karto` beside the OpenKarto matcher itself."""

import importlib
import importlib.util
from pathlib import Path

import pytest

from taskslam.slam.methods.karto import Karto
from taskslam.slam.methods.yag_slam import YagSlam

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


@pytest.fixture(scope="module")
def tour(data: Path):
    """45 m, 12 waypoints, 233 s."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        patch.setenv("TASKSLAM_DATA", str(data))
        return importlib.import_module("recorded_drives").record("aws_small_house")


@pytest.fixture(scope="module")
def ours(drives, tour):
    method = Karto()
    method.start(tour.robot.rig)
    return drives.follow(method, tour)


def test_the_tour_is_followed_to_a_centimetre(ours) -> None:
    assert ours.errors.mean() < 0.005
    assert ours.errors.max() < 0.012
    assert set(ours.statuses) == {"tracking"}


def test_a_scan_takes_a_few_milliseconds(ours) -> None:
    assert ours.seconds.mean() < 0.005


@pytest.mark.skipif(
    importlib.util.find_spec("yag_slam") is None or importlib.util.find_spec("cv2") is None,
    reason="yag-slam is not installed (extra yag-slam, CPython 3.11 only)",
)
def test_openkarto_is_less_accurate_and_five_times_slower(drives, tour, ours) -> None:
    method = YagSlam()
    method.start(tour.robot.rig)
    theirs = drives.follow(method, tour)
    assert theirs.errors.mean() < 0.1  # the reference itself works
    assert ours.errors.mean() <= theirs.errors.mean()
    assert ours.errors.max() <= theirs.errors.max()
    assert theirs.seconds.sum() / method.keyframes > 5 * ours.seconds.mean()
