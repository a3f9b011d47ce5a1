"""Writing files so that they are whole or absent: temp file, fsync, rename (design D7)."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from taskslam.errors import DiskFullError, RecordError

_NOT_WRITABLE = {errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EPERM, errno.EROFS, errno.EIO, errno.EFBIG}
_NOT_WRITABLE |= {errno.ENOENT}  # a folder that cannot be made, such as one below /proc
_NO_PLACE = {errno.ENOTDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.ELOOP}


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an OSError from the body into DiskFullError (cannot be written) or RecordError (no place for a file)."""
    try:
        yield
    except OSError as error:
        if error.errno in _NOT_WRITABLE:
            raise DiskFullError(
                f"{path}: cannot be written: {error.strerror}. Free some space or name another output folder."
            ) from error
        if error.errno in _NO_PLACE:
            obstacle = next((place for place in (path, *path.parents) if place.is_file()), None)
            why = f"{obstacle} is a file, expected a folder" if obstacle else error.strerror
            raise RecordError(f"{path}: cannot be created: {why}. Name another output folder.") from error
        raise


def write_whole(path: Path, content: str | bytes | Iterable[str]) -> None:
    """Write text (as UTF-8) or bytes, whole or not at all; an existing file is replaced. Raises DiskFullError.

    Text may come in pieces, which then need not be in memory together.
    """
    pieces = [content] if isinstance(content, str | bytes) else content
    temporary = path.with_name(f".{path.name}.partial")
    with writing(path):
        try:
            with temporary.open("wb") as file:
                file.writelines(piece.encode("utf-8") if isinstance(piece, str) else piece for piece in pieces)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except OSError:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise
    sync_folder(path.parent)


def cache_folder() -> Path:
    """Where things are kept that can be made again: `TASKSLAM_CACHE`, or `taskslam` in the user's caches."""
    if own := os.environ.get("TASKSLAM_CACHE"):
        return Path(own).expanduser()
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "taskslam"


def sync_folder(folder: Path) -> None:
    """Make renames inside a folder durable."""
    with writing(folder):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
