"""Writing files so that they are whole or absent: temp file, fsync, rename (design D7)."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import secrets
import shutil
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
    temporary = _unfinished(path)
    with writing(path), _alone_in(path.parent):
        temporary.unlink(missing_ok=True)  # what a killed process left, or a link that somebody put there
        try:
            with temporary.open("xb") as file:
                file.writelines(piece.encode("utf-8") if isinstance(piece, str) else piece for piece in pieces)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise
    sync_folder(path.parent)


def forget(path: Path) -> None:
    """Remove a file that `write_whole` wrote, and what a killed process left of it. Raises DiskFullError."""
    with writing(path):
        remove(path)
        remove(_unfinished(path))


def write_once(path: Path, content: bytes, mode: int = 0o666) -> None:
    """Write bytes, whole or not at all, unless the file is there: of several writers the first one's stays.

    That holds among machines too, since a link is made or not. What killed writers left is removed. Raises
    DiskFullError.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if not os.path.lexists(path):
            ours = path.with_name(f".{path.name}.{secrets.token_hex(8)}.once")
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
            with os.fdopen(os.open(ours, flags, mode), "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            with contextlib.suppress(FileExistsError, FileNotFoundError):  # another was faster, and has removed ours
                os.link(ours, path)
        for left in path.parent.glob(f".{path.name}.*.once"):
            left.unlink(missing_ok=True)


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Where a library that opens files itself writes one, which stands at `path` once the body has ended well.

    The name ends in the same suffix. Of a failed body nothing is kept, and a file that stands there stays. Raises
    DiskFullError, RecordError.
    """
    temporary = path.with_name(f".{path.stem}.partial{path.suffix}")
    with writing(path):
        path.absolute().parent.mkdir(parents=True, exist_ok=True)
    try:
        yield temporary
        with writing(path):
            temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def cache_folder() -> Path:
    """Where things are kept that can be made again: `TASKSLAM_CACHE`, or `taskslam` in the user's caches.

    A user without a home, as in a container, has no such place: then one where nothing can be made.
    """
    if own := os.environ.get("TASKSLAM_CACHE"):
        return Path(own).expanduser()
    if base := os.environ.get("XDG_CACHE_HOME"):
        return Path(base) / "taskslam"
    try:
        return Path.home() / ".cache" / "taskslam"
    except RuntimeError:
        return Path(os.devnull) / "taskslam"


@contextlib.contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other process writes a whole file into this folder. The lock dies with the process."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with contextlib.suppress(OSError):  # a network's file system may not lock folders
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _unfinished(path: Path) -> Path:
    """Where a file is written that will be whole."""
    return path.with_name(f".{path.name}.partial")


def remove(path: Path) -> None:
    """Remove a file, a folder with all that is in it, or a link; never what a link points to. Absent is as good."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Make renames inside a folder durable."""
    with writing(folder):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
