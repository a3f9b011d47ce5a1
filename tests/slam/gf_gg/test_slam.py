"""gf_gg on a rendered drive: what it is to follow, what it is to notice, and that it finds its way back."""

from dataclasses import replace

import numpy as np
import pytest

from taskslam.geometry import is_rigid
from taskslam.measurements import StereoImages

RATE = 15
CUT = 20  # the pair from which on something is wrong, in the short runs
SHORT = range(30, 30 + CUT + 2 * RATE)
PLAIN = {"good_features": False, "good_graph": False, "full_frames": 0}


def pictures(left, right=None, until=10**9):
    """From the CUT-th pair on, these instead."""

    def change(pair, n):
        if not CUT <= n < until:
            return pair
        return StereoImages(pair.stamp, left(pair), (right or left)(pair))

    return change


def flat(level):
    noise = np.random.default_rng(0)
    return lambda pair: np.clip(level + 5.1 * noise.standard_normal(pair.left.shape), 0, 255).astype(np.uint8)


def mirrored(pair):
    """What the pair of cameras would see in a mirror image of the house: another place, as sharp and as deep."""
    return StereoImages(pair.stamp, pair.right[:, ::-1], pair.left[:, ::-1])


@pytest.fixture(scope="module")
def undisturbed(follow):
    return follow(full_frames=0, features_wanted=200)


def test_it_follows_the_drive(undisturbed):
    assert set(undisturbed.statuses) == {"tracking"}
    assert undisturbed.errors.max() < 0.08  # where all that is seen is a wall six metres away
    assert undisturbed.errors.mean() < 0.02


def test_the_same_input_gives_the_same_bytes(undisturbed, follow):
    assert follow(full_frames=0, features_wanted=200).bytes == undisturbed.bytes


def test_without_good_features_and_good_graph_it_follows_as_well(follow, undisturbed):
    plain = follow(**PLAIN)
    assert set(plain.statuses) == {"tracking"}
    assert plain.errors.max() < 0.05
    assert plain.bytes != undisturbed.bytes


@pytest.mark.parametrize("name", ["black", "white", "covered lens", "bare wall"])
def test_where_nothing_can_be_seen_it_is_lost_within_a_second_and_found_again_in_the_light(follow, name):
    black, white = (lambda pair, level=level: np.full_like(pair.left, level) for level in (0, 255))
    look = {"black": black, "white": white, "covered lens": flat(12), "bare wall": flat(150)}[name]
    found = follow(SHORT, pictures(look, until=CUT + RATE + 3))
    assert set(found.statuses[:CUT]) == {"tracking"}
    assert set(found.statuses[CUT + RATE : CUT + RATE + 3]) == {"lost"}
    assert found.statuses[-1] == "tracking"
    assert found.errors[-1] < 0.05
    assert all(is_rigid(e.T_start_base) for e in found.estimates)


def test_a_robot_that_is_carried_off_is_lost_within_a_second_and_never_found_in_a_strange_place(follow):
    found = follow(SHORT, lambda pair, n: pair if n < CUT else mirrored(pair))
    assert set(found.statuses[CUT + RATE :]) == {"lost"}


def test_carried_back_to_a_place_it_knows_it_says_where(follow):
    """Four seconds on, and from one pair to the next back to the beginning: as between two rounds."""
    numbers = [*range(30, 30 + 60), *range(30, 30 + RATE)]
    found = follow(numbers)
    assert found.statuses[-1] == "tracking"
    assert found.errors[-1] < 0.03
    assert np.nanmax(found.errors[60 + RATE // 2 :]) < 0.05


def test_a_frozen_camera_is_noticed(follow, drive):
    last = drive.pairs[SHORT[CUT - 1]]
    found = follow(SHORT, pictures(lambda _: last.left, lambda _: last.right))
    assert set(found.statuses[CUT + RATE :]) == {"lost"}


def test_a_camera_without_noise_may_stand_still(drive, follow):
    rig = drive.rig.model_copy(update={"stereo": drive.rig.stereo.model_copy(update={"noise": 0.0})})
    still = follow([0] * 20, rig=rig)
    assert set(still.statuses) == {"tracking"}
    assert np.abs(still.estimates[-1].T_start_base - np.eye(4)).max() < 1e-3


def test_swapped_pictures_never_begin(follow):
    found = follow(SHORT, lambda pair, n: StereoImages(pair.stamp, pair.right, pair.left))
    assert set(found.statuses) == {"starting", "lost"}
    assert set(found.statuses[RATE + 1 :]) == {"lost"}


def test_pictures_swapped_on_the_way_are_noticed(follow):
    found = follow(SHORT, pictures(lambda pair: pair.right, lambda pair: pair.left))
    tracked = [error for error in found.errors[CUT + RATE :] if np.isfinite(error)]
    assert not tracked or max(tracked) < 0.3


@pytest.mark.parametrize("what", ["baseline", "horizontal_fov"])
def test_a_calibration_that_is_five_percent_off_gives_a_pose_that_is_as_much_off_or_none(follow, drive, what):
    stereo = drive.rig.stereo.model_copy(update={what: 1.05 * getattr(drive.rig.stereo, what)})
    found = follow(SHORT, rig=drive.rig.model_copy(update={"stereo": stereo}))
    tracked = found.errors[np.isfinite(found.errors)]
    assert len(tracked) == 0 or tracked.max() < 0.3
    assert all(is_rigid(e.T_start_base) for e in found.estimates)


def test_a_jump_in_time_does_no_harm(follow):
    later = 3600 * 10**9
    found = follow(SHORT, lambda pair, n: replace(pair, stamp=pair.stamp + later * (n >= CUT)))
    assert all(is_rigid(e.T_start_base) for e in found.estimates)
    assert found.statuses[-1] == "tracking"
    assert found.errors[-1] < 0.08


def test_a_wink_is_bridged(follow):
    """Two pairs of darkness: it goes on as it did, and says nothing."""
    found = follow(SHORT, pictures(lambda pair: 0 * pair.left, until=CUT + 2))
    assert set(found.statuses) == {"tracking"}
    assert found.errors.max() < 0.05


def test_colour_pictures_are_followed_like_grey_ones(follow):
    def color(image):
        return np.repeat(image[:, :, None], 3, axis=2)

    grey = follow(SHORT[:20])
    found = follow(SHORT[:20], lambda pair, n: StereoImages(pair.stamp, color(pair.left), color(pair.right)))
    assert found.bytes == grey.bytes


def test_a_map_that_would_begin_nobody_knows_where_does_not_begin(follow):
    """The lens is covered for the first seconds, and the robot may have gone anywhere."""
    found = follow(
        SHORT, lambda pair, n: pair if n > 2 * RATE else StereoImages(pair.stamp, 0 * pair.left, 0 * pair.right)
    )
    assert set(found.statuses[RATE + 1 :]) == {"lost"}


def test_a_map_may_begin_a_moment_late(follow):
    found = follow(
        [30] * 60, lambda pair, n: pair if n > 5 else StereoImages(pair.stamp, 0 * pair.left, 0 * pair.right)
    )
    assert found.statuses[:6] == ["starting"] * 6
    assert found.statuses[7] == "tracking"
