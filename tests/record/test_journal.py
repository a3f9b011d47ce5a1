import errno
import os

import pytest

from taskslam.errors import DiskFullError, RecordError
from taskslam.record import journal as journal_module
from taskslam.record.events import encode_event
from taskslam.record.journal import JournalWriter, read_journal


@pytest.fixture
def written(tmp_path, events):
    path = tmp_path / "journal.jsonl"
    with JournalWriter(path) as writer:
        for event in events:
            writer.write(event)
    return path


def test_events_come_back_in_order(written, events):
    journal = read_journal(written)
    assert list(journal.events) == events
    assert not journal.truncated


def test_every_line_is_on_file_before_the_next_step(tmp_path, events):
    writer = JournalWriter(tmp_path / "journal.jsonl")
    writer.write(events[0])
    assert (tmp_path / "journal.jsonl").read_text() == encode_event(events[0]) + "\n"
    writer.close()


@pytest.mark.parametrize("kept", range(1, 20))
def test_a_cut_off_last_line_is_left_out_and_reported(written, events, kept):
    lines = written.read_bytes().split(b"\n")[:-1]
    written.write_bytes(b"\n".join([*lines[:-1], lines[-1][:kept]]))
    journal = read_journal(written)
    assert list(journal.events) == events[:-1]
    assert journal.truncated


def test_a_last_line_that_only_lacks_its_end_is_kept(written, events):
    written.write_bytes(written.read_bytes().rstrip(b"\n"))
    assert list(read_journal(written).events) == events
    assert not read_journal(written).truncated


@pytest.mark.parametrize("junk", [b"not json", b"", b"\xff\xfe", b'{"event":"run_ended","t":0}'])
def test_a_corrupt_line_names_file_and_line(written, junk):
    lines = written.read_bytes().split(b"\n")
    lines[3] = junk
    written.write_bytes(b"\n".join(lines))
    with pytest.raises(RecordError, match=r"journal\.jsonl, line 4: "):
        read_journal(written)


def test_a_missing_journal_is_named(tmp_path):
    with pytest.raises(RecordError, match=r"journal\.jsonl: cannot read the journal"):
        read_journal(tmp_path / "journal.jsonl")


def test_half_a_line_is_taken_back_when_the_disk_is_full(tmp_path, events, monkeypatch):
    path = tmp_path / "journal.jsonl"
    with JournalWriter(path) as writer:
        writer.write(events[0])

        def fill_up(descriptor, data):
            os.write(descriptor, bytes(data)[:10])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with monkeypatch.context() as patch:
            patch.setattr(journal_module, "_write_all", fill_up)
            with pytest.raises(DiskFullError, match=r"journal\.jsonl: cannot be written: No space left"):
                writer.write(events[1])
        writer.write(events[-1])
    assert list(read_journal(path).events) == [events[0], events[-1]]


def test_a_journal_of_more_lines_than_any_run_has_is_refused(tmp_path):
    path = tmp_path / "journal.jsonl"
    path.write_bytes(b"\n" * 1_000_001)
    with pytest.raises(RecordError, match=r"journal\.jsonl: more than 1000000 lines"):
        read_journal(path)
