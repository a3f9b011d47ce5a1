"""Features on pictures of dots, whose places are known."""

import numpy as np
import pytest

from taskslam.slam.inertial.rotations import exp_so3
from taskslam.slam.msckf.front_end import FrontEnd
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.vision.pinhole import Pinhole

pytest.importorskip("cv2", reason="needs the extra `msckf`")

FOCAL, CENTER, SHAPE, BASELINE = 300.0, (320.0, 240.0), (480, 640), 0.11
PINHOLE = Pinhole(FOCAL, *CENTER, BASELINE)


@pytest.fixture
def dots():
    """(600, 3) landmarks before the camera, 2 to 8 m away."""
    dice = np.random.default_rng(0)
    depth = dice.uniform(2, 8, 600)
    return np.column_stack([dice.uniform(-1.2, 1.2, 600) * depth, dice.uniform(-0.9, 0.9, 600) * depth, depth])


def picture(dots, R, p, noise_of=0):
    """What a camera at (R, p) sees: bright squares with soft edges on grey."""
    image = np.full(SHAPE, 60.0)
    at = (dots - p) @ R
    y, x = np.mgrid[-6:7, -6:7]
    for (u, v, w), level in zip(at, np.random.default_rng(1).uniform(80, 180, len(dots)), strict=True):
        if w < 0.5:
            continue
        px, py = FOCAL * u / w + CENTER[0], FOCAL * v / w + CENTER[1]
        i, j = round(py), round(px)
        if not (6 <= i < SHAPE[0] - 6 and 6 <= j < SHAPE[1] - 6):
            continue
        soft = 1 / (1 + np.exp(3 * (np.maximum(np.abs(x + j - px), np.abs(y + i - py)) - 3)))
        image[i - 6 : i + 7, j - 6 : j + 7] += level * soft
    image += 2.0 * np.random.default_rng(noise_of).normal(size=SHAPE)
    return np.clip(image, 0, 255).astype(np.uint8)


def observe(front, left, right, R_before_now, step=(0.0, 0.0, 0.0)):
    T_before_now = np.eye(4)
    T_before_now[:3, :3], T_before_now[:3, 3] = R_before_now, step
    seen = front.look(left, right, T_before_now)
    front.keep(seen)
    return seen


def pair(dots, R, p, noise_of=0):
    return picture(dots, R, p, noise_of), picture(dots, R, p + R @ np.array([BASELINE, 0, 0]), noise_of + 100)


def test_every_cell_gets_its_features_matched_in_both_eyes(dots) -> None:
    front = FrontEnd(MsckfSettings(), PINHOLE)
    observe(front, *pair(dots, np.eye(3), np.zeros(3)), np.eye(3))
    features = front.features
    assert len(features) > 100
    disparity = (features.left - features.right)[:, 0]
    assert ((disparity > 0.8 * FOCAL * BASELINE / 8) & (disparity < 1.2 * FOCAL * BASELINE / 2)).mean() > 0.95
    assert np.abs((features.left - features.right)[:, 1]).max() < 5
    assert np.bincount(front._cells(features.left, SHAPE), minlength=24).max() <= 10


def test_features_are_followed_through_a_turn_that_the_gyro_knows(dots) -> None:
    """Six degrees between two pairs, 32 pixels: begun at the gyro's guess they are found again."""
    turn, step = exp_so3(np.array([0.0, 0.105, 0.0])), np.array([0.05, 0.0, 0.05])
    right = {}
    for name, guess in (("gyro", turn), ("none", np.eye(3))):
        front = FrontEnd(MsckfSettings(pyramid_levels=0), PINHOLE)
        observe(front, *pair(dots, np.eye(3), np.zeros(3)), np.eye(3))
        before = dict(zip(front.features.ids.tolist(), front.features.left[:, 0].tolist(), strict=True))
        observe(front, *pair(dots, turn, step, 7), guess)
        now = zip(front.features.ids.tolist(), front.features.left[:, 0].tolist(), strict=True)
        shifts = np.array([x - before[name] for name, x in now if name in before])
        right[name] = np.count_nonzero((shifts < -28) & (shifts > -55)) / len(before)
    assert right["gyro"] > 0.6
    assert right["none"] < 0.3


def test_what_moves_by_itself_is_left_out(dots) -> None:
    """Fifteen of the landmarks go their own way, against the camera's translation."""
    front = FrontEnd(MsckfSettings(), PINHOLE)
    before = np.random.default_rng(3).uniform(50, 400, (60, 2)).astype(np.float32)
    now = before + np.array([8.0, 0.0], np.float32)
    now[::4] += np.array([0.0, 12.0], np.float32)
    agree = front.agreeing(before, now)
    assert not agree[::4].any()
    assert np.delete(agree, np.arange(0, 60, 4)).all()


@pytest.mark.parametrize("level", [0, 150, 255])
def test_nothing_is_found_again_in_the_noise_of_black_white_and_bare_walls(dots, level) -> None:
    """Noise makes corners that track from eye to eye, but hardly any look alike there, and none does for long."""
    front, noise = FrontEnd(MsckfSettings(), PINHOLE), np.random.default_rng(0)
    observe(front, *pair(dots, np.eye(3), np.zeros(3)), np.eye(3))
    for _ in range(3):
        blank = np.clip(level + 5.1 * noise.standard_normal((2, *SHAPE)), 0, 255).astype(np.uint8)
        seen = observe(front, *blank, np.eye(3))
    assert seen.found < 5


def test_a_pair_that_is_not_kept_leaves_no_trace(dots) -> None:
    front = FrontEnd(MsckfSettings(), PINHOLE)
    observe(front, *pair(dots, np.eye(3), np.zeros(3)), np.eye(3))
    before = front.features
    black = np.zeros(SHAPE, np.uint8)
    seen = front.look(black, black, np.eye(4))
    assert (seen.share, len(seen.features), seen.cells) == (0.0, 0, 0)
    assert front.features is before
    assert observe(front, *pair(dots, np.eye(3), np.array([0.02, 0, 0]), 3), np.eye(3)).share > 0.8


def test_the_same_pictures_give_the_same_features(dots) -> None:
    found = []
    for _ in range(2):
        front = FrontEnd(MsckfSettings(), PINHOLE)
        for k in range(4):
            observe(front, *pair(dots, np.eye(3), np.array([0.03 * k, 0, 0]), k), np.eye(3))
        found.append(front.normalised())
    np.testing.assert_array_equal(*found)
