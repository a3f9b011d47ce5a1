"""One process at a time writes the run at a directory: a lock that dies with its holder and leaves nothing behind.

Some networks' file systems have no such locks, or none that other machines see. There whoever comes last goes on, and
the one before finds out by the name in the run's folder (`run_directory.py`).
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.files import writing

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}


def lock_file(directory: Path) -> Path:
    """What the holder of a run's lock holds."""
    return directory.with_name(f".{directory.name}.lock")


class RunLock:
    """Holds `.<name>.lock` beside a run's place, from construction to `release`.

    The file goes with the lock; that of a killed process is taken over. Since a holder removes it, whoever has locked a
    file looks whether it still is the one with that name.
    """

    def __init__(self, directory: Path) -> None:
        """Raises RecordError if another process holds it, DiskFullError if the folder cannot be written."""
        self._path = lock_file(directory)
        with writing(directory):
            while not self._take(directory):
                pass

    def release(self) -> None:
        """Let go. Releasing twice is harmless."""
        if self._file.closed:
            return
        with contextlib.suppress(OSError):  # a file that stays does no harm
            self._path.unlink(missing_ok=True)
        # Explicitly, because a forked child that outlives us shares the lock through its copy of the file.
        with contextlib.suppress(OSError):
            fcntl.flock(self._file, fcntl.LOCK_UN)
        self._file.close()

    def _take(self, directory: Path) -> bool:
        """Lock the file of that name; whether it is the one still that its name stands for."""
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        self._file = os.fdopen(os.open(self._path, flags, 0o666), "r+b", buffering=0)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise RecordError(
                f"{directory}: another process is writing this run; wait for it or name another folder"
            ) from None
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                raise
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(self._path.lstat(), os.fstat(self._file.fileno())):
                return True
        self._file.close()
        return False
