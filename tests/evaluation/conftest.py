"""Builds small synthetic runs on disk, arrival by arrival."""

import numpy as np
import pytest

from taskslam.evaluation import run_metrics
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, GoalStarted, RoundEnded, RoundStarted, RunEnded, RunWriter, load_run

SECOND = 1_000_000_000


class RunBuilder:
    """A run of `rounds` over goals at (0, 0), (10, 0), (20, 0) ..., facing along x. Synthetic."""

    def __init__(self, directory, goals=3, rounds=5, mode="without-map"):
        self.directory = directory
        self.goals = [SE2(10.0 * n, 0.0, 0.0) for n in range(goals)]
        self.rounds = rounds
        self.mode = mode
        self.events = []
        self.t = 0

    def round(self, number, truths, priming=False, estimates=None, failed=None):
        """truths: {goal: pose offset from the goal}; failed: (goal, outcome) that ends the round."""
        self.events.append(RoundStarted(self._tick(), number, priming))
        for goal, offset in truths.items():
            target = self.goals[goal]
            self.events.append(GoalStarted(self._tick(), number, goal, target))
            truth = None if offset is None else target @ offset
            estimate = target @ estimates[goal] if estimates else target
            self.events.append(Arrival(self._tick(), number, goal, target, truth, estimate, None))
        outcome = Outcome.REACHED
        if failed:
            goal, outcome = failed
            target = self.goals[goal]
            self.events.append(
                GoalFailed(self._tick(), number, goal, target, outcome, "said why", target, target, None)
            )
        self.events.append(RoundEnded(self._tick(), number, outcome, frames=100, dropped_frames=2))
        return self

    def write(self, **changes):
        manifest = {
            "scenario_name": "synthetic",
            "scenario": {
                "sequence": {"waypoints": [{"x": g.x, "y": g.y, "theta": g.theta} for g in self.goals], "path": None}
            },
            "scenario_hash": "0" * 64,
            "method": "karto",
            "method_card": {"name": "karto"},
            "mode": self.mode,
            "seed": 3,
            "rounds": self.rounds,
            "latency": "fixed",
            "started_utc": "2030-01-01T00:00:00Z",
            "wall_s": 10.0,
            "simulated_s": 200.0,
            "complete": False,
            **changes,
        }
        with RunWriter(self.directory) as run:
            for event in [*self.events, RunEnded(self._tick(), complete=False)]:
                run.event(event)
            run.finish(manifest)
        return self.directory

    def _tick(self):
        self.t += SECOND
        return self.t


@pytest.fixture
def build(tmp_path):
    def make(name="run", **options):
        return RunBuilder(tmp_path / "results" / name, **options)

    return make


# Five offsets whose E is 0.08 and Delta 0.06 (the golden vector of protocol 5.2).
GOLDEN_OFFSETS = [SE2(0, 0, 0), SE2(0.1, 0, 0.1), SE2(0, 0.1, -0.1), SE2(-0.1, 0, 0.05), SE2(0, -0.1, -0.05)]


@pytest.fixture
def golden_offsets():
    return GOLDEN_OFFSETS


@pytest.fixture
def scattered(build):
    """Metrics of a run whose arrivals scatter by so many metres in each axis; goals from `fails_at` on missed once."""

    def make(name, spread, rounds=5, goals=6, seed=0, fails_at=None, bias=0.0, **manifest):
        random = np.random.default_rng(seed)
        builder = build(name, goals=goals, rounds=rounds, mode=manifest.get("mode", "without-map"))
        for number in range(rounds):
            last = fails_at if fails_at is not None and number == 1 else goals
            offsets = {
                goal: SE2(bias + x, y, t) for goal, (x, y, t) in enumerate(spread * random.normal(size=(goals, 3)))
            }
            failed = (last, Outcome.LOST) if last < goals else None
            builder.round(number, {goal: offsets[goal] for goal in range(last)}, failed=failed)
        return run_metrics(load_run(builder.write(method=name, seed=manifest.pop("seed_name", 0), **manifest)), name)

    return make
