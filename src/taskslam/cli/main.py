"""Where the `taskslam` command begins, and how it ends: whatever happens, with a sentence and its exit status."""

from __future__ import annotations

import contextlib
import os
import resource
import sys
from dataclasses import replace

from taskslam.endings import ending_of, flush_standard_output, open_standard_streams
from taskslam.errors import DiskFullError, InfrastructureError
from taskslam.stopping import StoppedError, stop_behind, stop_on_signals

_ADDRESS_SPACE = 640 << 20  # bytes; with less, OpenBLAS ends the process or never returns


def main() -> None:
    """Entry point. Exit status: `endings.py`; a known error is one sentence, of any other a file holds the trace."""
    open_standard_streams()
    stop_on_signals()
    try:
        _run_the_verb()
    except BaseException as error:
        cause = _swallowed(error) if isinstance(error, SystemExit) else stop_behind(error)
        if cause is None:
            raise
        ending = ending_of(cause)
        if isinstance(cause, StoppedError):
            ending = replace(ending, sentence=f"{ending.sentence}; what is finished is kept, start again to go on")
    else:
        return
    for line in (f"taskslam: {ending.sentence}", *ending.notes):
        sys.stderr.write(f"{line}\n")
    sys.stderr.flush()
    sys.exit(ending.status)


def _run_the_verb() -> None:
    _check_the_ground()
    # Imported here, since an import can fail as well, for want of memory as an example.
    from taskslam.cli.app import app

    try:
        app()
    except SystemExit:
        flush_standard_output()
        raise
    except BaseException:
        with contextlib.suppress(DiskFullError):  # it must not hide what is to be told
            flush_standard_output()
        raise


def _swallowed(leaving: SystemExit) -> BaseException | None:
    """The error for which typer leaves with status 1 and without a word: a broken pipe or an end of file, anywhere."""
    cause = leaving.__context__
    if cause is not None and isinstance(cause.__cause__, EOFError):
        cause = cause.__cause__
    return cause if leaving.code == 1 and isinstance(cause, BrokenPipeError | EOFError) else None


def _check_the_ground() -> None:
    """Raise InfrastructureError where Python's libraries would end this process themselves, with a status of theirs."""
    try:
        os.getcwd()  # noqa: PTH109 its error is the question
    except OSError as error:
        raise InfrastructureError(f"the working folder cannot be used: {error.strerror}; go to another one") from error
    granted, _ = resource.getrlimit(resource.RLIMIT_AS)
    if granted != resource.RLIM_INFINITY and granted < _ADDRESS_SPACE:
        raise InfrastructureError(
            f"out of memory: this process may have {granted >> 20} MiB of address space (ulimit -v); expected at least"
            f" {_ADDRESS_SPACE >> 20}"
        )
