"""Who watches sees every run, how far it is and when all will be done, and leaves no trace in the folder."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from taskslam.benchmark.campaign.state import State
from taskslam.benchmark.campaign.watching import Watched
from taskslam.benchmark.spec import run_folder
from taskslam.errors import RecordError
from taskslam.record.newest import NEWEST
from taskslam.record.place import partial_folder
from watched import tour, write_watched


def everything(folder: Path) -> dict[Path, tuple[int, int]]:
    return {path: (path.lstat().st_mtime_ns, path.lstat().st_ino) for path in [folder, *folder.rglob("*")]}


def test_a_campaign_in_the_middle_of_its_work(tmp_path: Path) -> None:
    specs = write_watched(tmp_path / "out")
    before = everything(tmp_path)
    watched = Watched(tmp_path / "out")
    look = watched.look()
    assert [run.spec for run in look.runs] == specs
    assert [run.state for run in look.runs] == [State.FINISHED, State.UNDER_WAY, State.NOT_DRIVEN, State.WAITING]
    finished, under_way, failed, waiting = look.runs
    assert (finished.complete, finished.done) == (False, 1.0)
    assert under_way.done == pytest.approx(13 / 24)  # twelve goals of the first round, and one of the second
    assert failed.detail == "infrastructure failed: the <b>node</b> burnt"
    assert look.outlook is not None
    assert look.outlook.seconds == pytest.approx(look.outlook.core_s)  # one run at a time, of one core
    closer = watched.closer(under_way)
    assert (closer.round, closer.heading, closer.rounds) == (1, 1, 2)
    assert list(closer.goals) == tour(specs[1])
    assert closer.newest is not None
    assert closer.newest.truth == (1.0, 0.5, 0.2)
    last = watched.closer(finished).newest
    assert last is not None
    assert len(last.way) == 12
    assert watched.closer(waiting).events == ()
    assert everything(tmp_path) == before


def test_what_is_left_shrinks_as_a_run_goes_on(tmp_path: Path) -> None:
    _, spec, *_ = write_watched(tmp_path)
    watched = Watched(tmp_path)
    before = watched.look().outlook
    journal = partial_folder(run_folder(tmp_path, spec)) / "journal.jsonl"
    arrival = next(line for line in journal.read_bytes().splitlines(keepends=True) if b'"arrival"' in line)
    with journal.open("ab") as file:
        file.write(5 * arrival)
    after = watched.look().outlook
    assert before is not None
    assert after is not None
    assert after.core_s < before.core_s


def test_a_run_that_has_said_nothing_for_long_is_interrupted_and_one_that_shows_itself_is_not(tmp_path: Path) -> None:
    _, spec, *_ = write_watched(tmp_path)
    folder, long_ago = partial_folder(run_folder(tmp_path, spec)), time.time() - 4000
    os.utime(folder / "journal.jsonl", (long_ago, long_ago))
    assert Watched(tmp_path).look().runs[1].state is State.UNDER_WAY  # a goal may take long
    os.utime(folder / NEWEST, (long_ago, long_ago))
    look = Watched(tmp_path).look()
    assert look.runs[1].state is State.INTERRUPTED
    assert look.outlook is not None
    assert look.outlook.seconds is None  # nobody drives


def test_a_single_run_is_watched_by_the_place_where_it_will_stand(tmp_path: Path) -> None:
    finished, under_way, *_ = (run_folder(tmp_path, spec) for spec in write_watched(tmp_path))
    for place in (under_way, partial_folder(under_way)):
        (run,) = Watched(place).look().runs
        assert (run.folder, run.state) == (under_way, State.UNDER_WAY)
    (run,) = Watched(finished).look().runs
    assert (run.folder, run.state) == (finished, State.FINISHED)
    both = Watched(tmp_path / "house").look().runs
    assert {run.folder for run in both} == {finished, under_way}


def test_a_folder_without_runs_is_told(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(RecordError, match="no run, finished or under way"):
            Watched(folder)
