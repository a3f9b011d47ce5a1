"""A small finished run for the verbs that read results."""

import pytest

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, RoundEnded, RoundStarted, RunEnded, RunWriter

GOAL = SE2(1.0, 2.0, 0.0)


@pytest.fixture
def results(tmp_path):
    """A synthetic run of two rounds over two goals; the second goal fails once."""
    with RunWriter(tmp_path / "results" / "a") as run:
        for number, dx in enumerate((0.1, -0.1)):
            at = GOAL @ SE2(dx, 0.0, 0.0)
            run.event(RoundStarted(number * 100, number, priming=False))
            run.event(Arrival(number * 100 + 1, number, 0, GOAL, at, at, None))
            if number:
                run.event(GoalFailed(150, 1, 1, GOAL, Outcome.LOST, "blind for 5 s", at, at, None))
            else:
                run.event(Arrival(2, 0, 1, GOAL, at, at, None))
            run.event(RoundEnded(number * 100 + 60, number, Outcome.REACHED, 10, 1))
        run.event(RunEnded(160, complete=False))
        run.finish(
            {
                "scenario_name": "synthetic",
                "scenario": {"sequence": {"waypoints": [{"x": 1.0, "y": 2.0, "theta": 0.0}] * 2, "path": None}},
                "scenario_hash": "0",
                "method": "karto",
                "method_card": {},
                "mode": "without-map",
                "seed": 0,
                "rounds": 2,
                "latency": "fixed",
                "started_utc": "2030-01-01T00:00:00Z",
                "wall_s": 1.0,
                "simulated_s": 2.0,
                "method_peak_bytes": 312_000_000,
                "complete": False,
            }
        )
    return tmp_path / "results"
