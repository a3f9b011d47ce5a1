"""A run whose process is killed before any of its file operations: the next start loses no round and leaves nothing."""

from killing import killed_at_every_step
from taskslam.files import forget, write_once, write_whole
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import RoundEnded, RoundStarted, RunWriter, load_run
from taskslam.record.place import partial_folder, settle
from taskslam.record.run_directory import JOURNAL, MANIFEST

ROUNDS = 2


def drive(place, manifest):
    """What a start does with a run of two rounds; the number of rounds that it found."""
    settle(place)
    if (place / MANIFEST).exists():
        return ROUNDS
    with RunWriter(place, spec="the spec", resume=True) as run:
        found = run.resumed.rounds
        for number in range(found, ROUNDS):
            run.event(RoundStarted(10 * number, number, priming=False))
            run.pose("truth", number, 10 * number + 1, SE2(1.0, 2.0, 0.5))
            run.tally(number, 0.1, 1000)
            run.event(RoundEnded(10 * number + 5, number, Outcome.REACHED, 1, 0))
        run.finish(manifest)
    return found


def test_no_round_that_ended_is_driven_again_and_nothing_is_left(tmp_path, manifest):
    def start(number):
        drive(tmp_path / f"{number}" / "run", manifest)

    for number in killed_at_every_step(start):
        place = tmp_path / f"{number}" / "run"
        journals = [folder / JOURNAL for folder in (partial_folder(place), place)]
        ended = sum(journal.read_bytes().count(b"round_ended") for journal in journals if journal.exists())
        assert drive(place, manifest) >= ended, f"killed before file operation {number}"
        assert [path.name for path in place.parent.iterdir()] == ["run"], f"killed before file operation {number}"
        assert not load_run(place, damaged=True).changed
        assert sorted(path.name for path in place.iterdir()) == [
            "journal.jsonl",
            "round00",
            "round01",
            "run.json",
            "spec.json",
        ]
    assert number > 30


def test_a_file_that_is_written_once_is_whole_and_alone(tmp_path):
    def start(number):
        write_once(tmp_path / f"{number}" / "name", b"the first")

    for number in killed_at_every_step(start):
        file = tmp_path / f"{number}" / "name"
        assert not file.exists() or file.read_bytes() == b"the first"
        first = file.exists()
        write_once(file, b"another")
        assert file.read_bytes() == (b"the first" if first else b"another")
        assert [path.name for path in file.parent.iterdir()] == ["name"]


def test_what_is_forgotten_leaves_nothing(tmp_path):
    def start(number):
        (tmp_path / f"{number}").mkdir()
        write_whole(tmp_path / f"{number}" / "note", "why")

    for number in killed_at_every_step(start):
        forget(tmp_path / f"{number}" / "note")
        assert not list(tmp_path.glob(f"{number}/*"))
