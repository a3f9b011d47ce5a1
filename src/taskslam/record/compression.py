"""Trajectories of finished runs, compressed: a third of the room, and nothing lost.

`round00/truth.tum` becomes `round00/truth.tum.gz`, which `zcat` and numpy read; `gunzip` brings back the very bytes.
run.json goes on naming the digests of what is in the files, so that a run is the same run either way, and readers take
what is there. A kill between two steps leaves both forms of a file; the plain one counts, and the next call goes on.
"""

from __future__ import annotations

import gzip
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.files import remove, write_whole, writing
from taskslam.reading import COMPRESSED, LARGEST_TABLE, read_bytes

_LEVEL = 6  # of gzip's nine: more takes longer than it saves


def plain_or_compressed(path: Path) -> Path:
    """A file's path, or that of its compressed form where only this is there."""
    packed = _packed(path)
    return packed if packed.exists() and not path.exists() else path


def compress_trajectories(run: Path) -> int:
    """Compress the trajectories of a finished run; bytes of the disk that this has freed.

    Raises RecordError: a file cannot be read; DiskFullError: none has become smaller then, and nothing is lost.
    """
    return sum(_replace(path, _packed(path)) for path in sorted(run.glob("round*/*.tum")))


def expand_trajectories(run: Path) -> int:
    """Bring back what was compressed; bytes of the disk that this has freed, a number below zero. Raises as above."""
    freed = 0
    for path in sorted(run.glob(f"round*/*.tum{COMPRESSED}")):
        plain = path.with_suffix("")
        if plain.exists():  # what a kill left of a compression
            freed += path.stat().st_size
            with writing(path):
                remove(path)
        else:
            freed += _replace(path, plain)
    return freed


def _replace(old: Path, new: Path) -> int:
    """Put the same content where `new` says, whole, and remove the old form of it; bytes freed."""
    content = read_bytes(old, "trajectory", RecordError, LARGEST_TABLE)
    data = gzip.compress(content, _LEVEL, mtime=0) if new.suffix == COMPRESSED else content
    before = old.stat().st_size
    write_whole(new, data)
    if read_bytes(new, "trajectory", RecordError, LARGEST_TABLE) != content:
        raise RecordError(f"{new}: does not hold what was written into it; {old} is kept")
    with writing(old):
        remove(old)
    return before - len(data)


def _packed(path: Path) -> Path:
    return path.with_name(path.name + COMPRESSED)
