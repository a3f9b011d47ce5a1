"""Journals with a flipped bit or a missing block: what is still good is kept, what is not is named."""

from collections.abc import Callable
from pathlib import Path

import pytest

from taskslam.errors import RecordError
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import (
    Arrival,
    GoalFailed,
    GoalSkipped,
    GoalStarted,
    RoundEnded,
    RoundStarted,
    RunEnded,
    RunRecord,
    RunWriter,
    load_run,
)
from taskslam.record.run_directory import JOURNAL

GOALS = [SE2(1.0, 2.0, 0.5), SE2(3.0, 0.0, 0.0), SE2(3.0, 4.0, -1.0)]
ROUNDS = 3
FAILED = (1, 1)  # round and goal

Written = Callable[..., Path]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """A run of three rounds over three goals, of which the second fails in the second round."""

    def write(on_failure: str = "abort") -> Path:
        with RunWriter(tmp_path / "run") as run:
            for number in range(ROUNDS):
                run.event(RoundStarted(10 * number, number, priming=False))
                for goal, target in enumerate(GOALS):
                    run.event(GoalStarted(10 * number, number, goal, target))
                    if (number, goal) != FAILED:
                        run.event(Arrival(10 * number + goal, number, goal, target, target, target, target))
                        continue
                    run.event(GoalFailed(10 * number, number, goal, target, Outcome.LOST, "lost", None, None, None))
                    if on_failure == "abort":
                        run.event(GoalSkipped(10 * number, number, 2))
                        break
                run.event(RoundEnded(10 * number + 9, number, Outcome.REACHED if number != 1 else Outcome.LOST, 0, 0))
            run.event(RunEnded(30, complete=False))
            scenario = {
                "sequence": {"waypoints": [{"x": at.x, "y": at.y, "theta": at.theta} for at in GOALS]},
                "protocol": {"on_failure": on_failure},
            }
            return run.finish(
                {
                    "scenario_name": "made_up", "scenario": scenario, "scenario_hash": "0" * 64, "method": "karto",
                    "method_card": {"name": "karto"}, "mode": "without-map", "seed": 0, "rounds": ROUNDS,
                    "latency": "fixed", "started_utc": "2030-01-01T00:00:00Z", "wall_s": 1.0, "simulated_s": 1.0,
                    "complete": False,
                }
            )  # fmt: skip

    return write


def changed(run: Path, at: int, change: Callable[[bytes], bytes]) -> RunRecord:
    """The run with a line changed; the line by its number, from 1."""
    path = run / JOURNAL
    lines = path.read_bytes().split(b"\n")
    lines[at - 1] = change(lines[at - 1])
    path.write_bytes(b"\n".join(lines))
    return load_run(run, damaged=True)


def arrived(record: RunRecord) -> set[tuple[int, int]]:
    return {(event.round, event.goal) for event in record.events if isinstance(event, Arrival)}


ALL = {(0, 0), (0, 1), (0, 2), (1, 0), (2, 0), (2, 1), (2, 2)}


def test_an_intact_journal_is_read_as_ever(written: Written) -> None:
    run = written()
    found = load_run(run, damaged=True)
    assert found == load_run(run)
    assert (found.damaged, found.lost) == ((), frozenset())
    assert arrived(found) == ALL


def test_an_arrival_that_the_round_went_past_is_lost_data(written: Written) -> None:
    found = changed(written(), 5, lambda line: line.replace(b"arrival", b"arr\x00val"))  # round 0, goal 1
    assert found.lost == {(0, 1)}
    assert arrived(found) == ALL
    (said,) = found.damaged
    assert f"{JOURNAL}, line 5: " in said


def test_nobody_can_tell_about_an_arrival_where_rounds_go_on_after_a_failure(written: Written) -> None:
    found = changed(written("skip"), 5, lambda line: line[:-1])
    assert not found.lost
    assert (0, 1) not in arrived(found)


def test_a_failure_that_cannot_be_read_is_no_arrival(written: Written) -> None:
    found = changed(written(), 13, lambda _: b"junk")
    assert not found.lost
    assert arrived(found) == ALL


@pytest.mark.parametrize(
    ("line", "old", "new", "reason"),
    [
        (5, b'"goal":1', b'"goal":2', "its target is not that of goal 2 in run.json"),
        (5, b'"goal":1', b'"goal":7', "its target is not that of goal 7"),
        (5, b'"round":0', b'"round":1', "an event of round 1 among those of round 0"),
        (16, b'"round":2', b'"round":1', "round 1 begins a second time"),
    ],
)
def test_a_flipped_digit_is_found_by_what_it_contradicts(
    written: Written, line: int, old: bytes, new: bytes, reason: str
) -> None:
    found = changed(written(), line, lambda text: text.replace(old, new))
    assert any(f"line {line}: " in said and reason in said for said in found.damaged), found.damaged
    assert arrived(found) == ALL


def test_a_round_whose_beginning_is_gone_still_counts(written: Written) -> None:
    found = changed(written(), 16, lambda _: b"")
    assert [start.round for start in found.rounds()] == [0, 1, 2]
    assert arrived(found) == ALL
    assert any("round 2 has no beginning that can be read" in said for said in found.damaged)


def test_a_second_end_of_a_goal_is_refused(written: Written) -> None:
    found = changed(written(), 5, lambda line: line + b"\n" + line)
    assert arrived(found) == ALL
    assert sum(isinstance(event, Arrival) for event in found.events) == len(ALL)
    assert "line 6: goal 1 in round 0 ends a second time" in found.damaged[0]


def test_a_file_of_junk_is_no_journal(written: Written) -> None:
    run = written()
    (run / JOURNAL).write_bytes(b"junk\n" * 20)
    with pytest.raises(RecordError, match=r"20 of 20 lines of the journal cannot be used; the first: .*line 1: "):
        load_run(run, damaged=True)


def test_whoever_does_not_ask_for_it_gets_no_damaged_journal(written: Written) -> None:
    run = written()
    changed(run, 5, lambda _: b"junk")
    with pytest.raises(RecordError, match="line 5: "):
        load_run(run)
