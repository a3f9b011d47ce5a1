import numpy as np
import pytest

from taskslam.slam.inertial.still_start import standstill

GYRO_NOISE, ACCEL_NOISE = 0.00276, 0.03924
BIAS = np.array([3e-4, -2e-4, 5e-4])


@pytest.fixture
def samples():
    dice = np.random.default_rng(1)
    up = np.array([0.1, -0.2, 9.79])
    return BIAS + GYRO_NOISE * dice.normal(size=(200, 3)), up + ACCEL_NOISE * dice.normal(size=(200, 3)), up


def test_gravity_and_bias_of_a_robot_that_stands(samples) -> None:
    rates, forces, up = samples
    found = standstill(rates, forces, GYRO_NOISE, ACCEL_NOISE, 9.81)
    assert found is not None
    np.testing.assert_allclose(found.gyro_bias, BIAS, atol=4 * GYRO_NOISE / np.sqrt(200))
    assert np.linalg.norm(found.gravity) == pytest.approx(9.81)
    np.testing.assert_allclose(-found.gravity / 9.81, up / np.linalg.norm(up), atol=1.5e-3)
    assert found.scale == pytest.approx(9.81 / np.linalg.norm(up), rel=1e-3)


@pytest.mark.parametrize("what", ["turns", "starts to turn", "shakes", "falls"])
def test_a_robot_that_moves_has_no_standstill(samples, what) -> None:
    rates, forces, _ = samples
    if what == "turns":
        rates = rates + np.array([0, 0, 0.3])
    elif what == "starts to turn":
        rates = rates + np.linspace(0, 0.15, 200)[:, None] * np.array([0, 0, 1])
    elif what == "shakes":
        forces = forces + np.sin(np.arange(200))[:, None] * np.array([1, 0, 0])
    else:
        forces = 0.1 * forces
    assert standstill(rates, forces, GYRO_NOISE, ACCEL_NOISE, 9.81) is None
