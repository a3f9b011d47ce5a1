import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.navigation.velocity_smoother import Velocity, VelocitySmoother
from taskslam.robot import load_robot

DRIVE = load_robot("turtlebot2").drive


def test_a_start_is_ramped_by_the_drive_acceleration():
    smoother = VelocitySmoother(DRIVE, 0.05)
    commands = [smoother.step(Velocity(0.3, 0.0)).linear for _ in range(12)]
    assert commands[0] == pytest.approx(0.03)  # 0.6 m/s^2 * 0.05 s
    assert commands[9] == pytest.approx(0.3)
    assert commands[11] == 0.3


def test_a_ramp_keeps_the_direction_of_change():
    smoother = VelocitySmoother(DRIVE, 0.05)
    first = smoother.step(Velocity(0.3, 0.6))
    assert first.angular / first.linear == pytest.approx(2.0)


def test_reset_stands_still():
    smoother = VelocitySmoother(DRIVE, 0.05)
    smoother.step(Velocity(0.3, 1.0))
    smoother.reset()
    assert smoother.step(Velocity()) == Velocity(0.0, 0.0)


speeds = st.floats(-10, 10)


@given(st.lists(st.tuples(speeds, speeds), min_size=1, max_size=30))
def test_no_step_asks_for_more_than_the_drive_can_do(targets):
    smoother = VelocitySmoother(DRIVE, 0.05)
    last = Velocity()
    for linear, angular in targets:
        now = smoother.step(Velocity(linear, angular))
        assert abs(now.linear - last.linear) <= DRIVE.max_linear_acceleration * 0.05 + 1e-12
        assert abs(now.angular - last.angular) <= DRIVE.max_angular_acceleration * 0.05 + 1e-12
        assert -DRIVE.max_backward <= now.linear <= DRIVE.max_linear
        assert abs(now.angular) <= DRIVE.max_angular
        last = now
