"""The folder of a campaign in the middle of its work, as those who drive leave it: written, not driven."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taskslam.benchmark.campaign.campaign_file import Campaign
from taskslam.benchmark.campaign.notes import keep
from taskslam.benchmark.campaign.plan_file import write_plan
from taskslam.benchmark.campaign.planning import Plan
from taskslam.benchmark.engine import Ending, Result
from taskslam.benchmark.spec import Drive, RunSpec, run_folder, spec_of_tour
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, GoalStarted, RoundEnded, RoundStarted, RunWriter
from taskslam.record.newest import newest_state
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.world.floor_plan import FREE, OCCUPIED, FloorPlan
from taskslam.world.map_server import save_floor_plan

SECOND = 1_000_000_000


def write_watched(out: Path) -> list[RunSpec]:
    """Four runs: finished with a goal missed, under way in its second round, not to be driven, waiting; their specs."""
    scenario = load_scenario("house", ["protocol.rounds=2"])
    make = (scenario, load_robot("turtlebot2"), ("0" * 64, "1" * 64))
    specs = [spec_of_tour(*make, method, Mode.WITHOUT_MAP, seed) for seed in (0, 1) for method in ("karto", "hector")]
    campaign = Campaign(name="watched", scenarios=("house",), methods=("karto", "hector"), seeds=(0, 1), rounds=2)
    write_plan(out, campaign, Plan(tuple(specs)))
    finished, under_way, failed, _ = specs
    with writer(out, finished) as run:
        drive_round(run, finished, 0, miss=True)
        drive_round(run, finished, 1)
        run.finish(manifest(finished))
    with writer(out, under_way) as run:
        drive_round(run, under_way, 0)
        go_on(run, under_way)
    keep(out, Result(failed.title, Ending.FAILED, "the <b>node</b> burnt", failed), "node7")
    return specs


def writer(out: Path, spec: RunSpec) -> RunWriter:
    run = RunWriter(run_folder(out, spec), spec=spec.to_json(), resume=True)
    cells = np.full((200, 280), OCCUPIED, np.uint8)
    cells[2:-2, 2:-2] = FREE
    save_floor_plan(FloorPlan(cells, 0.05, SE2(-7.0, -5.0)), run.folder / "plan.yaml", image="png")
    return run


def drive_round(run: RunWriter, spec: RunSpec, number: int, miss: bool = False) -> None:
    """A round over all goals, of a minute each; miss: the last one is."""
    t, goals = 1000 * number * SECOND, tour(spec)
    run.event(RoundStarted(t, number, priming=False))
    for index, target in enumerate(goals):
        run.event(GoalStarted(t, number, index, target))
        t += 60 * SECOND
        run.pose("truth", number, t, target)
        run.pose("estimate", number, t, target)
        if miss and target is goals[-1]:
            run.event(GoalFailed(t, number, index, target, Outcome.NO_PLAN, "no way", target, target, target))
        else:
            run.event(Arrival(t, number, index, target, SE2(target.x + 0.1, target.y, 0.0), target, target))
    run.tally(number, 0.1, 1000)
    run.event(RoundEnded(t, number, Outcome.NO_PLAN if miss else Outcome.REACHED, 100, 0))


def go_on(run: RunWriter, spec: RunSpec) -> None:
    """Begin the second round: the first goal is reached, and the robot is on its way to the second."""
    first, second, *_ = tour(spec)
    run.event(RoundStarted(1000 * SECOND, 1, priming=False))
    run.event(GoalStarted(1000 * SECOND, 1, 0, first))
    run.event(Arrival(1060 * SECOND, 1, 0, first, first, first, first))
    run.event(GoalStarted(1060 * SECOND, 1, 1, second))
    for step in range(1000):
        run.pose("truth", 1, 1060 * SECOND + step, SE2(0.001 * step, 0.5, 0.0))
    at = SE2(1.0, 0.5, 0.2)
    scan = np.column_stack([np.linspace(-3, 3, 400), np.full(400, 2.0)])
    run.show(lambda: newest_state(1070 * SECOND, 1, at, SE2(1.05, 0.5, 0.2), scan))


def tour(spec: RunSpec) -> list[SE2]:
    assert isinstance(spec.task, Drive)
    return list(spec.task.scenario.goals)


def manifest(spec: RunSpec) -> dict[str, object]:
    assert isinstance(spec.task, Drive)
    return {
        "scenario_name": spec.task.name, "scenario": spec.task.scenario.model_dump(mode="json"),
        "scenario_hash": spec.task_digest, "spec_hash": spec.digest, "behaviour": spec.behaviour,
        "method": spec.method, "method_card": {"name": spec.method}, "mode": spec.mode, "seed": spec.seed, "rounds": 2,
        "latency": "fixed", "started_utc": "2030-01-01T00:00:00Z", "wall_s": 72.0, "simulated_s": 1440.0,
        "complete": False, "failure": "round 0, goal 11: no_plan: no way",
    }  # fmt: skip
