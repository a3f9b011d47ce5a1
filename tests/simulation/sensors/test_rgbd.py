"""Depth of the pixels of an image: where the world is, within the noise of a stereo pair, and nothing out of range."""

import numpy as np
import pytest

from taskslam.benchmark.conformance_eyes import conformance_world
from taskslam.geometry import OPTICAL_IN_BODY, SE2
from taskslam.measurements import NANOSECONDS, RgbdImages, Sensor, StereoImages
from taskslam.robot import load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.rgbd import RgbdCameraSensor, measured_depth
from taskslam.simulation.simulator import Simulator
from taskslam.slam.conformance.room import spatial_distances

POSES = (SE2(0.0, -1.8, 0.3), SE2(2.0, 1.2, 2.5), SE2(-2.4, 0.9, -1.9))
WHOLE = load_robot("turtlebot2_d435i")


def camera_with(**values):
    return WHOLE.rig.rgbd.model_copy(update={"width": 160, "height": 120, **values})


def said(simulator, seconds=1.0):
    return [m for m in simulator.advance(simulator.now + round(seconds * NANOSECONDS)) if isinstance(m, RgbdImages)]


@pytest.fixture(scope="module")
def world():
    return conformance_world()


def test_every_pixels_depth_is_where_its_ray_meets_the_room(world):
    camera = camera_with(depth_noise=0.0, depth_resolution=0.0)
    device = RgbdCameraSensor(camera, world, 0)
    for pose in POSES:
        depth = device.measure(0, Motion(0, pose)).depth
        rows, columns = np.mgrid[2:118:7, 2:158:7]
        f, (cx, cy) = camera.focal_length, camera.center
        optical = np.stack([(columns - cx) / f, (rows - cy) / f, np.ones(rows.shape)], axis=-1).reshape(-1, 3)
        T_room_optical = pose.matrix() @ camera.mount.matrix() @ OPTICAL_IN_BODY
        along = np.linalg.norm(optical, axis=1)
        origins = np.broadcast_to(T_room_optical[:3, 3], optical.shape)
        distances = spatial_distances(origins, optical @ T_room_optical[:3, :3].T / along[:, None])
        error = np.abs(depth[rows.ravel(), columns.ravel()] - distances / along)
        assert np.median(error) < 1e-3
        assert (error < 0.02).mean() > 0.97  # but for pixels on an edge


def test_noise_grows_with_the_square_of_the_depth():
    camera = camera_with(depth_noise=0.004, depth_resolution=0.0, depth_max=100.0)
    draws = np.random.default_rng(1).standard_normal((300, 400), dtype=np.float32)
    for depth in (0.5, 1.0, 2.0, 4.0):
        readings = measured_depth(np.full(draws.shape, depth, np.float32), draws, camera)
        assert readings.std() == pytest.approx(0.004 * depth**2, rel=0.01)
        assert readings.mean() == pytest.approx(depth, abs=0.0002 * depth**2)


def test_the_presets_noise_is_that_of_its_stereo_pair():
    focal = 424.0 / np.tan(np.radians(87.0) / 2.0)  # the pair matches at 848 columns
    assert WHOLE.rig.rgbd.depth_noise == pytest.approx(0.08 / (focal * WHOLE.rig.rgbd.baseline), rel=0.01)


def test_depth_is_whole_millimetres_within_its_limits_and_zero_elsewhere(world):
    device = RgbdCameraSensor(camera_with(depth_min=1.0, depth_max=3.0), world, 0)
    true = RgbdCameraSensor(camera_with(depth_noise=0.0, depth_resolution=0.0), world, 0)
    for pose in POSES:
        depth, there = device.measure(0, Motion(0, pose)).depth, true.measure(0, Motion(0, pose)).depth
        seen = depth > 0
        assert seen.any()
        assert (depth[seen] >= 1.0).all()
        assert (depth[seen] <= 3.0).all()
        np.testing.assert_allclose(depth[seen] * 1000, np.round(depth[seen] * 1000), atol=1e-3)
        assert not seen[(there < 1.0) | (there > 3.0)].any()
        assert seen[(there > 1.1) & (there < 2.8)].all()


def test_the_sky_has_no_depth(make_world):
    open_floor = make_world([(-4.0, -3.0, -0.2, 4.0, 3.0, 0.0)])
    depth = RgbdCameraSensor(camera_with(), open_floor, 0).measure(0, Motion(0, SE2())).depth
    assert not depth[:50].any()
    assert depth[100:].all()


@pytest.mark.parametrize("color", [True, False])
def test_it_rides_along_at_its_rate_in_grey_or_colour(room, color):
    rig = WHOLE.rig.model_copy(update={"rgbd": camera_with(rate=12.5, color=color)})
    frames = said(Simulator(room, WHOLE.model_copy(update={"rig": rig}), 0, sensors={Sensor.RGBD_IMAGES}))
    assert [frame.stamp for frame in frames] == [80_000_000 * (k + 1) for k in range(12)]
    assert frames[0].image.shape == (120, 160, 3)[: 3 if color else 2]
    assert (frames[0].depth.shape, frames[0].depth.dtype) == ((120, 160), np.float32)


def test_the_same_seed_gives_the_same_bytes_and_its_noise_is_its_own(room):
    rig = WHOLE.rig.model_copy(update={"rgbd": camera_with()})
    robot = WHOLE.model_copy(update={"rig": rig})

    def frames(seed, *others):
        return said(Simulator(room, robot, seed, sensors={Sensor.RGBD_IMAGES, *others}), 0.2)

    one = frames(1)
    for same in (frames(1), frames(1, Sensor.LASER_SCAN, Sensor.IMU)):
        assert [(m.image.tobytes(), m.depth.tobytes()) for m in one] == [
            (m.image.tobytes(), m.depth.tobytes()) for m in same
        ]
    other = frames(2)
    assert one[0].depth.tobytes() != other[0].depth.tobytes()
    assert one[0].image.tobytes() != other[0].image.tobytes()


def test_it_changes_nothing_that_the_others_say(room):
    def pairs(*sensors):
        simulator = Simulator(room, WHOLE, 1, sensors={Sensor.STEREO_IMAGES, *sensors})
        return [m.left.tobytes() for m in simulator.advance(NANOSECONDS // 10) if isinstance(m, StereoImages)]

    assert pairs() == pairs(Sensor.RGBD_IMAGES)
