import json

import pytest

from taskslam.report.page.page_data import page_data
from taskslam.report.page.views import run_view, scenario_view
from taskslam.report.results import read_results


@pytest.fixture
def told(make_run, tmp_path):
    """The data of one run, and its metrics."""

    def tell(**options):
        make_run(**options)
        (run,) = read_results([tmp_path / "results"]).runs
        return json.loads(page_data([scenario_view([run_view("run-1", run)], False)])), run.metrics

    return tell


def test_arrivals_lie_ahead_and_to_the_left_of_the_goal(told):
    data, metrics = told()
    waypoint, measured = data["runs"]["run-1"]["waypoints"][1], metrics.waypoints[1]
    distances = [(ahead**2 + left**2) ** 0.5 for _, ahead, left, *_ in waypoint["arrivals"]]
    assert sum(distances) / 3 == pytest.approx(measured.position.accuracy_m, abs=2e-5)
    # The synthetic robot stops a decimetre short of each goal.
    assert [ahead for _, ahead, *_ in waypoint["arrivals"]] == pytest.approx([-0.1] * 3, abs=0.05)
    assert waypoint["E"] == pytest.approx(measured.position.precision_m, abs=1e-6)
    assert [row[0] for row in waypoint["arrivals"]] == ["round 1", "round 2", "round 3"]


def test_a_true_pose_that_nobody_measured_is_null(told):
    data, _ = told(truth=False)
    (row, *_) = data["runs"]["run-1"]["waypoints"][0]["arrivals"]
    assert row[1:4] == [None, None, None]
    assert None not in row[4:6]


def test_a_run_names_the_scenario_that_holds_its_units(told):
    data, _ = told()
    scenario = data["scenarios"][data["runs"]["run-1"]["scenario"]]
    assert (scenario["diameter"], scenario["field"], scenario["tolerance"]) == (0.3, 80.0, 0.2)
