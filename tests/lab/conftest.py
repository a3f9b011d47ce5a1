"""Tours made up in the house, for the lab to photograph."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.lab.lab_file import Lab, Lens, load_lab
from taskslam.measurements import NANOSECONDS
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, RoundEnded, RoundStarted, RunEnded, RunRecord, RunWriter, load_run
from taskslam.scenario import load_scenario


@pytest.fixture(scope="session")
def drive() -> Callable[..., RunRecord]:
    """`drive(directory, goals, rounds, missed=(round, goal), strays={(round, goal): SE2})`: a run of the house."""
    return _drive


def _drive(
    directory: Path,
    goals: Sequence[int],
    rounds: int,
    missed: tuple[int, int] | None = None,
    strays: Mapping[tuple[int, int], SE2] | None = None,
) -> RunRecord:
    """Straight drives to each goal from 0.8 m before it; where each ends is scattered by 2 cm and 3 degrees.

    strays: where the robot truly stands, seen from where it says that it does.
    """
    scenario = load_scenario("house")
    dice = np.random.default_rng(3)
    driving, pause = 4.0, 5.0
    with RunWriter(directory) as writer:
        now = 0
        for number in range(rounds):
            writer.event(RoundStarted(now, number, priming=False))
            for goal in goals:
                target = scenario.sequence.goals[goal].pose
                scatter = dice.normal(0, [0.02, 0.02, 0.05])
                end = SE2(target.x + scatter[0], target.y + scatter[1], target.theta + scatter[2])
                true = end @ (strays or {}).get((number, goal), SE2(0.0, 0.0, 0.0))
                for tick in range(int((driving + pause) * 50)):
                    left = max(0.0, 1 - tick / 50 / driving)
                    at = true @ SE2(-0.8 * left, 0.0, 0.3 * left)
                    writer.pose("truth", number, now + tick * NANOSECONDS // 50, at)
                now += round((driving + pause) * NANOSECONDS)
                writer.pose("truth", number, now, true)
                if (number, goal) == missed:
                    writer.event(GoalFailed(now, number, goal, target, Outcome.NO_PLAN, "made up", true, end, end))
                else:
                    writer.event(Arrival(now, number, goal, target, true, end, end))
                now += NANOSECONDS // 50
            writer.event(RoundEnded(now, number, Outcome.REACHED, 0, 0))
        writer.event(RunEnded(now, complete=False))
        writer.finish(
            {
                "scenario_name": "house",
                "scenario": scenario.model_dump(mode="json"),
                "scenario_hash": "0" * 64,
                "method": "karto",
                "method_card": {"name": "karto"},
                "mode": "without-map",
                "seed": 0,
                "rounds": rounds,
                "latency": "fixed",
                "started_utc": "2030-01-01T00:00:00Z",
                "wall_s": 1.0,
                "simulated_s": now / NANOSECONDS,
                "complete": False,
            }
        )
    return load_run(directory)


@pytest.fixture(scope="session")
def small_lab() -> Lab:
    """The lab that ships with the house, with fewer pixels and pictures."""
    whole = load_lab("house_cameras")
    cameras = tuple(camera.model_copy(update={"lens": _half(camera.lens)}) for camera in whole.cameras)
    assert whole.tag is not None
    return whole.model_copy(
        update={
            "cameras": cameras,
            "photo": whole.photo.model_copy(update={"rate": 1.2, "before": 6.0, "after": 0.0}),
            # About the tag itself, so that the true pose of the base is the tag's.
            "sway": whole.sway.model_copy(update={"pivot": whole.tag.height}),
        }
    )


def _half(lens: Lens) -> Lens:
    """The same lens on a sensor with half as many pixels across."""
    return lens.model_copy(
        update={
            "size": tuple(n // 2 for n in lens.size),
            "focal": tuple(f / 2 for f in lens.focal),
            "center": tuple((c + 0.5) / 2 - 0.5 for c in lens.center),
        }
    )
