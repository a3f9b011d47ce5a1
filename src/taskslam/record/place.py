"""The place of a run: the directory where it will stand, and beside it, hidden, what is not finished or being replaced.

    .<name>.partial    a run that is under way, or was interrupted
    .<name>.replaced   for a moment, the finished run that a new one takes the place of
    .<name>.lock       held by the process that writes (`run_lock.py`)

A process may be killed between any two steps; the next one does the rest. A folder with run.json is whole: what only a
run under way needs goes after that is written, and before the folder is moved.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from pydantic import ValidationError

from taskslam.errors import DiskFullError, RecordError
from taskslam.files import remove, sync_folder, writing
from taskslam.reading import LARGEST_MANIFEST, read_bytes
from taskslam.record.digests import changed_files
from taskslam.record.manifest import MANIFEST_FILE, Manifest
from taskslam.record.newest import NEWEST
from taskslam.record.resumption import TALLY
from taskslam.record.run_lock import RunLock, lock_file

WRITER = "writer"
"""A file with the name of the start that writes."""
_PARTIAL = ".partial"
_OF_A_RUN_UNDER_WAY = (TALLY, NEWEST, WRITER)


def partial_folder(directory: Path) -> Path:
    """Where a run lives until it is finished."""
    return directory.with_name(f".{directory.name}{_PARTIAL}")


def is_partial(folder: Path) -> bool:
    """Whether it is such a place."""
    return folder.name.startswith(".") and folder.name.endswith(_PARTIAL)


def finished_place(partial: Path) -> Path:
    """Where the run of such a place will stand."""
    return partial.with_name(partial.name.removeprefix(".").removesuffix(_PARTIAL))


@contextlib.contextmanager
def whole_folder(place: Path) -> Iterator[Path]:
    """A new folder to fill, which stands at `place` once the body has ended well; of a failed one nothing is kept.

    Raises RecordError if another process is filling it, DiskFullError.
    """
    place = place.absolute()
    folder = partial_folder(place)
    with writing(place):
        place.parent.mkdir(parents=True, exist_ok=True)
    lock = RunLock(place)
    try:
        with writing(place):
            remove(folder)  # what a killed process left
            folder.mkdir()
            yield folder
            folder.rename(place)
            sync_folder(place.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            remove(folder)
        error.__notes__ = [f"Nothing is kept of {place}"]  # whatever was said of a place in it is gone
        raise
    finally:
        lock.release()


def settle(directory: Path) -> None:
    """Do what a process had left to do that was killed while it moved a finished run into its place.

    Raises RecordError if another process is writing it, DiskFullError.
    """
    directory = directory.absolute()
    if any(place.exists() for place in (partial_folder(directory) / MANIFEST_FILE, _replaced(directory))):
        lock = RunLock(directory)
        try:
            settle_locked(directory)
        finally:
            lock.release()
    elif lock_file(directory).exists():
        with contextlib.suppress(RecordError, DiskFullError):  # somebody holds it, or nothing can be removed here
            RunLock(directory).release()


def settle_locked(directory: Path) -> None:
    """As `settle`, by the holder of the lock."""
    folder, old = partial_folder(directory), _replaced(directory)
    if _is_whole(folder):
        move_into_place(folder, directory, replace=True)
    with writing(directory):
        if is_taken(directory):
            remove(old)
        elif old.is_dir() and not old.is_symlink():
            remove(directory)
            old.rename(directory)


def _is_whole(folder: Path) -> bool:
    """Whether all of a run is there, run.json included, which is written last."""
    if not (folder / MANIFEST_FILE).is_file() or not is_plain(folder):
        return False
    try:
        content = read_bytes(folder / MANIFEST_FILE, "run", RecordError, LARGEST_MANIFEST)
        manifest = Manifest.model_validate_json(content)
    except (RecordError, ValidationError):
        return False
    return not changed_files(folder, manifest.files)


def is_plain(folder: Path) -> bool:
    """Whether a folder, itself none by a link, holds files and folders alone: no link leads out of it."""
    places = [folder, *folder.rglob("*")]
    return all(stat.S_ISREG(mode) or stat.S_ISDIR(mode) for mode in (place.lstat().st_mode for place in places))


def is_taken(directory: Path) -> bool:
    """Whether anything stands there but an empty folder."""
    if directory.is_symlink() or not directory.is_dir():
        return directory.is_symlink() or directory.exists()
    return any(directory.iterdir())


def _replaced(directory: Path) -> Path:
    """Where a run that is being replaced stands for a moment."""
    return directory.with_name(f".{directory.name}.replaced")


def move_into_place(folder: Path, directory: Path, replace: bool) -> None:
    """Put a whole run from its partial folder into its place, on the disk too. Raises DiskFullError, RecordError."""
    with writing(folder):
        for name in _OF_A_RUN_UNDER_WAY:
            remove(folder / name)
        _synced(folder)
    with writing(directory):
        if replace and is_taken(directory):
            old = _replaced(directory)
            remove(old)
            directory.rename(old)
            folder.rename(directory)
            remove(old)
        else:
            folder.rename(directory)
        sync_folder(directory.parent)


def _synced(folder: Path) -> None:
    for place, _, files in os.walk(folder):
        for name in files:
            descriptor = os.open(Path(place) / name, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        sync_folder(Path(place))
