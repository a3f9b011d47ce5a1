import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.evaluation.curves import (
    REAL_GRID,
    SIMULATION_GRID,
    cumulative_precision,
    n_auc_exact,
    n_auc_on_grid,
    normalized_area,
)

precisions = st.lists(st.floats(0, 3), min_size=0, max_size=20)

# Protocol 5.4: N-AUC on the real grid, verified against the publication to four digits.
WITH_MAP = {"slam_toolbox": 0.9444, "fast_lio2": 0.9333, "lio_sam": 0.8556, "gf_gg": 0.9556, "orb_slam3": 0.9667}


def published_rows(file):
    with file.open(newline="") as lines:
        for row in csv.DictReader(lines):
            reached = [float(row[f"w{n}"]) / 100 for n in range(1, 7) if row[f"w{n}"]]
            yield row, reached


def test_with_map_rows_give_the_published_n_auc(data):
    printed = {}
    for row, reached in published_rows(data / "published" / "tsrb_short_with_map.csv"):
        value = n_auc_on_grid(reached, 6, REAL_GRID)
        assert round(value, 4) == WITH_MAP[row["method"]]
        if row["n_auc_published"]:
            printed[row["method"]] = row["n_auc_published"]
            assert f"{value:.2f}" == row["n_auc_published"]
    assert printed == {"slam_toolbox": "0.94", "lio_sam": "0.86", "gf_gg": "0.96", "orb_slam3": "0.97"}


def test_without_map_rows_give_the_computed_n_auc(data):
    rows = list(published_rows(data / "published" / "tsrb_short_without_map.csv"))
    assert len(rows) == 9
    for row, reached in rows:
        assert f"{n_auc_on_grid(reached, 6, REAL_GRID):.4f}" == row["n_auc_computed"]


def test_the_largest_attainable_values_are_those_of_the_protocol():
    perfect = [0.0] * 6
    assert n_auc_on_grid(perfect, 6, SIMULATION_GRID) == pytest.approx(0.9375)
    assert n_auc_on_grid(perfect, 6, REAL_GRID) == pytest.approx(0.9667, abs=1e-4)
    assert n_auc_exact(perfect, 6) == 1.0


def test_the_grids_are_those_of_the_protocol():
    assert SIMULATION_GRID.tolist() == [0, 0.15, 0.30, 0.45, 0.60, 0.75, 0.90, 1.05, 1.20]
    assert len(REAL_GRID) == 16
    assert REAL_GRID[-1] == 0.9


def test_the_curve_counts_strictly_below():
    assert cumulative_precision([0.15, 0.30], 4, [0.0, 0.15, 0.16, 0.30, 0.31]).tolist() == [0, 0, 0.25, 0.25, 0.5]


def test_incomplete_waypoints_lower_the_plateau_only():
    curve = cumulative_precision([0.01, 0.02, 0.5], 4, SIMULATION_GRID)
    assert curve[-1] == 0.75
    assert n_auc_exact([0.01, 0.02, 0.5], 4) == pytest.approx((1.19 + 1.18 + 0.7) / (1.2 * 4))


def test_no_complete_waypoint_gives_zero():
    assert n_auc_on_grid([], 12) == 0.0
    assert n_auc_exact([], 12) == 0.0


@pytest.mark.parametrize("bad", [([0.1, 0.2], 1), ([0.1], 0), ([float("nan")], 3), ([float("inf")], 3)])
def test_what_makes_no_curve_is_refused(bad):
    with pytest.raises(ValueError, match=r"planned waypoints|finite"):
        n_auc_exact(*bad)


@given(precisions)
def test_the_exact_area_is_the_limit_of_a_fine_grid(values):
    planned = len(values) + 2
    fine = np.linspace(0, 1.2, 6001)
    assert n_auc_exact(values, planned) == pytest.approx(n_auc_on_grid(values, planned, fine), abs=3e-4)


@given(precisions)
def test_the_curve_never_falls(values):
    curve = cumulative_precision(values, len(values) + 1, np.linspace(0, 4, 50))
    assert (np.diff(curve) >= 0).all()
    assert curve[-1] == pytest.approx(len(values) / (len(values) + 1))


def test_there_is_no_area_where_a_complete_waypoint_has_no_precision():
    assert normalized_area([0.1, None], 3).exact is None
    assert normalized_area([], 3).exact == 0.0
    assert normalized_area([0.0, 0.0, 0.6], 3).exact == pytest.approx(2.5 / 3)
