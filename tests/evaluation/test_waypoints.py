import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from taskslam.evaluation import waypoints
from taskslam.evaluation.upstream import ALL
from taskslam.geometry import SE2, compose

# Protocol 5.2: five poses, a goal, and what every formula gives for them.
VISITS = np.array([(0, 0, 0), (0.1, 0, 0.1), (0, 0.1, -0.1), (-0.1, 0, 0.05), (0, -0.1, -0.05)])
GOAL = np.array([0.05, 0, 0.02])

coordinate = st.floats(-20, 20)
visits_strategy = st.integers(2, 7).flatmap(lambda n: arrays(np.float64, (n, 3), elements=coordinate))


def test_golden_vector_of_the_paper_definitions():
    assert waypoints.position_accuracy(VISITS, GOAL) == pytest.approx(0.09472136, abs=1e-8)
    assert waypoints.orientation_accuracy(VISITS, GOAL) == pytest.approx(0.064, abs=1e-12)
    assert waypoints.position_precision(VISITS) == pytest.approx(0.08, abs=1e-12)
    assert waypoints.orientation_precision(VISITS) == pytest.approx(0.06, abs=1e-12)
    assert math.degrees(waypoints.orientation_precision(VISITS)) == pytest.approx(3.43775, abs=1e-5)
    assert waypoints.position_precision_rms(VISITS) == pytest.approx(0.08944272, abs=1e-8)


def test_golden_vector_of_the_published_code():
    published = waypoints.orientation_precision(VISITS, deviations=ALL)
    assert published == pytest.approx(0.09772826, abs=1e-8)
    assert math.degrees(published) == pytest.approx(5.59942, abs=1e-5)
    assert waypoints.orientation_accuracy(VISITS, GOAL, deviations=ALL) == pytest.approx(0.064, abs=1e-7)


def test_the_published_heading_precision_is_about_1_6_times_too_large():
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(500):
        visits = np.zeros((5, 3))
        visits[:, 2] = rng.normal(0, math.radians(5), 5)
        ratios.append(waypoints.orientation_precision(visits, deviations=ALL) / waypoints.orientation_precision(visits))
    assert np.mean(ratios) == pytest.approx(1.62, abs=0.08)


def test_the_published_heading_accuracy_loses_headings_that_equal_the_goal():
    theta = next(a for a in np.linspace(0, 3, 1000) if np.cos(a) * math.cos(a) + np.sin(a) * math.sin(a) > 1)
    visits = np.array([[0.0, 0.0, theta], [0.0, 0.0, theta + 0.2]])
    goal = np.array([0.0, 0.0, theta])
    assert waypoints.orientation_accuracy(visits, goal) == pytest.approx(0.1)
    assert waypoints.orientation_accuracy(visits, goal, deviations=ALL) == pytest.approx(0.2)


def test_headings_are_compared_across_the_seam():
    visits = np.array([[0, 0, math.pi - 0.1], [0, 0, -math.pi + 0.1]])
    assert waypoints.orientation_precision(visits) == pytest.approx(0.1)
    assert waypoints.orientation_accuracy(visits, np.array([0, 0, -3 * math.pi])) == pytest.approx(0.1)
    assert abs(waypoints.mean_pose(visits)[2]) == pytest.approx(math.pi)


def test_a_bias_enters_accuracy_and_not_precision():
    """Protocol 7.3 #9: bias 15 cm and 3 cm of scatter per axis give e 15.3 and E 3.4 cm."""
    rng = np.random.default_rng(4)
    trials = [np.column_stack([rng.normal((0.15, 0), 0.03, (5, 2)), np.zeros(5)]) for _ in range(2000)]
    e = np.mean([waypoints.position_accuracy(visits, np.zeros(3)) for visits in trials])
    E = np.mean([waypoints.position_precision(visits) for visits in trials])
    assert e == pytest.approx(0.153, abs=0.001)
    assert pytest.approx(0.034, abs=0.001) == E


def test_one_visit_has_accuracy_but_no_precision():
    one = VISITS[:1]
    assert waypoints.position_accuracy(one, GOAL) == pytest.approx(0.05)
    assert waypoints.orientation_accuracy(one, GOAL) == pytest.approx(0.02)
    for metric in (waypoints.position_precision, waypoints.position_precision_rms, waypoints.orientation_precision):
        assert math.isnan(metric(one))


def test_no_visit_has_neither():
    none = np.empty((0, 3))
    assert math.isnan(waypoints.position_accuracy(none, GOAL))
    assert math.isnan(waypoints.orientation_accuracy(none, GOAL))
    assert math.isnan(waypoints.position_precision(none))
    assert np.isnan(waypoints.mean_pose(none)).all()


@given(visits_strategy, coordinate, coordinate, st.floats(-7, 7))
def test_precision_does_not_depend_on_the_frame(visits, x, y, theta):
    moved = compose(SE2(x, y, theta).array(), visits)
    assert waypoints.position_precision(moved) == pytest.approx(waypoints.position_precision(visits), abs=1e-9)
    resultant = np.hypot(np.cos(visits[:, 2]).mean(), np.sin(visits[:, 2]).mean())
    if resultant > 1e-3:  # opposite headings have no mean
        assert waypoints.orientation_precision(moved) == pytest.approx(
            waypoints.orientation_precision(visits), abs=1e-9
        )


@given(visits_strategy, coordinate, coordinate, st.floats(-7, 7))
def test_accuracy_does_not_depend_on_the_frame(visits, x, y, theta):
    T = SE2(x, y, theta).array()
    moved, goal = compose(T, visits), compose(T, GOAL)
    assert waypoints.position_accuracy(moved, goal) == pytest.approx(
        waypoints.position_accuracy(visits, GOAL), abs=1e-9
    )


@given(visits_strategy, st.randoms())
def test_the_order_of_rounds_does_not_matter(visits, random):
    order = list(range(len(visits)))
    random.shuffle(order)
    assert waypoints.position_precision(visits[order]) == pytest.approx(waypoints.position_precision(visits), abs=1e-9)


@given(visits_strategy)
def test_rms_is_never_below_the_mean(visits):
    assert waypoints.position_precision_rms(visits) >= waypoints.position_precision(visits) - 1e-12


@given(visits_strategy, st.floats(1e-3, 1e3))
def test_precision_is_measured_in_the_unit_of_the_positions(visits, unit):
    scaled = visits * [unit, unit, 1.0]
    rounding = 16 * np.finfo(float).eps * unit * np.abs(visits[:, :2]).max()  # of the mean: arrivals far off may agree
    expected = pytest.approx(unit * waypoints.position_precision(visits), rel=1e-9, abs=1e-12 + rounding)
    assert waypoints.position_precision(scaled) == expected
    assert waypoints.orientation_precision(scaled) == waypoints.orientation_precision(visits)
