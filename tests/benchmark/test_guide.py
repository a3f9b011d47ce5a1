"""The platform, the traveller and the engine that CONTRIBUTING.md shows, at work."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from guide import snippets
from taskslam.benchmark.campaign.campaign_file import load_campaign
from taskslam.benchmark.campaign.planning import plan
from taskslam.benchmark.engine import Ending, Watcher
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.protocol import Tour, drive_tour
from taskslam.benchmark.spec import run_folder
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.record import Arrival, GoalFailed, RunWriter
from taskslam.record.journal import read_journal
from taskslam.task import Task

CAMPAIGN = """
name: tiny
scenarios: [{folder}/near.yaml, {folder}/nowhere.yaml]
methods: [ground_truth]
modes: [without-map]
seeds: [0]
rounds: 1
"""
SCENARIO = """
name: near
world: {name: house}
start: {x: 0, y: 0, theta: 0}
sequence: {waypoints: [[1.0, 0.0, 0.0]]}
protocol: {pause: 0.2, still_start: 0.2}
"""


def names_of(heading: str) -> dict[str, Any]:
    """What the code of a section defines."""
    (code,) = snippets(heading)
    names: dict[str, Any] = {}
    exec(compile(code, f"CONTRIBUTING.md, {heading}", "exec"), names)
    return names


def test_somebody_elses_stack_drives_the_protocol(tmp_path: Path) -> None:
    names = names_of("Add a platform")
    asked: list[SE2] = []

    def send(goal: SE2) -> tuple[bool, SE2]:
        asked.append(goal)
        return goal.x < 2.5, goal

    task = Task.model_validate(
        {
            "sequence": {"waypoints": [[1, 0, 0], [2, 0, 0], [3, 0, 0]]},
            "protocol": {"rounds": 2, "on_failure": "skip"},
        }
    )
    with RunWriter(tmp_path / "run") as record, names["Clock"]() as platform:
        tour = Tour(task, platform, lambda: names["Stack"](platform, send), record, Observer())
        assert not drive_tour(tour, Mode.WITHOUT_MAP)
        events = read_journal(record.folder / "journal.jsonl").events
        assert platform.zero_utc.tzinfo is not None
    assert [goal.x for goal in asked] == [1, 2, 3] * 2
    assert [event.estimate for event in events if isinstance(event, Arrival)] == [SE2(x, 0, 0) for x in (1, 2) * 2]
    assert [event.detail for event in events if isinstance(event, GoalFailed)] == ["the stack gave up"] * 2


def test_the_smallest_engine_leaves_what_the_local_one_leaves(tmp_path: Path) -> None:
    (tmp_path / "near.yaml").write_text(SCENARIO)
    (tmp_path / "tiny.yaml").write_text(CAMPAIGN.format(folder=tmp_path))
    planned = plan(load_campaign(str(tmp_path / "tiny.yaml")))
    assert [refused.ending for refused in planned.refused] == [Ending.REFUSED]
    (spec,) = planned.specs
    theirs = names_of("Add an engine")["OneAfterTheOther"]()
    assert [result.ending for result in theirs.run([spec], tmp_path / "theirs", Watcher())] == [Ending.COMPLETE]
    assert [result.ending for result in theirs.run([spec], tmp_path / "theirs", Watcher())] == [Ending.KEPT]
    assert [result.ending for result in LocalEngine().run([spec], tmp_path / "ours", Watcher())] == [Ending.COMPLETE]
    journals = [(run_folder(tmp_path / out, spec) / "journal.jsonl").read_bytes() for out in ("theirs", "ours")]
    assert journals[0] == journals[1]
    other = spec.model_copy(update={"options": {"no_such": 1}})
    (refused,) = theirs.run([other], tmp_path / "theirs", Watcher())
    assert refused.ending is Ending.REFUSED
    assert "no option 'no_such'" in refused.detail
