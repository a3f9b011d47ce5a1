"""Turns of the other side: waited for where it drives, shortly where it stands, not at all once it is silent."""

import pytest

from taskslam.benchmark.pace import Pace

PERIOD, PATIENCE = 0.05, 10.0


class Wall:
    """A clock that is set."""

    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def wall():
    return Wall()


def pace(wall, factor=None):
    return Pace(PERIOD, factor, PATIENCE, wall)


def left_after(made, wall, seconds):
    wall.now += seconds
    return made.left_s()


def test_time_goes_on_in_real_time_before_anybody_commands(wall):
    made = pace(wall)
    made.passed()
    assert made.left_s() == pytest.approx(PERIOD)
    assert left_after(made, wall, 0.04) == pytest.approx(0.01)
    assert left_after(made, wall, 0.02) == 0.0
    assert not made.passed()


def known(wall, every=1, moving=True):
    """In step with a side that has commanded every so many periods for a while, and has just done so."""
    made = pace(wall)
    for _ in range(4):
        made.commanded(moving)
        for _ in range(every):
            made.passed()
    made.commanded(moving)
    return made


def test_a_command_lets_the_period_pass_at_once(wall):
    made = known(wall)
    assert made.left_s() == 0.0


@pytest.mark.parametrize(("moving", "longest"), [(True, PATIENCE), (False, 1.0)])
def test_the_next_command_is_waited_for_long_only_under_way(wall, moving, longest):
    made = known(wall, moving=moving)
    made.passed()
    assert left_after(made, wall, longest - 0.1) == pytest.approx(0.1)
    assert left_after(made, wall, 0.2) == 0.0
    assert made.passed() is moving
    assert made.vain == moving


def test_who_commands_every_few_periods_is_waited_for_when_it_is_due(wall):
    made = known(wall, every=4)
    for _ in range(4):
        assert made.left_s() == 0.0
        assert not made.passed()
    assert made.left_s() == pytest.approx(PATIENCE)
    made.commanded(moving=True)
    assert made.left_s() == 0.0
    assert made.vain == 0


def test_who_commands_rarely_or_for_the_first_time_gets_real_time(wall):
    first, rare = pace(wall), known(wall, every=40)
    first.commanded(moving=True)
    first.passed()
    rare.passed()
    assert 0 < first.left_s() <= PERIOD
    assert 0 < rare.left_s() <= PERIOD


def test_after_a_wait_in_vain_time_goes_on_in_real_time_until_the_next_command(wall):
    made = known(wall)
    made.passed()
    wall.now += PATIENCE + 1
    assert made.passed()
    for _ in range(3):
        assert 0 < made.left_s() <= PERIOD
        wall.now += PERIOD
        assert not made.passed()
    made.commanded(moving=True)
    made.passed()
    assert made.left_s() == pytest.approx(PATIENCE)
    assert made.vain == 1


def test_who_had_the_robot_put_down_is_waited_for_and_who_is_gone_is_not(wall):
    made = pace(wall)
    made.placed()
    assert made.left_s() == pytest.approx(120.0)
    made.alone()
    assert made.left_s() <= PERIOD


def test_a_factor_of_real_time_does_not_look_at_commands(wall):
    made = pace(wall, factor=2.0)
    wall.now += 1.0
    made.passed()
    made.commanded(moving=True)
    assert made.left_s() == pytest.approx(PERIOD / 2)
    due = [made.left_s()]
    for _ in range(20):  # a little late each time, on the whole in time
        wall.now += made.left_s() + 0.002
        made.passed()
        due.append(made.left_s())
    assert due[-1] == pytest.approx(PERIOD / 2 - 0.002)
    assert made.vain == 0


def test_who_is_far_behind_a_factor_does_not_hurry_afterwards(wall):
    made = pace(wall, factor=1.0)
    made.passed()
    wall.now += 30.0
    made.passed()
    assert made.left_s() == pytest.approx(PERIOD)
