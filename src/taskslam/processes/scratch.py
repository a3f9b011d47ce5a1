"""Folders for files that nobody keeps: each is locked by the process that uses it, and swept once that is gone.

The lock dies with its process, so what a killed run left behind is told from what another run is using now.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import stat
import tempfile
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from taskslam.stopping import undisturbed

_PREFIX = "taskslam-"


class Scratch:
    """A new folder in the folder for temporary files; `close` removes it. The first one also sweeps stale ones.

    Raises:
        OSError: it cannot be made.
    """

    def __init__(self, purpose: str) -> None:
        sweep()
        self._lock = -1
        try:
            with undisturbed():
                self.folder, self._lock = _made_and_locked(f"{_PREFIX}{purpose}-")
        except BaseException:
            self.close()
            raise

    def create(self, name: str) -> BinaryIO:
        """A new file in it, open for writing; whatever a guest put there under this name is removed. Raises OSError."""
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name, dir_fd=self._lock)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
        return os.fdopen(os.open(name, flags, 0o600, dir_fd=self._lock), "wb")

    def open(self, name: str) -> BinaryIO | None:
        """A file in it, open for reading; None if there is none, or a guest made something else of that name."""
        with contextlib.suppress(OSError):
            flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK
            file = os.fdopen(os.open(name, flags, dir_fd=self._lock), "rb")
            if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return file
            file.close()
        return None

    def close(self) -> None:
        """Remove the folder with all that is in it, as far as it can be removed. Idempotent."""
        with undisturbed():
            if self._lock >= 0:
                _remove(self.folder)
                os.close(self._lock)
                self._lock = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.close()


@cache
def sweep() -> None:
    """Remove the folders that killed processes of this user left behind. Once in a process."""
    with contextlib.suppress(OSError), os.scandir(tempfile.gettempdir()) as entries:
        for entry in entries:
            if entry.name.startswith(_PREFIX) and entry.is_dir(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    _sweep_one(entry)


def _sweep_one(entry: os.DirEntry[str]) -> None:
    if entry.stat(follow_symlinks=False).st_uid != os.getuid():
        return
    lock = os.open(entry.path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        _remove(Path(entry.path))
    finally:
        os.close(lock)


def _made_and_locked(prefix: str) -> tuple[Path, int]:
    while True:
        folder = Path(tempfile.mkdtemp(prefix=prefix)).resolve()
        with contextlib.suppress(OSError):
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            with contextlib.suppress(OSError):
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if folder.stat().st_ino == os.fstat(lock).st_ino:  # nobody swept it before it was locked
                    return folder, lock
            os.close(lock)


def _remove(folder: Path) -> None:
    """With what a guest closed for itself: a folder without rights is given them again."""
    shutil.rmtree(folder, onerror=lambda _, path, __: _force(Path(path)))


def _force(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.parent.chmod(0o700)
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o700)
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
