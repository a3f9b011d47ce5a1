import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.evaluation import run_metrics
from taskslam.evaluation.tolerance import ArrivalSpread, arrival_spread, success
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import load_run


def test_success_needs_both_and_counts_missed_arrivals_as_failures(build):
    run = build(goals=2, rounds=2)
    run.round(0, {0: SE2(0.1, 0, 0.2), 1: SE2()}).round(1, {0: SE2(-0.1, 0, -0.2)}, failed=(1, Outcome.LOST))
    spread = arrival_spread([run_metrics(load_run(run.write()), "run")])
    assert spread.planned == 4
    # Waypoint 1: both 10 cm and 0.2 rad from their mean. Waypoint 2: one arrival, no mean, and one missed.
    assert success(spread, [0.05, 0.11]) == pytest.approx([0.0, 0.5])
    assert success(spread, [0.11], angle=0.1) == pytest.approx([0.0])
    assert success(spread, [0.11], angle=0.21) == pytest.approx([0.5])


def test_a_missing_sequence_counts_as_failed(scattered):
    run = scattered("a", 0.01)
    assert success(arrival_spread([run], missing=30), [1.0]) == pytest.approx([0.5])
    with pytest.raises(ValueError, match="no arrival was planned"):
        success(arrival_spread([]), [1.0])


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), max_size=20), st.floats(0, 1))
def test_a_wider_tolerance_never_succeeds_less(rows, angle):
    table = np.array(rows).reshape(-1, 2)
    spread = ArrivalSpread(table[:, 0], table[:, 1], len(rows) + 3)
    shares = success(spread, np.linspace(0, 1, 20), angle)
    assert (np.diff(shares) >= 0).all()
    assert (shares <= success(spread, np.linspace(0, 1, 20))).all()
    assert success(spread, [math.inf])[0] == pytest.approx(len(rows) / (len(rows) + 3))
