"""SHA-256 of what a run recorded, journal and trajectories: so that a file that has changed since can be named."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.reading import COMPRESSED, LARGEST_TABLE, open_file, read_bytes
from taskslam.record.compression import plain_or_compressed

_RECORDED = ("journal.jsonl", "round*/*.tum")
_NAME = re.compile(r"journal\.jsonl|round\d+/\w+\.tum")


def digests(folder: Path) -> dict[str, str]:
    """Digests of the recorded files of a run, by their paths in it."""
    files = sorted(path for pattern in _RECORDED for path in folder.glob(pattern))
    return {path.relative_to(folder).as_posix(): _digest(path) for path in files}


def changed_files(folder: Path, expected: Mapping[str, str]) -> tuple[str, ...]:
    """A sentence for every file that is not what it was when the run was finished."""
    sentences = []
    for name, digest in expected.items():
        if not _NAME.fullmatch(name):
            sentences.append(f"{folder}: run.json holds a digest of '{name:.80}', which is no file of a run")
            continue
        try:
            found = _digest(plain_or_compressed(folder / name))
        except RecordError as error:
            sentences.append(str(error))
        else:
            if found != digest:
                sentences.append(f"{folder / name}: has changed since the run was finished: its SHA-256 is another")
    return tuple(sentences)


def _digest(path: Path) -> str:
    """Of what is in the file, compressed or not."""
    if path.suffix == COMPRESSED:
        return hashlib.sha256(read_bytes(path, "record", RecordError, LARGEST_TABLE)).hexdigest()
    with open_file(path, "record", RecordError) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
