"""Synthetic runs with everything that a report shows: floor plan, trajectories, arrivals, a failure."""

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, GoalStarted, RoundEnded, RoundStarted, RunEnded, RunWriter
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import FREE, OCCUPIED
from taskslam.world.map_server import save_floor_plan

SECOND = 1_000_000_000
GOALS = (SE2(2.0, 1.0, 0.0), SE2(6.0, 1.0, 1.57), SE2(6.0, 4.0, 3.14))


def floor_plan(yaw=0.0):
    cells = np.full((60, 90), FREE, dtype=np.uint8)
    cells[[0, -1], :] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    return FloorPlan(cells, 0.1, SE2(-0.5, -0.5, yaw))


def write_run(
    directory,
    method="karto",
    mode="without-map",
    rounds=3,
    driven=None,
    failed=False,
    failed_goal=2,
    outcome=Outcome.NO_PLAN,
    slam_off=0.0,
    truth=True,
    plan=True,
    title="Test house",
    scenario="synthetic",
    spread=0.01,
    card=(),
    **manifest,
):
    """A synthetic run.

    driven: rounds that began, where not all did; failed: the last of them fails at failed_goal by this outcome, with
    SLAM so many metres off; spread: of the arrivals, metres; card, manifest: what they hold beside the usual.
    """
    rng = np.random.default_rng(5)
    with RunWriter(directory) as run:
        if plan:
            save_floor_plan(floor_plan(), run.folder / "plan.yaml", image="png")
        t = 0
        last = (rounds if driven is None else driven) + (mode == "with-map") - 1
        for number in range(last + 1):
            run.event(RoundStarted(t, number, priming=mode == "with-map" and number == 0))
            ended = Outcome.REACHED
            for goal, target in enumerate(GOALS):
                run.event(GoalStarted(t, number, goal, target))
                for step in range(30):
                    t += SECOND // 10
                    at = SE2(target.x - 1 + step / 30, target.y, target.theta)
                    run.pose("truth", number, t, at)
                    run.pose("estimate", number, t, SE2(at.x + 0.01, at.y, at.theta))
                if failed and number == last and goal == failed_goal:
                    ended, belief = outcome, SE2(at.x + slam_off, at.y, at.theta)
                    run.event(GoalFailed(t, number, goal, target, outcome, "<b>no plan</b> & so", at, belief, at))
                    break
                stop = target @ SE2(-0.1 + spread * rng.normal(), spread * rng.normal(), 0.02 * rng.normal())
                belief = stop @ SE2(0.01, 0.0, 0.0)
                run.event(Arrival(t, number, goal, target, stop if truth else None, belief, None))
            run.event(RoundEnded(t, number, ended, frames=200, dropped_frames=4))
        run.event(RunEnded(t, complete=not failed))
        run.finish(
            {
                "scenario_name": scenario,
                "scenario": {
                    "title": title,
                    "robot": "turtlebot2",
                    "start": {"x": 1.0, "y": 1.0, "theta": 0.0},
                    "sequence": {
                        "waypoints": [{"x": g.x, "y": g.y, "theta": g.theta} for g in GOALS],
                        "path": None,
                    },
                },
                "scenario_hash": "ab" * 32,
                "method": method,
                "method_card": {
                    "name": method,
                    "version": "9.9",
                    "sensors": ["laser_scan"],
                    "summary": "A test.",
                    **dict(card),
                },
                "mode": mode,
                "seed": 0,
                "rounds": rounds,
                "latency": "fixed",
                "versions": {"taskslam": "0"},
                "machine": {"system": "Linux"},
                "started_utc": "2030-01-01T00:00:00Z",
                "wall_s": 2.0,
                "simulated_s": t / SECOND,
                "complete": not failed,
                **manifest,
            }
        )
    return directory


@pytest.fixture
def make_run(tmp_path):
    def make(name="run", **options):
        return write_run(tmp_path / "results" / name, **options)

    return make


@pytest.fixture(scope="session")
def write_synthetic_run():
    """`write_run`, for fixtures that outlive a test."""
    return write_run
