"""Propagation against gtsam's preintegration, numerical differences, and a motion that has a formula."""

import gtsam
import numpy as np
import pytest

from taskslam.slam.inertial.propagation import SIZE, move, transition
from taskslam.slam.inertial.rotations import exp_so3, log_so3

G = np.array([0.0, 0.0, -9.81])


@pytest.fixture
def readings():
    """(rate, force) at 100 Hz for two seconds of wild motion."""
    t = np.arange(200)[:, None] * 0.01
    rates = np.hstack([0.5 * np.sin(3 * t), 0.8 * np.cos(2 * t), 1.5 * np.sin(t)])
    forces = np.hstack([np.sin(2 * t), np.cos(3 * t), 9.81 + 0.5 * np.sin(5 * t)])
    return rates, forces


def integrated(R, p, v, rates, forces, dt):
    for rate, force in zip(rates, forces, strict=True):
        R, p, v = move(R, p, v, rate, force, G, dt)
    return R, p, v


def preintegrated(start, rates, forces, dt, parts):
    """By gtsam, each sample in so many parts."""
    samples = gtsam.PreintegratedImuMeasurements(gtsam.PreintegrationParams.MakeSharedU(9.81))
    for rate, force in zip(rates, forces, strict=True):
        for _ in range(parts):
            samples.integrateMeasurement(force, rate, dt / parts)
    R, p, v = start
    state = samples.predict(gtsam.NavState(gtsam.Rot3(R), gtsam.Point3(p), v), gtsam.imuBias.ConstantBias())
    return np.vstack([state.position(), state.velocity()])


def test_two_seconds_equal_gtsams_preintegration(readings) -> None:
    """Its steps are of first order: two step sizes, extrapolated to none."""
    rates, forces = readings
    start = exp_so3(np.array([0.2, -0.1, 0.7])), np.array([1.0, 2.0, 3.0]), np.array([0.3, -0.2, 0.1])
    R, p, v = integrated(*start, rates, forces, 0.01)
    coarse, fine = (preintegrated(start, rates, forces, 0.01, parts) for parts in (20, 40))
    assert np.abs(fine - np.vstack([p, v])).max() < 2e-3
    np.testing.assert_allclose(np.vstack([p, v]), 2 * fine - coarse, atol=3e-6)
    turned = gtsam.Rot3(start[0])
    for rate in rates:
        turned = turned * gtsam.Rot3.Expmap(rate * 0.01)
    np.testing.assert_allclose(R, turned.matrix(), atol=1e-12)


def test_a_piece_may_be_cut_anywhere(readings) -> None:
    """Exact integration does not depend on the steps."""
    rate, force = np.array([0.5, -2.0, 3.0]), np.array([1.0, 0.5, 9.0])
    start = exp_so3(np.array([0.2, -0.1, 0.7])), np.zeros(3), np.array([0.3, -0.2, 0.1])
    whole = move(*start, rate, force, G, 0.5)
    cut = move(*move(*start, rate, force, G, 0.0123), rate, force, G, 0.5 - 0.0123)
    for one, two in zip(whole, cut, strict=True):
        np.testing.assert_allclose(one, two, atol=1e-10)


@pytest.mark.parametrize("rate", [np.array([0.3, -0.5, 0.8]), np.array([2.0, 9.0, -5.0]), np.zeros(3)])
def test_transition_is_the_derivative_of_the_motion(rate) -> None:
    R, p, v = exp_so3(np.array([0.2, -0.1, 0.7])), np.array([1.0, 2.0, 3.0]), np.array([0.3, -0.2, 0.1])
    force, dt, step = np.array([1.0, 0.5, 9.0]), 0.01, 1e-6

    def after(d):
        moved = move(R @ exp_so3(d[:3]), p + d[3:6], v + d[6:9], rate - d[9:12], force - d[12:15], G, dt)
        plain = move(R, p, v, rate, force, G, dt)
        parts = [log_so3(plain[0].T @ moved[0]), moved[1] - plain[1], moved[2] - plain[2], d[9:12], d[12:15]]
        return np.concatenate(parts)

    numerical = np.stack([(after(step * e) - after(-step * e)) / (2 * step) for e in np.eye(SIZE)], axis=1)
    tolerance = np.full((SIZE, SIZE), 1e-8)
    tolerance[3:9, 9:12] = 0.6 * dt**2 * np.linalg.norm(force)  # left out, and said so
    assert (np.abs(transition(R, rate, force, dt) - numerical) < tolerance).all()


def test_delta_angles_and_velocities_of_a_circle_lead_round_it() -> None:
    """A turn at 0.8 rad/s and 0.3 m/s: after a whole round the robot is where it was."""
    rate, speed = 0.8, 0.3
    count = 1000
    dt = 2 * np.pi / rate / count
    force = np.array([0.0, speed * rate, 9.81])
    R, p, _ = integrated(
        np.eye(3), np.zeros(3), np.array([speed, 0.0, 0.0]), [np.array([0, 0, rate])] * count, [force] * count, dt
    )
    np.testing.assert_allclose(p, 0.0, atol=1e-10)
    np.testing.assert_allclose(R, np.eye(3), atol=1e-12)
