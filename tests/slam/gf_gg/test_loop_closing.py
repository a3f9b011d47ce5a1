"""A whole turn in a round room with a wrong focal length: its ends do not meet until the loop closes."""

import numpy as np
import pytest

from taskslam.geometry import invert_se3
from taskslam.measurements import NANOSECONDS
from taskslam.slam.gf_gg.loop_closing import optimise_poses
from taskslam.slam.gf_gg.motion import Motion
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.gf_gg.slam import GfGgSlam
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3

WIDTH, HEIGHT, RADIUS, STEPS = 320, 240, 3.0, 100
TRUE, WRONG = Pinhole(160.0, 160.0, 120.0, 0.2), Pinhole(163.0, 160.0, 120.0, 0.2)


@pytest.fixture(scope="module")
def wall():
    """Tiles of a cylinder, by angle and height."""
    random = np.random.default_rng(7)
    return [random.integers(40, 216, shape).astype(float) for shape in ((60, 240), (120, 480))]


def see(wall, angle):
    """Left and right picture from the axis of the cylinder, (H, W) each."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    x, y = (u - TRUE.cx) / TRUE.f, (v - TRUE.cy) / TRUE.f
    pair = []
    for offset in (0.0, TRUE.baseline):
        # (offset + s x, s) lies on the circle of the wall
        a, b, c = x * x + 1.0, offset * x, offset * offset - RADIUS * RADIUS
        s = (-b + np.sqrt(b * b - a * c)) / a
        around = (np.arctan2(offset + s * x, s) + angle) / (2 * np.pi) % 1.0
        up = np.clip(s * y / 10.0 + 0.5, 0.0, 0.999)
        image = sum(tiles[(up * len(tiles)).astype(int), (around * tiles.shape[1]).astype(int)] for tiles in wall) / 2
        pair.append(image.astype(np.uint8))
    return pair


def turn(wall, **options):
    """Heading and position after a whole turn and a bit, and the loops closed."""
    settings = GfGgSettings(features=400, full_frames=10**3, keyframe_gap=2, **options)
    slam = GfGgSlam(settings, WRONG, WIDTH, HEIGHT, Motion(0.0))
    for n in range(STEPS + 12):
        outcome = slam.process(*see(wall, 2 * np.pi * n / STEPS), n * NANOSECONDS // 15)
        assert outcome.status == "tracking"
    T = outcome.T_world_camera
    heading = np.arctan2(T[0, 2], T[2, 2])
    apart = (heading - 2 * np.pi * (n % STEPS) / STEPS + np.pi) % (2 * np.pi) - np.pi
    return abs(apart), slam.loops.closed


def test_the_loop_closes_and_the_turn_with_it(wall):
    open_end, none = turn(wall, loop_closing=False)
    closed_end, loops = turn(wall)
    assert none == 0
    assert loops >= 1
    assert open_end > 0.03
    assert closed_end < 0.3 * open_end


def test_a_chain_of_poses_that_does_not_close_is_spread_evenly():
    step = exp_se3(np.array([0.0, 0.0, 1.0, 0.0, 2 * np.pi / 10, 0.0]))
    true = [np.linalg.matrix_power(step, n) for n in range(10)]
    wrong = exp_se3(np.array([0.0, 0.0, 1.0, 0.0, 2 * np.pi / 10 + 0.01, 0.0]))
    poses = np.stack([invert_se3(np.linalg.matrix_power(wrong, n)) for n in range(10)])
    edges = [(n, n - 1, poses[n] @ invert_se3(poses[n - 1])) for n in range(1, 10)]
    edges.append((9, 0, invert_se3(true[9])))
    found = optimise_poses(poses, np.arange(10), edges)
    np.testing.assert_allclose(found[0], poses[0], atol=1e-6)
    before, after = (np.linalg.norm(T[9] - invert_se3(true[9])) for T in (poses, found))
    assert after < 0.25 * before
    again = optimise_poses(poses, np.arange(10), edges)
    assert again.tobytes() == found.tobytes()
