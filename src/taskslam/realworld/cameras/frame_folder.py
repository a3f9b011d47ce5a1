"""The folder of a recording: pictures named by their UTC time, and a table of what was seen in each and by what clock.

Names are Unix seconds with nine digits behind the point, as in the published layout (`<camera>/<unix_time>.jpg`).
"""

from __future__ import annotations

import os
from pathlib import Path

from taskslam.errors import InputError
from taskslam.files import write_whole, writing
from taskslam.measurements import NANOSECONDS
from taskslam.reading import LARGEST_LOG, is_there, read_bytes
from taskslam.realworld.cameras.host_clock import ClockState

TABLE = "frames.csv"
_HEADER = "stamp_ns,picture,ids,clock_offset_s,clock_told_by\n"


class FrameFolder:
    """Adds pictures to a folder, which may hold some from before.

    Raises:
        DiskFullError: the folder cannot be made or written.
        InputError: its table is another program's.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with writing(path):
            path.mkdir(parents=True, exist_ok=True)
        self._table = path / TABLE
        self.kept_before = self._repair()

    def add(self, stamp: int, jpeg: bytes, ids: list[int], clock: ClockState) -> Path:
        """Keep a picture. Its stamp is moved by a nanosecond where another has it.

        Raises:
            DiskFullError: there is no space for it; what was kept before stays whole.
        """
        while is_there(picture := self.path / f"{stamp // NANOSECONDS}.{stamp % NANOSECONDS:09d}.jpg"):
            stamp += 1
        offset = "" if clock.offset is None else f"{clock.offset:.6f}"
        told_by = clock.told_by.replace(",", ";").replace("\n", " ")
        write_whole(picture, jpeg)
        row = f"{stamp},{picture.name},{' '.join(map(str, ids))},{offset},{told_by}\n"
        with writing(self._table), self._table.open("ab", buffering=0) as file:
            size = file.tell()
            if file.write(row.encode()) != len(row.encode()):
                os.ftruncate(file.fileno(), size)
                raise OSError(28, os.strerror(28))
        return picture

    def _repair(self) -> int:
        """Make the table, or cut off a row that a crash left half written; how many rows it has."""
        if not is_there(self._table):
            write_whole(self._table, _HEADER)
            return 0
        content = read_bytes(self._table, "table of a recording", InputError, LARGEST_LOG)
        if not content.startswith(_HEADER.encode()):
            raise InputError(f"{self._table}: not the table of a recording; name another folder")
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            with writing(self._table):
                os.truncate(self._table, whole)
        return content.count(b"\n", 0, whole) - 1
