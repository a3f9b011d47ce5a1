import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.report.simplify import simplified

lines = st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=2, max_size=60).map(np.array)


def distance(point, line):
    """From a point to the nearest part of an open line."""
    a, b = line[:-1], line[1:]
    length = np.maximum(((b - a) ** 2).sum(axis=1), 1e-300)
    share = np.clip(((point - a) * (b - a)).sum(axis=1) / length, 0, 1)
    return np.hypot(*(a + share[:, None] * (b - a) - point).T).min()


@given(lines, st.floats(0.01, 5))
def test_no_point_moves_off_the_line_by_more_than_the_tolerance(points, tolerance):
    kept = simplified(points, tolerance)
    assert max(distance(point, kept) for point in points) <= tolerance + 1e-9
    assert kept[0].tolist() == points[0].tolist()
    assert kept[-1].tolist() == points[-1].tolist()


def test_a_straight_line_keeps_its_ends_only():
    points = np.column_stack([np.linspace(0, 9, 400), np.linspace(1, 4, 400)])
    assert len(simplified(points, 0.1)) == 2


def test_a_line_that_comes_back_to_its_start_keeps_its_far_end():
    there_and_back = np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 0.0]])
    assert simplified(there_and_back, 0.5).tolist() == there_and_back.tolist()


@pytest.mark.parametrize("tolerance", [0.01, 0.1])
def test_a_circle_keeps_about_the_points_that_its_sagitta_asks_for(tolerance):
    turn = np.linspace(0, 2 * np.pi, 5000)
    kept = simplified(np.column_stack([np.cos(turn), np.sin(turn)]), tolerance)
    fewest = np.pi / np.arccos(1 - tolerance)
    assert fewest * 0.9 <= len(kept) <= 3 * fewest + 2
