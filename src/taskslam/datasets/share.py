"""`Share`: rows or messages of one stream that cannot be read, skipped and counted, and refused above a share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from taskslam.errors import DatasetError
from taskslam.skipped import ENOUGH_TO_TELL, Skipped, too_many


class Share:
    """One pass over a stream. failed: whether the last part could not be read."""

    def __init__(self, skipped: Skipped, what: str) -> None:
        """what: a word for these parts, such as `scans that cannot be read`."""
        self._skipped, self._what = skipped, what
        self._seen = self._bad = 0
        self._first: DatasetError | None = None
        self.failed = False

    @contextmanager
    def of(self, where: str) -> Iterator[None]:
        """Read one part inside; what is wrong with it costs no more than that, up to the share."""
        self.failed = False
        try:
            yield
            self._seen += 1
        except DatasetError as error:
            self.skip(where, error)

    def skip(self, where: str, error: DatasetError) -> None:
        """Note a part that cannot be read. Raises DatasetError, of the first one, where these are too many."""
        self._seen += 1
        self._bad += 1
        self.failed = True
        told = f"{where}: {error}" if where else str(error)
        self._first = self._first or DatasetError(told)
        self._skipped.add(self._what, told)
        if too_many(self._bad, self._seen, ENOUGH_TO_TELL):
            raise self._first

    def end(self) -> None:
        """Raise DatasetError, of the first one, where they were too many of a few."""
        if self._first is not None and too_many(self._bad, self._seen):
            raise self._first
