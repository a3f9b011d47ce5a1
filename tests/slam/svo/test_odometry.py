"""svo on a rendered drive: what it is to follow, and what it is to notice."""

from dataclasses import replace

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import is_rigid
from taskslam.measurements import StereoImages
from taskslam.slam.methods.svo import Svo

CUT = 90  # the pair from which on something is wrong: six seconds in
RATE = 15


@pytest.fixture(scope="module")
def undisturbed(follow):
    return follow()


def from_cut(pair):
    return lambda m, n: m if n is None or n < CUT else pair(m)


def mirrored(m):
    """Another place, as sharp and as deep."""
    return StereoImages(m.stamp, m.right[:, ::-1], m.left[:, ::-1])


def flat(level):
    noise = np.random.default_rng(0)

    def pair(m):
        left, right = (level + 5.1 * noise.standard_normal(m.left.shape) for _ in range(2))
        return StereoImages(m.stamp, *(np.clip(eye, 0, 255).astype(np.uint8) for eye in (left, right)))

    return pair


def test_it_follows_the_drive(undisturbed, drive):
    assert undisturbed.statuses == ["tracking"] * len(drive.pairs())
    assert undisturbed.errors.max() < 0.1
    assert undisturbed.errors.mean() < 0.04


def test_the_same_input_gives_the_same_bytes(undisturbed, follow):
    for one, two in zip(undisturbed.estimates, follow().estimates, strict=True):
        assert one.T_start_base.tobytes() == two.T_start_base.tobytes()


@pytest.mark.parametrize("level", [0, 12, 150, 255])
def test_where_nothing_can_be_seen_it_is_lost_within_a_second(follow, level):
    found = follow(from_cut(flat(level)))
    assert set(found.statuses[:CUT]) == {"tracking"}
    assert set(found.statuses[CUT + RATE :]) == {"lost"}
    assert all(is_rigid(e.T_start_base) for e in found.estimates)


def test_a_robot_that_is_carried_off_is_lost_within_a_second(follow):
    found = follow(from_cut(mirrored))
    assert "lost" in found.statuses[CUT : CUT + RATE]
    assert found.statuses[-1] == "tracking"  # from where it thought to be


def test_it_stays_lost_if_it_may_not_begin_again(follow):
    assert set(follow(from_cut(mirrored), reinit=False).statuses[CUT + RATE :]) == {"lost"}


def test_a_frozen_camera_is_noticed(follow, drive):
    last = drive.pairs()[CUT - 1]
    found = follow(from_cut(lambda m: StereoImages(m.stamp, last.left, last.right)))
    assert set(found.statuses[CUT + RATE :]) == {"lost"}


def test_swapped_pictures_never_begin(follow):
    found = follow(lambda m, n: m if n is None else StereoImages(m.stamp, m.right, m.left))
    assert set(found.statuses[2 * RATE :]) == {"lost"}


def test_a_wink_is_bridged(follow):
    found = follow(lambda m, n: m if n not in (CUT, CUT + 1) else StereoImages(m.stamp, 0 * m.left, 0 * m.right))
    assert set(found.statuses) == {"tracking"}
    assert found.errors.max() < 0.12


def test_a_jump_in_time_does_no_harm(follow):
    later = 3600 * 10**9
    found = follow(lambda m, n: replace(m, stamp=m.stamp + later) if n is not None and n >= CUT else m)
    assert all(is_rigid(e.T_start_base) for e in found.estimates)
    assert found.statuses[-1] == "tracking"


def test_an_unknown_option_is_named():
    with pytest.raises(InputError, match="Did you mean 'keyframes'"):
        Svo(keyframe=5)
