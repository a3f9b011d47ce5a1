"""A planner from outside drives the tour, and its runs are told from those of the built-in one."""

from pathlib import Path

import pytest

from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage, set_stage
from taskslam.errors import PlannerError, RecordError
from taskslam.evaluation import evaluate_runs
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.record import Arrival, GoalFailed, load_run
from taskslam.scenario import load_scenario


def drive(stage: Stage, out: Path) -> tuple[Path, bool]:
    return run(stage, stage.spec("ground_truth", Mode.WITHOUT_MAP), out)


@pytest.fixture(autouse=True)
def third_party(install, monkeypatch):
    monkeypatch.syspath_prepend(str(install(Path(__file__).parents[1] / "navigation" / "third_party")))


@pytest.fixture
def with_planner(make_stage):
    stage = make_stage(rounds=1)

    def choose(name: str) -> Stage:
        scenario = stage.scenario.model_copy(update={"planner": name})
        return Stage(scenario, stage.world, stage.plan, stage.robot)

    return choose


def test_a_planner_from_outside_reaches_the_goals_and_is_named_in_the_record(with_planner, tmp_path):
    directories = [drive(with_planner(name), tmp_path / name)[0] for name in ("teb", "pure_pursuit")]
    ours, theirs = (load_run(directory) for directory in directories)
    assert [sum(isinstance(event, Arrival) for event in record.events) for record in (ours, theirs)] == [3, 3]
    assert theirs.manifest.complete
    assert (ours.manifest.planner, theirs.manifest.planner) == ("teb", "pure_pursuit")
    assert theirs.manifest.versions["pure-pursuit"] == "0.3"
    assert ours.manifest.scenario_hash != theirs.manifest.scenario_hash
    assert (directories[0] / "journal.jsonl").read_bytes() != (directories[1] / "journal.jsonl").read_bytes()
    metrics = evaluate_runs([tmp_path])
    assert [run.planner for run in metrics.runs] == ["pure_pursuit", "teb"]


def test_a_finished_run_is_not_taken_for_that_of_another_planner(with_planner, tmp_path):
    drive(with_planner("gives_up"), tmp_path)
    with pytest.raises(RecordError, match="another configuration"):
        drive(with_planner("teb"), tmp_path)


def test_a_planner_that_gives_up_fails_its_goal_and_one_that_breaks_ends_the_run(with_planner, tmp_path):
    directory, complete = drive(with_planner("gives_up"), tmp_path / "none")
    assert not complete
    (failure,) = (event for event in load_run(directory).events if isinstance(event, GoalFailed))
    assert failure.outcome == "no_control"
    with pytest.raises(PlannerError, match=r"planner 'raises' at .* s: ValueError: no idea where to go"):
        drive(with_planner("raises"), tmp_path / "raises")


def test_a_scenario_names_its_planner_and_a_wrong_name_is_told_before_the_world_is_loaded():
    assert load_scenario("house").planner == "teb"
    scenario = load_scenario("house", ["planner=pure_pursuit", "world.name=nowhere"])
    assert scenario.planner == "pure_pursuit"
    with pytest.raises(PlannerError, match="Did you mean 'pure_pursuit'"):
        set_stage(scenario.model_copy(update={"planner": "pursuit"}), [], Observer())
