from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Sensor, StereoImages
from taskslam.robot import Robot, StereoCamera, load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.camera import StereoCameraSensor, pinhole_of
from taskslam.simulation.sensors.exposure import AutomaticExposure
from taskslam.simulation.sensors.read_noise import develop
from taskslam.simulation.simulator import Simulator
from taskslam.world import World


def camera_with(**values: object) -> StereoCamera:
    camera = load_robot("turtlebot2").rig.stereo
    assert camera is not None
    return camera.model_copy(update=values)


def robot_with(camera: StereoCamera) -> Robot:
    robot = load_robot("turtlebot2")
    return robot.model_copy(update={"rig": robot.rig.model_copy(update={"stereo": camera})})


SMALL = {"width": 188, "height": 120}


def test_pairs_come_at_the_published_rate_and_size_with_one_stamp(room: World) -> None:
    simulator = Simulator(room, load_robot("turtlebot2"), 0, sensors={Sensor.STEREO_IMAGES})
    pairs = [m for m in simulator.advance(NANOSECONDS // 5) if isinstance(m, StereoImages)]
    assert [pair.stamp for pair in pairs] == [round((k + 1) * NANOSECONDS / 30) for k in range(len(pairs))]
    assert len(pairs) == 6
    assert all(eye.shape == (480, 752) and eye.dtype == np.uint8 for eye in (pairs[0].left, pairs[0].right))


def test_rate_size_and_colour_are_settings(room: World) -> None:
    camera = camera_with(rate=12.5, width=64, height=48, color=True)
    simulator = Simulator(room, robot_with(camera), 0, sensors={Sensor.STEREO_IMAGES})
    pairs = [m for m in simulator.advance(NANOSECONDS) if isinstance(m, StereoImages)]
    assert len(pairs) == 12
    assert pairs[-1].left.shape == pairs[-1].right.shape == (48, 64, 3)


def test_the_real_robots_preset_differs_in_its_cameras_only() -> None:
    simulated, real = load_robot("turtlebot2"), load_robot("turtlebot2_d435i")
    pair = real.rig.stereo
    assert pair is not None
    assert (pair.width, pair.height, pair.baseline) == (640, 480, 0.05)
    assert np.degrees(pair.horizontal_fov) == pytest.approx(87.0)
    same = real.rig.model_copy(update={"stereo": simulated.rig.stereo, "rgbd": None})
    assert real.model_copy(update={"name": simulated.name, "rig": same}) == simulated


def test_what_left_sees_at_a_depth_right_sees_focal_times_baseline_over_depth_further_left(room: World) -> None:
    camera = camera_with()
    left, right = StereoCameraSensor(camera, room, 0).views(SE2(-3.0, 0.4, 0.3).matrix())
    depth, other = left.depth(), right.depth()
    row, column = np.nonzero(np.isfinite(depth))
    there = np.round(column - camera.focal_length * camera.baseline / depth[row, column]).astype(int)
    inside = there >= 0
    agrees = np.isclose(other[row, there], depth[row, column], rtol=0.02)[inside]
    assert agrees.mean() > 0.95  # the rest is hidden from the right eye by the pillar


def test_the_same_seed_gives_the_same_bytes_and_a_reset_gives_fresh_noise(room: World) -> None:
    def pair(seed: int, resets: int) -> bytes:
        sensor = StereoCameraSensor(camera_with(**SMALL), room, seed)
        sensor.reset(resets)
        images = sensor.measure(0, Motion(0, SE2(-2.0, 0.0, 0.1)))
        return images.left.tobytes() + images.right.tobytes()

    assert pair(1, 0) == pair(1, 0)
    assert len({pair(1, 0), pair(2, 0), pair(1, 1)}) == 3


def test_read_noise_is_gaussian_and_independent_between_pixels_frames_and_eyes() -> None:
    grey = np.full((480, 752), 0.5, np.float32)
    first, second = (develop(grey, 1.0, 5.1, key).astype(float) for key in (7, 8))
    assert first.mean() == pytest.approx(127.5, abs=0.05)
    assert first.std() == pytest.approx(np.hypot(5.1, np.sqrt(1 / 12)), rel=0.01)
    assert abs(stats.kurtosis(first.ravel())) < 0.05
    # what falls below each level, against the normal distribution
    levels = np.arange(110, 146)
    share = np.array([(first <= level).mean() for level in levels])
    assert np.abs(share - stats.norm.cdf(levels + 0.5, 127.5, 5.1)).max() < 0.004
    for other in (np.roll(first, 1, axis=1), np.roll(first, 4, axis=1), np.roll(first, 1, axis=0), second):
        assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.01


def test_a_white_floor_is_not_saturated(room: World) -> None:
    white = replace(
        room, materials=(replace(room.materials[0], diffuse=(1.0, 1.0, 1.0, 1.0)),), ambient=(1.0, 1.0, 1.0)
    )
    images = StereoCameraSensor(camera_with(), white, 0).measure(0, Motion(0, SE2(-2.0, 0.0, 0.0)))
    assert (images.left == 255).mean() < 0.001
    assert 90 < np.median(images.left) < 200


def test_automatic_exposure_follows_a_change_of_light_without_a_jump_and_ends_where_it_is_metered() -> None:
    rng = np.random.default_rng(0)
    dim = rng.uniform(0.1, 0.4, (64, 64)).astype(np.float32)
    exposure, fresh = AutomaticExposure(30.0), AutomaticExposure(30.0)
    before = exposure.gain(dim)
    gains = [exposure.gain(3.0 * dim) for _ in range(90)]
    steps = np.abs(np.diff(np.log([before, *gains])))
    assert steps.max() < 0.2
    assert gains[-1] == pytest.approx(fresh.gain(3.0 * dim), rel=1e-3)


def test_a_fixed_exposure_is_the_square_of_the_gain_on_grey_levels(room: World) -> None:
    def median(exposure: float) -> float:
        camera = camera_with(exposure=exposure, noise=0.0, **SMALL)
        return float(np.median(StereoCameraSensor(camera, room, 0).measure(0, Motion(0, SE2(-2.0, 0.0))).left))

    assert median(0.4) == pytest.approx(2.0 * median(0.1), abs=2.0)


def test_left_and_right_of_a_flat_wall_are_equally_bright(room: World) -> None:
    images = StereoCameraSensor(camera_with(), room, 0).measure(0, Motion(0, SE2(-2.0, 0.0, np.pi)))
    ahead = slice(200, 280), slice(300, 450)
    assert images.left[ahead].mean() == pytest.approx(images.right[ahead].mean(), abs=0.5)


def test_the_pinhole_is_the_published_one() -> None:
    pinhole = pinhole_of(camera_with())
    assert pinhole.focal == pytest.approx(360.065, abs=0.001)
    assert pinhole.center == (376.0, 240.0)
    assert (pinhole.near, pinhole.far) == (0.05, 50.0)
