"""One of every event, and a manifest, as the loop would write them (synthetic)."""

import math

import pytest

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import (
    Arrival,
    GoalFailed,
    GoalSkipped,
    GoalStarted,
    MethodNotice,
    RoundEnded,
    RoundStarted,
    RunEnded,
)


@pytest.fixture
def events():
    target = SE2(1.0, -2.0, math.pi / 3)
    third = SE2(1 / 3, -0.1, 1e-17)
    return [
        RoundStarted(0, 0, priming=False),
        GoalStarted(1, 0, 0, target),
        Arrival(17_000_000_001, 0, 0, target, SE2(0.1, 0.2, 0.3), third, None),
        GoalStarted(18_000_000_000, 0, 1, target),
        GoalFailed(
            19, 0, 1, target, Outcome.NO_PLAN, 'no path through "the door"\nfor 5 s — ünïcode', None, third, third
        ),
        GoalSkipped(20, 0, 2),
        MethodNotice(21, 0, "restarted"),
        RoundEnded(22, 0, Outcome.NO_PLAN, frames=100, dropped_frames=3),
        RunEnded(23, complete=True),
    ]


@pytest.fixture
def manifest():
    return {
        "scenario_name": "synthetic",
        "scenario": {
            "name": "synthetic",
            "sequence": {
                "waypoints": [{"x": float(n), "y": -2.0, "theta": 1.0} for n in range(4)],
                "path": [0, 1, 3, 2],
            },
        },
        "scenario_hash": "0" * 64,
        "method": "karto",
        "method_card": {"name": "karto"},
        "mode": "without-map",
        "seed": 0,
        "rounds": 1,
        "latency": "fixed",
        "started_utc": "2030-01-01T00:00:00Z",
        "wall_s": 1.5,
        "simulated_s": 30.0,
        "complete": False,
    }
