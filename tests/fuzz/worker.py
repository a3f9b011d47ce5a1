"""One process that feeds one reader: `python -m fuzz.worker READER SEED FIRST COUNT`, a line for each input.

The line of an input comes after it: its number, `read`, `refused` or `fault`, the damaged file, and words. What hangs or
crashes leaves no line, so the parent knows its number.
"""

from __future__ import annotations

import contextlib
import os
import random
import resource
import shutil
import sys
import tempfile
import warnings
from pathlib import Path

from fuzz.mutation import damaged_inside
from fuzz.readers import READERS, Reader
from taskslam.errors import TaskSlamError

ROOM = 1 << 30


class Inputs:
    """The inputs of one reader, made in a folder that starts as an example and of which one file is damaged."""

    def __init__(self, reader: Reader, seed: int, folder: Path) -> None:
        self._reader, self._seed = reader, seed
        self.folder = folder
        folder.mkdir(parents=True)
        reader.example(folder)
        self._whole = {
            str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob("*"))
            if path.is_file() and reader.damages(path)
        }
        self._names = list(self._whole)

    @contextlib.contextmanager
    def damaged(self, number: int):
        """The name of the damaged file while it is damaged."""
        dice = random.Random(f"{self._seed}/{self._reader.name}/{number}")
        name = dice.choice(self._names)
        others = [self._whole[other] for other in self._names]
        path = self.folder / name
        path.write_bytes(damaged_inside(name, self._whole[name], others, dice))
        try:
            yield name
        finally:
            path.write_bytes(self._whole[name])


def verdict(reader: Reader, folder: Path, name: str) -> tuple[str, str]:
    """`read`, `refused` or `fault`, and the words of the error."""
    try:
        reader.read(folder, name)
    except TaskSlamError as error:
        if _needed_memory(error):
            return "fault", f"more than a gibibyte: {error}"
        return "refused", str(error)
    except Exception as error:
        return "fault", f"{type(error).__name__}: {error} at {_place(error)}"
    return "read", ""


def _place(error: BaseException) -> str:
    """The last lines of ours, and the last of all, that it went through."""
    places, at = [], error.__traceback__
    while at is not None:
        places.append(f"{at.tb_frame.f_code.co_filename}:{at.tb_lineno}")
        at = at.tb_next
    own = [place.rpartition("/taskslam/")[2] for place in places if "/taskslam/" in place]
    return f"{own[-1] if own else '?'} ({places[-1]})"


def _needed_memory(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def limit_memory() -> None:
    """No more than a gibibyte on top of what there is."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, resource.getrlimit(resource.RLIMIT_AS)[1]))


def main(name: str, seed: int, first: int, count: int) -> None:
    """Feed the inputs from `first` on."""
    warnings.simplefilter("ignore")
    reader = READERS[name]
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        inputs = Inputs(reader, seed, folder / "example")
        for file in inputs._names:
            reader.read(inputs.folder, file)  # also warms up
        limit_memory()
        print("ready", file=out, flush=True)
        for number in range(first, first + count):
            with inputs.damaged(number) as file:
                kind, words = verdict(reader, inputs.folder, file)
            words = words.encode("ascii", "backslashreplace").decode().replace("\n", "\\n")[:600]
            print(number, kind, file, words, file=out, flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]))
