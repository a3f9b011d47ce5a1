import numpy as np
import pytest

from taskslam.measurements import NANOSECONDS, ImuSamples
from taskslam.slam.inertial.rotations import exp_so3, log_so3
from taskslam.slam.vision.prediction import Prediction

MS = NANOSECONDS // 1000


def turning(prediction, until_ms, rate=(0.0, 0.0, 0.8), period_ms=10, since_ms=0):
    for ms in range(since_ms + period_ms, until_ms + 1, period_ms):
        prediction.hear(ImuSamples(ms * MS, np.array([ms * MS]), np.array([rate]), np.zeros((1, 3))))


def test_without_a_past_no_motion_is_expected():
    np.testing.assert_array_equal(Prediction(0.5).motions(0, 33 * MS), [np.eye(4), np.eye(4)])


def test_the_gyro_tells_the_rotation_in_the_cameras_axes():
    R_camera_imu = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    prediction = Prediction(0.5, R_camera_imu)
    turning(prediction, 100)
    for since, stamp in ((0, 33), (33, 67), (67, 100), (0, 100), (67, 104)):
        likeliest, *others = prediction.motions(since * MS, stamp * MS)
        np.testing.assert_allclose(log_so3(likeliest[:3, :3]), R_camera_imu @ [0, 0, 0.8e-3 * (stamp - since)])
        assert len(others) == 2


def test_half_of_the_old_velocity_is_kept():
    prediction = Prediction(0.5)
    step = np.eye(4)
    step[:3, 3] = 0.0, 0.0, 0.03
    step[:3, :3] = exp_so3(np.array([0.0, 0.02, 0.0]))
    prediction.learn(step, 0, 100 * MS)
    predicted = prediction.motions(100 * MS, 200 * MS)[0]
    np.testing.assert_allclose(predicted[:3, 3], [0, 0, 0.015])
    np.testing.assert_allclose(log_so3(predicted[:3, :3]), [0, 0.01, 0])
    prediction.rest()
    np.testing.assert_array_equal(prediction.motions(100 * MS, 200 * MS)[0], np.eye(4))


@pytest.mark.parametrize("until_ms", [0, 40])
def test_a_gyro_that_falls_silent_is_not_relied_on(until_ms):
    prediction = Prediction(0.5, np.eye(3))
    turning(prediction, until_ms)
    assert len(prediction.motions(33 * MS, 133 * MS)) == 2
    turning(prediction, 133, since_ms=max(until_ms, 33) + 60)
    assert len(prediction.motions(33 * MS, 133 * MS)) == 2


def test_samples_that_are_no_numbers_are_passed_over():
    prediction = Prediction(0.5, np.eye(3))
    turning(prediction, 20)
    turning(prediction, 30, rate=(np.nan, 0, 0), since_ms=20)
    turning(prediction, 40, since_ms=30)
    np.testing.assert_allclose(log_so3(prediction.motions(0, 40 * MS)[0][:3, :3]), [0, 0, 0.032])


def test_used_samples_are_forgotten():
    prediction = Prediction(0.5, np.eye(3))
    for frame in range(1, 100):
        turning(prediction, frame * 40, since_ms=frame * 40 - 40)
        assert len(prediction.motions((frame * 40 - 40) * MS, frame * 40 * MS)) == 3
        prediction.forget(frame * 40 * MS)
    assert not prediction._stamps


def test_a_velocity_is_not_carried_over_a_long_gap():
    prediction = Prediction(0.0)
    step = np.eye(4)
    step[2, 3] = 0.03
    prediction.learn(step, 0, 100 * MS)
    np.testing.assert_allclose(prediction.motions(0, 60 * NANOSECONDS)[0][2, 3], 0.15)
