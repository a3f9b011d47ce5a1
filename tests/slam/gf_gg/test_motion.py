"""What the wheels say of the camera's motion, where they are heard."""

import numpy as np

from taskslam.geometry import OPTICAL_IN_BODY, SE2, invert_se3
from taskslam.measurements import WheelOdometry
from taskslam.slam.gf_gg.motion import Motion
from taskslam.slam.vision.se3 import exp_se3

T_BASE_CAMERA = SE2(0.15, 0.05, 0.1).matrix() @ OPTICAL_IN_BODY
PERIOD = 33_000_000


def test_the_wheels_say_how_the_camera_moves():
    motion, poses = Motion(0.0, T_BASE_CAMERA), (SE2(1.0, 2.0, 0.3), SE2(1.1, 2.02, 0.4))
    for n, pose in enumerate(poses):
        motion.hear(WheelOdometry(n * PERIOD, pose, 0.0, 0.0))
    cameras = [pose.matrix() @ T_BASE_CAMERA for pose in poses]
    np.testing.assert_allclose(motion.expected(0, PERIOD)[0], invert_se3(cameras[0]) @ cameras[1], atol=1e-9)


def test_without_the_prior_they_are_not_heard():
    motion = Motion(0.0)
    motion.hear(WheelOdometry(0, SE2(), 0.0, 0.0))
    motion.hear(WheelOdometry(PERIOD, SE2(0.1, 0.0, 0.0), 0.0, 0.0))
    np.testing.assert_array_equal(motion.expected(0, PERIOD)[0], np.eye(4))


def test_it_goes_on_as_it_did_unless_it_was_found_elsewhere():
    step = exp_se3(np.array([0.0, 0.0, 0.01, 0.0, 0.02, 0.0]))
    motion = Motion(0.0)
    motion.learn(step, 0, PERIOD, jumped=False)
    np.testing.assert_allclose(motion.expected(PERIOD, 2 * PERIOD)[0], step, atol=1e-5)
    np.testing.assert_allclose(motion.ahead(15), np.linalg.matrix_power(step, 15))
    motion.learn(step, PERIOD, 2 * PERIOD, jumped=True)
    np.testing.assert_array_equal(motion.expected(2 * PERIOD, 3 * PERIOD)[0], np.eye(4))
    np.testing.assert_array_equal(motion.ahead(15), np.eye(4))
