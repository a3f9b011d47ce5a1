"""How a process of ours ends: with a status that means one thing, and never without a word.

    0 done   1 the method failed its task   2 wrong usage or input   3 infrastructure, and whatever nobody thought of
    128 + n  stopped by signal n, after what was under way has been put away

open_standard_streams()
stop_on_signals()
try:
    work()
except BaseException as error:
    ending = ending_of(error)
"""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
import tempfile
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from taskslam.errors import DiskFullError, InfrastructureError, TaskSlamError
from taskslam.stopping import StoppedError


@dataclass(frozen=True)
class FailedEnding:
    """status: for the operating system; sentence: what went wrong; notes: what else its reader should know."""

    status: int
    sentence: str
    notes: tuple[str, ...] = ()


def ending_of(error: BaseException) -> FailedEnding:
    """What an error that nobody caught means. The traceback of an unexpected one goes to a file that is named."""
    notes = tuple(getattr(error, "__notes__", ()))
    if isinstance(error, StoppedError):
        return FailedEnding(128 + error.signal, str(error), notes)
    if isinstance(error, KeyboardInterrupt):
        return FailedEnding(128 + signal.SIGINT, "stopped by SIGINT", notes)
    if isinstance(error, TaskSlamError):
        return FailedEnding(error.exit_status, str(error), notes)
    if isinstance(error, MemoryError):
        what = "out of memory: this process may not have as much as it needs"
    else:
        said = " ".join(str(error).split())[:500]
        what = f"unexpected {type(error).__name__}{f': {said}' if said else ''}"
    return FailedEnding(InfrastructureError.exit_status, f"{what}; {_traceback_place(error)}", notes)


def _traceback_place(error: BaseException) -> str:
    """Where the traceback was written, in words: a file, or standard error where none can be."""
    try:
        text = "".join(traceback.format_exception(error))
    except (MemoryError, RecursionError):
        return "there is no traceback"
    try:
        handle, name = tempfile.mkstemp(prefix="taskslam-traceback-", suffix=".txt")
        try:
            with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
        except OSError:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError:  # no temporary folder, or a full one
        sys.stderr.write(text)
        return "the traceback stands above, as no file can be written"
    return f"the traceback is in {name}"


def open_standard_streams() -> None:
    """Standard streams that can be written: none that is closed, and a failure of each is what it should be.

    Results go to standard output: where it cannot take them, writing raises DiskFullError. What is said on standard
    error, progress and complaints, must never end a run: what cannot be said is lost.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # the lowest that is free: this one
    sys.stdout = _text(_Results(1, "wb", closefd=False), sys.stdout)
    sys.stderr = _text(_Remarks(2, "wb", closefd=False), sys.stderr)


def flush_standard_output() -> None:
    """Write what waits to be written. Raises DiskFullError; what could not be written is then forgotten."""
    try:
        sys.stdout.flush()
    except DiskFullError:
        with contextlib.suppress(OSError):  # so that the interpreter's own last flush meets no error
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        raise


class _Results(io.FileIO):
    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except OSError as error:
            raise DiskFullError(f"standard output: cannot be written: {error.strerror}") from error


class _Remarks(io.FileIO):
    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except OSError:
            return len(data)


def _text(raw: io.FileIO, like: TextIO | None) -> TextIO:
    """A text stream over `raw`; a character that its encoding lacks is written as its number."""
    encoding = (like.encoding if like else None) or "utf-8"
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding, "backslashreplace", line_buffering=raw.isatty())
