import errno
import json
import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import DiskFullError, RecordError
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import (
    RoundEnded,
    RoundStarted,
    RunEnded,
    RunWriter,
    find_partial_runs,
    find_runs,
    load_run,
)


def write_run(directory, events, manifest, replace=False):
    with RunWriter(directory, replace=replace) as run:
        for event in events:
            if isinstance(event, RoundEnded):
                run.pose("truth", event.round, 10, SE2(1.0, 2.0, 0.5))
                run.pose("truth", event.round, 20, SE2(1.1, 2.0, 0.5))
                run.pose("odometry", event.round, 10, SE2(0.9, 2.0, 0.5))
            run.event(event)
        run.method_log.write_text("hello from the method\n")
        run.finish(manifest)
    return directory


def test_a_run_comes_back_whole(tmp_path, events, manifest):
    record = load_run(write_run(tmp_path / "results" / "a", events, manifest))
    assert list(record.events) == events
    assert record.manifest.method == "karto"
    assert [goal.x for goal in record.manifest.goals] == [1.0, 3.0, 2.0]
    assert [start.round for start in record.rounds()] == [0]
    np.testing.assert_allclose(record.trajectory(0, "truth").poses, [[1.0, 2.0, 0.5], [1.1, 2.0, 0.5]])
    assert record.trajectory(0, "odometry").stamps.tolist() == [10]
    assert len(record.trajectory(0, "estimate")) == 0
    assert (tmp_path / "results" / "a" / "method.log").read_text() == "hello from the method\n"


def test_the_same_run_writes_the_same_bytes(tmp_path, events, manifest):
    files = [
        {path.relative_to(run): path.read_bytes() for path in sorted(run.rglob("*")) if path.is_file()}
        for run in (write_run(tmp_path / name, events, manifest) for name in "ab")
    ]
    assert files[0] == files[1]
    assert len(files[0]) == 5


def test_nothing_stands_in_place_before_the_end(tmp_path, events, manifest):
    with RunWriter(tmp_path / "a") as run:
        run.event(events[0])
        assert not (tmp_path / "a").exists()
        assert find_runs(tmp_path) == []
        assert find_partial_runs(tmp_path) == [run.folder]
        run.finish(manifest)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert find_runs(tmp_path) == [tmp_path / "a"]
    assert find_partial_runs(tmp_path) == []


def test_a_failure_keeps_what_was_measured_and_says_where(tmp_path, events):
    def fail():
        with RunWriter(tmp_path / "a") as run:
            run.event(events[0])
            run.pose("truth", 0, 5, SE2(1.0, 1.0, 0.0))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as caught:
        fail()
    partial = tmp_path / ".a.partial"
    assert str(partial) in caught.value.__notes__[0]
    assert (partial / "round00" / "truth.tum").exists()
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize("printed", ["", "no such camera\n"])
def test_nothing_is_kept_where_nothing_was_measured_but_what_the_method_printed(tmp_path, printed):
    def fail():
        with RunWriter(tmp_path / "a") as run:
            run.event(RoundStarted(0, 0, priming=False))
            run.method_log.write_text(printed)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as caught:
        fail()
    log = tmp_path / ".a.partial" / "method.log"
    said = [f"What the method printed is kept in {log}"] if printed else []
    assert getattr(caught.value, "__notes__", []) == said
    assert [path.name for path in tmp_path.iterdir()] == ([".a.partial"] if printed else [])


def test_what_a_failed_run_left_is_removed_by_the_next_one(tmp_path, events, manifest):
    with pytest.raises(ZeroDivisionError), RunWriter(tmp_path / "a"):
        raise ZeroDivisionError
    record = load_run(write_run(tmp_path / "a", events, manifest))
    assert list(record.events) == events
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_killed_run_blocks_nothing(tmp_path, events, manifest):
    script = textwrap.dedent("""
        import sys, time
        from pathlib import Path
        from taskslam.record import RoundStarted, RunWriter
        run = RunWriter(Path(sys.argv[1]))
        run.event(RoundStarted(0, 0, priming=False))
        print("started", flush=True)
        time.sleep(60)
    """)
    child = subprocess.Popen([sys.executable, "-c", script, str(tmp_path / "a")], stdout=subprocess.PIPE)
    try:
        assert child.stdout.readline() == b"started\n"
        with pytest.raises(RecordError, match="another process is writing this run"):
            RunWriter(tmp_path / "a")
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
        child.stdout.close()
    assert find_runs(tmp_path) == []
    assert find_partial_runs(tmp_path) == [tmp_path / ".a.partial"]
    write_run(tmp_path / "a", events, manifest)
    assert find_runs(tmp_path) == [tmp_path / "a"]


def test_a_finished_run_is_not_overwritten_unless_asked(tmp_path, events, manifest):
    write_run(tmp_path / "a", events, manifest)
    with pytest.raises(RecordError, match="exists already"):
        RunWriter(tmp_path / "a")
    write_run(tmp_path / "a", events, manifest | {"seed": 7}, replace=True)
    assert load_run(tmp_path / "a").manifest.seed == 7
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_wrong_manifest_names_the_key(tmp_path, events, manifest):
    with pytest.raises(RecordError, match=r"run\.json: mode: .*'without-map' or 'with-map'"):
        write_run(tmp_path / "a", events, manifest | {"mode": "sideways"})
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(
    ("sequence", "message"),
    [
        ({"waypoints": [], "path": None}, "holds no goal"),
        ({"waypoints": [{"x": 0, "y": 0, "theta": 0}], "path": [0]}, "holds no goal"),
        (
            {"waypoints": [{"x": 0, "y": 0, "theta": 0}], "path": [0, 3]},
            r"path\[1\] is 3, but the waypoint table has rows 0 to 0",
        ),
    ],
)
def test_a_scenario_without_goals_is_refused(tmp_path, events, manifest, sequence, message):
    with pytest.raises(RecordError, match=message):
        write_run(tmp_path / "a", events, manifest | {"scenario": {"sequence": sequence}})


def test_the_units_come_from_the_scenario(tmp_path, events, manifest):
    assert load_run(write_run(tmp_path / "a", events, manifest)).manifest.robot_diameter == 0.30
    scenario = manifest["scenario"] | {"units": {"robot_diameter": 0.5, "field_of_view": 70.0}}
    record = load_run(write_run(tmp_path / "b", events, manifest | {"scenario": scenario}))
    assert (record.manifest.robot_diameter, record.manifest.field_of_view) == (0.5, 70.0)


def test_a_pose_after_the_end_of_its_round_is_refused(tmp_path):
    with RunWriter(tmp_path / "a") as run:
        run.event(RoundEnded(0, 0, Outcome.REACHED, 1, 0))
        with pytest.raises(RecordError, match="round 0, which has ended"):
            run.pose("truth", 0, 1, SE2())


def test_a_pose_that_is_not_finite_is_refused(tmp_path):
    with RunWriter(tmp_path / "a") as run, pytest.raises(RecordError, match="round 0, estimate at 5 ns"):
        run.pose("estimate", 0, 5, SE2(float("nan"), 0.0, 0.0))


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS])
def test_a_place_that_cannot_be_written_is_named(tmp_path, monkeypatch, number):
    def refuse(self, *args, **kwargs):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(DiskFullError, match=f"{tmp_path / 'a'}: cannot be written: {os.strerror(number)}"):
        RunWriter(tmp_path / "a")


def test_a_file_in_the_way_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError, match="file is a file, expected a folder"):
        RunWriter(tmp_path / "file" / "a")


def test_a_full_disk_during_a_run_names_the_file(tmp_path, full_disk):
    with RunWriter(tmp_path / "a") as run:
        run.event(RoundStarted(0, 0, priming=False))
        run.pose("truth", 0, 1, SE2())
        with full_disk(), pytest.raises(DiskFullError, match=r"truth\.tum: cannot be written: File too large"):
            run.event(RoundEnded(1, 0, Outcome.REACHED, 1, 0))


def test_a_folder_without_a_manifest_is_refused(tmp_path, events, manifest):
    with pytest.raises(RecordError, match="not a run directory"):
        load_run(tmp_path)
    write_run(tmp_path / "a", events, manifest)
    (tmp_path / "a" / "run.json").unlink()
    with pytest.raises(RecordError, match="half-written"):
        load_run(tmp_path / "a")
    assert find_partial_runs(tmp_path) == [tmp_path / "a"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text[: len(text) // 2], r"run\.json: cannot read the run: not JSON"),
        (lambda text: "[]", r"run\.json: "),
        (lambda text: text.replace("taskslam-run/1", "taskslam-run/9"), "format 'taskslam-run/9'; this version reads"),
        (lambda text: text.replace('"seed": 0', '"seed": "x"'), r"run\.json: seed: "),
        (lambda text: text.replace('"seed": 0', '"seed": 0, "sead": 1'), r"run\.json: sead: Extra inputs"),
    ],
)
def test_a_damaged_manifest_is_refused_with_a_reason(tmp_path, events, manifest, change, message):
    write_run(tmp_path / "a", events, manifest)
    path = tmp_path / "a" / "run.json"
    path.write_text(change(path.read_text()))
    with pytest.raises(RecordError, match=message):
        load_run(tmp_path / "a")


def test_wall_clock_values_stand_only_in_the_manifest(tmp_path, events, manifest):
    write_run(tmp_path / "a", events, manifest)
    write_run(tmp_path / "b", events, manifest | {"started_utc": "2031-01-01T00:00:00Z", "wall_s": 99.0})
    assert (tmp_path / "a" / "journal.jsonl").read_bytes() == (tmp_path / "b" / "journal.jsonl").read_bytes()
    assert json.loads((tmp_path / "b" / "run.json").read_text())["wall_s"] == 99.0


def test_a_run_that_ends_early_still_has_its_last_event(tmp_path, manifest):
    write_run(tmp_path / "a", [RoundStarted(0, 0, priming=False), RunEnded(1, complete=False)], manifest)
    assert load_run(tmp_path / "a").events[-1] == RunEnded(1, complete=False)


@pytest.mark.parametrize(
    ("rounds", "path", "message"),
    [
        (4_000_000_000, [0, 1], r"run\.json: rounds: Input should be less than or equal to 1000"),
        (5, [0] * 20_000, r"run\.json: .*path: Tuple should have at most 10001 items"),
        (1000, [0] * 5_000, "1000 rounds of 4999 goals are more than 1000000 arrivals"),
    ],
)
def test_more_rounds_and_goals_than_anybody_drives_are_refused(tmp_path, events, manifest, rounds, path, message):
    write_run(tmp_path / "a", events, manifest)
    content = json.loads((tmp_path / "a" / "run.json").read_text()) | {"rounds": rounds}
    content["scenario"]["sequence"]["path"] = path
    (tmp_path / "a" / "run.json").write_text(json.dumps(content))
    with pytest.raises(RecordError, match=message):
        load_run(tmp_path / "a")


def test_a_pipe_in_the_place_of_a_file_of_a_run_is_refused_at_once(tmp_path, events, manifest):
    write_run(tmp_path / "a", events, manifest)
    for name in ("journal.jsonl", "run.json"):
        (tmp_path / "a" / name).unlink()
        os.mkfifo(tmp_path / "a" / name)
        with pytest.raises(RecordError, match=f"{name}: cannot read .*found a pipe or a device"):
            load_run(tmp_path / "a")
