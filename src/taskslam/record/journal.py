"""The append-only journal: one event a line, written through at once, so that a kill loses at most the last line."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from taskslam.errors import RecordError
from taskslam.files import writing
from taskslam.reading import LARGEST_JOURNAL, MOST_LINES, read_bytes
from taskslam.record.events import Event, decode_event, encode_event


class JournalWriter:
    """Appends events to a journal; each line reaches the operating system before `write` returns."""

    def __init__(self, path: Path, keep: int = 0) -> None:
        """Create the journal, or go on with one after its first `keep` bytes. A link is not followed.

        Raises DiskFullError if it cannot be written.
        """
        self.path = path
        with writing(path):
            flags = os.O_WRONLY | os.O_CLOEXEC | os.O_NOFOLLOW | (0 if keep else os.O_CREAT | os.O_EXCL)
            self._file = os.fdopen(os.open(path, flags, 0o666), "wb", buffering=0)
            self._file.truncate(keep)
            self._file.seek(keep)
        self._length = keep

    def write(self, event: Event) -> None:
        """Append one event. Raises RecordError for a non-finite value, DiskFullError if it cannot be written."""
        data = (encode_event(event) + "\n").encode("utf-8")
        with writing(self.path):
            try:
                _write_all(self._file.fileno(), data)
            except OSError:
                # Half a line must not stay: the next event, if there is room again, would be glued to it.
                os.ftruncate(self._file.fileno(), self._length)
                os.lseek(self._file.fileno(), self._length, os.SEEK_SET)
                raise
        self._length += len(data)

    def close(self) -> None:
        """Flush to the disk and close. Closing twice is harmless."""
        if self._file.closed:
            return
        with writing(self.path):
            try:
                os.fsync(self._file.fileno())
            finally:
                self._file.close()

    def __enter__(self) -> JournalWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self.close()


@dataclass(frozen=True)
class Journal:
    """What a journal holds. truncated: its last line was cut off (the run was killed) and is left out."""

    events: tuple[Event, ...]
    truncated: bool = False


@dataclass(frozen=True, slots=True)
class JournalLine:
    """A line by its number, from 1. event: what it says, or the reason why it cannot be read."""

    number: int
    event: Event | str


def read_journal(path: Path) -> Journal:
    """Read a journal. Raises RecordError naming file and line for anything but a cut-off last line."""
    lines, truncated = read_lines(path)
    events: list[Event] = []
    for line in lines:
        if isinstance(line.event, str):
            raise RecordError(f"{path}, line {line.number}: {line.event}")
        events.append(line.event)
    return Journal(tuple(events), truncated)


def read_lines(path: Path) -> tuple[list[JournalLine], bool]:
    """Every line of a journal, damaged or not, and whether a last one was cut off, which is left out.

    Raises RecordError if there is no such file, or if it is larger than any run's.
    """
    data = read_bytes(path, "journal", RecordError, LARGEST_JOURNAL)
    if data.count(b"\n") > MOST_LINES:
        raise RecordError(f"{path}: more than {MOST_LINES} lines; expected an event a line")
    lines: list[JournalLine] = []
    for number, line, whole in _lines(data):
        try:
            lines.append(JournalLine(number, decode_event(line)))
        except RecordError as error:
            if not whole:
                return lines, True
            lines.append(JournalLine(number, str(error)))
    return lines, False


def _lines(data: bytes) -> Iterator[tuple[int, bytes, bool]]:
    """Line number from 1, content, and whether the line end is there."""
    lines = data.split(b"\n")
    for number, line in enumerate(lines[:-1], start=1):
        yield number, line, True
    if lines[-1]:
        yield len(lines), lines[-1], False


def _write_all(descriptor: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]
