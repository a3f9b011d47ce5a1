"""Maps on disk: one npz of plain arrays (nothing pickled) that says whose map it is and in which version."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np

from taskslam.errors import DiskFullError, RecordError
from taskslam.reading import LARGEST_ARCHIVE, read_arrays
from taskslam.reading import Arrays as Arrays


def write_archive(path: Path, method: str, version: int, arrays: Arrays) -> None:
    """Write a method's map to `path`, whole or not at all.

    Raises:
        DiskFullError: the file cannot be written; says why.
    """
    buffer = io.BytesIO()
    marks = {"format": np.array(_mark(method)), "version": np.array(version)}
    np.savez_compressed(buffer, allow_pickle=False, **marks, **arrays)
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as file:
            file.write(buffer.getvalue())
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise DiskFullError(f"{path}: cannot write the {method} map: {error.strerror}") from error


def read_archive(path: Path, method: str, version: int, names: set[str]) -> Arrays:
    """The arrays of a map that `write_archive` wrote, every one of `names` among them; floats are finite.

    Raises:
        RecordError: the file is absent, truncated, or of another kind or version; says which.
    """
    arrays = read_arrays(path, f"{method} map", RecordError, LARGEST_ARCHIVE)
    missing = sorted((names | {"format", "version"}) - set(arrays))
    if missing or str(arrays["format"]) != _mark(method):
        raise RecordError(f"{path}: not a {method} map (missing: {', '.join(missing) or 'its mark'})")
    found = arrays["version"]
    if found.shape != () or str(found) != str(version):
        raise RecordError(f"{path}: {method} map of version {found}, and this program reads version {version}")
    for name in sorted(names):
        if arrays[name].dtype.kind == "f" and not np.isfinite(arrays[name]).all():
            raise RecordError(f"{path}: {method} map holds values in {name} that are not finite")
    return arrays


def _mark(method: str) -> str:
    return f"taskslam {method} map"
