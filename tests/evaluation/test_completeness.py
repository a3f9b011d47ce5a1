import pytest

from taskslam.evaluation.completeness import completeness, is_complete


@pytest.mark.parametrize(("visits", "rounds", "expected"), [(5, 5, True), (4, 5, False), (0, 5, False), (0, 0, False)])
def test_a_waypoint_is_complete_only_if_reached_every_round(visits, rounds, expected):
    assert is_complete(visits, rounds) is expected


def test_completeness_is_over_planned_waypoints():
    assert completeness([True, True, False, False]) == 0.5
    assert completeness([False]) == 0.0


def test_one_waypoint_of_the_published_benchmark_is_a_64th():
    assert completeness([True] + [False] * 63) == pytest.approx(0.015625)


def test_a_sequence_without_waypoints_has_no_completeness():
    with pytest.raises(ValueError, match="without waypoints"):
        completeness([])
