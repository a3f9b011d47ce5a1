"""One writer at a time, nothing through a link, and every step of a killed process finished by the next one."""

import json
import os
import subprocess
import sys
import textwrap

import pytest

from taskslam.errors import RecordError
from taskslam.files import remove, write_whole
from taskslam.record import RoundStarted, RunWriter, load_run
from taskslam.record.place import settle
from taskslam.record.run_directory import JOURNAL, MANIFEST

OWNER = textwrap.dedent("""
    import sys, time
    from pathlib import Path
    from taskslam.errors import RecordError
    from taskslam.record import RoundStarted, RunWriter
    print("ready", flush=True)
    for line in sys.stdin:
        try:
            run = RunWriter(Path(line.strip()))
        except RecordError:
            print("refused", flush=True)
            continue
        run.event(RoundStarted(0, 0, priming=False))
        time.sleep(0.03)
        journal = run.folder / "journal.jsonl"
        owned = journal.exists() and journal.stat().st_size > 0
        run.__exit__(None, None, None)
        print("owner" if owned else "robbed", flush=True)
""")


@pytest.fixture
def write(events, manifest):
    def write_run(directory, replace=False, **changed):
        with RunWriter(directory, replace=replace) as run:
            for event in events:
                run.event(event)
            return run.finish(manifest | changed)

    return write_run


def test_of_two_writers_at_one_place_one_owns_it_and_keeps_it(tmp_path):
    """The partial folder of a killed run lies there, so that both would like to remove it."""
    pair = [
        subprocess.Popen([sys.executable, "-c", OWNER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    try:
        assert [process.stdout.readline() for process in pair] == ["ready\n"] * 2
        for number in range(60):
            place = tmp_path / f"run{number}"
            (tmp_path / f".run{number}.partial" / "round00").mkdir(parents=True)
            for process in pair:
                process.stdin.write(f"{place}\n")
                process.stdin.flush()
            said = sorted(process.stdout.readline().strip() for process in pair)
            assert "robbed" not in said
            assert said in (["owner", "refused"], ["owner", "owner"])  # one after the other, where one was slow
            assert not (tmp_path / f".run{number}.lock").exists()
    finally:
        for process in pair:
            process.stdin.close()
            process.wait()
            process.stdout.close()


def test_the_lock_of_a_killed_process_is_taken_over_and_leaves_nothing(tmp_path, write):
    (tmp_path / ".a.lock").write_text("")
    write(tmp_path / "a")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_finished_run_that_was_not_moved_yet_is_moved_by_the_next_start(tmp_path, write):
    write(tmp_path / "a").rename(tmp_path / ".a.partial")
    settle(tmp_path / "a")
    assert load_run(tmp_path / "a").manifest.seed == 0
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_run_that_was_being_replaced_is_replaced_by_the_next_start(tmp_path, write):
    """Killed before, between and after the two moves."""
    for old_at, new_at in (("a", ".a.partial"), (".a.replaced", ".a.partial"), (".a.replaced", "a")):
        write(tmp_path / "old")
        write(tmp_path / "new", seed=7)
        (tmp_path / "old").rename(tmp_path / old_at)
        (tmp_path / "new").rename(tmp_path / new_at)
        settle(tmp_path / "a")
        assert load_run(tmp_path / "a").manifest.seed == 7
        assert [path.name for path in tmp_path.iterdir()] == ["a"]
        remove(tmp_path / "a")


def test_a_half_written_replacement_gives_the_old_run_back(tmp_path, write):
    write(tmp_path / "a").rename(tmp_path / ".a.replaced")
    settle(tmp_path / "a")
    assert load_run(tmp_path / "a").manifest.seed == 0


def test_a_run_whose_files_do_not_fit_its_digests_is_not_taken_for_finished(tmp_path, write):
    folder = write(tmp_path / "a").rename(tmp_path / ".a.partial")
    with (folder / JOURNAL).open("ab") as file:
        file.write(b"{}\n")
    settle(tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_nothing_is_written_through_a_link(tmp_path, write):
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / JOURNAL).write_text("precious")
    place = tmp_path / "place"
    place.mkdir()
    (place / ".a.partial").symlink_to(outside)
    write(place / "a")
    assert (outside / JOURNAL).read_text() == "precious"
    assert not (place / "a").is_symlink()
    with RunWriter(place / "b") as run:
        for name in (f".{MANIFEST}.partial", MANIFEST):
            (run.folder / name).symlink_to(outside / JOURNAL)
        run.event(RoundStarted(0, 0, priming=False))
        run.finish(load_run(place / "a").manifest)
    assert (outside / JOURNAL).read_text() == "precious"
    assert load_run(place / "b").manifest.seed == 0


def test_a_link_at_the_place_of_a_run_is_refused_or_replaced(tmp_path, write):
    outside = tmp_path / "outside"
    outside.mkdir()
    (tmp_path / "a").symlink_to(outside)
    with pytest.raises(RecordError, match="exists already"):
        RunWriter(tmp_path / "a")
    write(tmp_path / "a", replace=True)
    assert list(outside.iterdir()) == []
    assert not (tmp_path / "a").is_symlink()
    (tmp_path / ".b.lock").symlink_to(outside / "made")
    with pytest.raises(RecordError, match="cannot be created"):
        RunWriter(tmp_path / "b")
    assert list(outside.iterdir()) == []


def test_a_link_in_what_an_interrupted_run_left_ends_its_resumption(tmp_path):
    with RunWriter(tmp_path / "a", spec="{}", resume=True) as run:
        (run.folder / "method.log").symlink_to(tmp_path / "outside")
    with RunWriter(tmp_path / "a", spec="{}", resume=True) as run:
        assert not os.path.lexists(run.folder / "method.log")


def test_run_json_names_the_digest_of_every_recorded_file(tmp_path, write):
    files = json.loads((write(tmp_path / "a") / MANIFEST).read_text())["files"]
    assert list(files) == [JOURNAL]
    assert len(files[JOURNAL]) == 64


def test_two_processes_that_write_one_file_leave_a_whole_one(tmp_path):
    script = "import sys; from pathlib import Path; from taskslam.files import write_whole\n"
    script += "for _ in range(40): write_whole(Path(sys.argv[1]), (c * 4096 for c in sys.argv[2] * 64))"
    file = tmp_path / "page.html"
    write_whole(file, "")
    pair = [subprocess.Popen([sys.executable, "-c", script, str(file), letter]) for letter in "ab"]
    while any(process.poll() is None for process in pair):
        assert len(set(file.read_text())) <= 1
    assert [process.returncode for process in pair] == [0, 0]
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]
