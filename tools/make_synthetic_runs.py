"""Make run directories of runs that nobody drove: input for tests of speed, and for nothing else.

    python tools/make_synthetic_runs.py OUT [--runs 10000] [--rounds 5] [--waypoints 12]

Scenario, title and method say "synthetic", in run.json and so on every page and table made from them. Arrivals scatter
about their goals by normal deviates, a few goals fail; the same seed gives the same bytes. No trajectories are written.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, Event, GoalFailed, GoalStarted, Manifest, RoundEnded, RoundStarted, RunEnded
from taskslam.record.events import encode_event
from taskslam.record.run_directory import JOURNAL, MANIFEST

SECOND = 1_000_000_000
FAILING = 0.002  # share of goals


def make_run(folder: Path, seed: int, rounds: int, waypoints: int) -> None:
    """Write one run directory."""
    rng = np.random.default_rng(seed)
    goals = [SE2(float(2 * n), float(n % 3), 0.1 * n) for n in range(waypoints)]
    events, reached = drive(rng, goals, rounds)
    manifest = Manifest(
        scenario_name="synthetic",
        scenario={
            "name": "synthetic",
            "title": "Synthetic runs: made by a tool, driven by nobody",
            "sequence": {"waypoints": [{"x": goal.x, "y": goal.y, "theta": goal.theta} for goal in goals]},
        },
        scenario_hash="0" * 64,
        method=f"synthetic_{seed % 4}",
        method_card={"name": f"synthetic_{seed % 4}", "synthetic": True},
        mode="without-map",
        seed=seed,
        rounds=rounds,
        latency="zero",
        started_utc="1970-01-01T00:00:00Z",
        wall_s=1.0,
        simulated_s=events[-1].t / SECOND,
        complete=reached,
    )
    folder.mkdir(parents=True)
    (folder / JOURNAL).write_text("".join(encode_event(event) + "\n" for event in events), encoding="utf-8")
    (folder / MANIFEST).write_text(json.dumps(manifest.model_dump(mode="json"), indent=2) + "\n", encoding="utf-8")


def drive(rng: np.random.Generator, goals: list[SE2], rounds: int) -> tuple[list[Event], bool]:
    """The events of a run, and whether every goal was reached."""
    events: list[Event] = []
    complete = True
    t = 0
    for number in range(rounds):
        events.append(RoundStarted(t, number, priming=False))
        outcome = Outcome.REACHED
        for index, goal in enumerate(goals):
            events.append(GoalStarted(t, number, index, goal))
            t += 20 * SECOND
            truth, estimate, odometry = (SE2(*(goal.array() + rng.normal(0, 0.03, 3)).tolist()) for _ in range(3))
            if rng.random() < FAILING:
                outcome, complete = Outcome.NO_PLAN, False
                events.append(GoalFailed(t, number, index, goal, outcome, "synthetic", truth, estimate, odometry))
                break
            events.append(Arrival(t, number, index, goal, truth, estimate, odometry))
        events.append(RoundEnded(t, number, outcome, frames=200 * len(goals), dropped_frames=0))
    return [*events, RunEnded(t, complete)], complete


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--waypoints", type=int, default=12)
    options = parser.parse_args()
    for seed in range(options.runs):
        make_run(options.out / f"{seed // 1000:03d}" / f"seed{seed}", seed, options.rounds, options.waypoints)
    print(f"{options.runs} synthetic runs in {options.out}")


if __name__ == "__main__":
    main()
