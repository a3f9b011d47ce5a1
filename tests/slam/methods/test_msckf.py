"""The method `msckf` as a guest: its card, its refusals, and that no pair waits for a compiler."""

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.measurements import ImuSamples, LaserScan, Sensor, StereoImages
from taskslam.robot import SensorRig
from taskslam.slam.inertial import propagation, rotations
from taskslam.slam.methods.msckf import Msckf
from taskslam.slam.msckf import filter as msckf_filter
from taskslam.slam.msckf import observation, two_point_ransac
from taskslam.slam.vision import cholesky, stereo_matching

pytest.importorskip("cv2", reason="needs the extra `msckf`")
ROOMS = (propagation, rotations, msckf_filter, observation, two_point_ransac, cholesky, stereo_matching)


def test_the_card_declares_both_its_sensors():
    assert Msckf.card.sensors == (Sensor.STEREO_IMAGES, Sensor.IMU)
    assert Msckf.card.summary.startswith("independent implementation of")
    assert Msckf.card.needs_still_start > 2.0
    assert not Msckf.card.can_save_map


def test_a_robot_without_cameras_or_imu_is_refused(rig):
    with pytest.raises(InputError, match="msckf needs a stereo camera"):
        Msckf().start(SensorRig(odometry=rig.odometry, imu=rig.imu))
    with pytest.raises(InputError, match="msckf needs an IMU"):
        Msckf().start(SensorRig(odometry=rig.odometry, stereo=rig.stereo))


def test_pictures_too_small_for_the_pyramid_are_refused(rig):
    small = rig.stereo.model_copy(update={"width": 100, "height": 80})
    with pytest.raises(InputError, match="100 x 80 are too small for 4 levels"):
        Msckf().start(rig.model_copy(update={"stereo": small}))


def samples(stamp, rig):
    return ImuSamples(stamp, np.array([stamp]), np.zeros((1, 3)), np.array([[0.0, 0.0, 9.81]]))


def test_only_pairs_are_answered(rig):
    method = Msckf()
    method.start(rig)
    assert method.feed(LaserScan(0, np.ones(4, np.float32), 0.0, 0.1, 0.1, 10.0)) is None
    assert method.feed(samples(1, rig)) is None


@pytest.mark.parametrize("constraints", [True, False])
def test_nothing_is_compiled_after_the_start(rig, constraints):
    """Each kernel knows after the warm-up every type of argument that it meets on the road."""
    method = Msckf(observability_constraints=constraints, max_cam_state_size=6, still_start=0.5)
    method.start(rig)
    kernels = {f.__name__: f for room in ROOMS for f in vars(room).values() if hasattr(f, "signatures")}
    assert len(kernels) > 10
    before = {name: len(kernel.signatures) for name, kernel in kernels.items()}
    tiles = np.random.default_rng(0).integers(0, 256, (60, 160))
    wall = np.kron(tiles, np.ones((8, 8))).astype(np.uint8)
    wall.setflags(write=False)
    for stamp in range(10_000_000, 1_000_000_000, 10_000_000):
        method.feed(samples(stamp, rig))
    statuses = []
    for step in range(40):
        stamp = 1_000_000_000 + step * 33_000_000
        method.feed(samples(stamp, rig))
        at = step if step < 20 else step + 100 if step > 25 else None
        views = [np.zeros((480, 752), np.uint8) if at is None else wall[:, at + d : at + d + 752] for d in (16, 32)]
        statuses.append(method.feed(StereoImages(stamp, *views)).status)
    assert "tracking" in statuses[:20]
    assert {name: len(kernel.signatures) for name, kernel in kernels.items()} == before
