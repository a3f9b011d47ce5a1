"""A signal that asks this process to end, as an exception; and what it must not tear.

stop_on_signals()
with undisturbed():
    resource = made()  # a signal that comes meanwhile is raised at the end of the block
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_PUTTING_AWAY_S = 20.0  # so long a second signal does not disturb what the first has begun


class StoppedError(BaseException):
    """A signal asks this process to end. Not an Exception: whoever forgives failures must not forgive this."""

    def __init__(self, number: int) -> None:
        self.signal = signal.Signals(number)
        super().__init__(f"stopped by {self.signal.name}")


class _Door:
    """Whether a signal may come in (`closed` is 0), the one that waits, and the one that came in."""

    closed = 0
    waiting: int | None = None
    entered: int | None = None


def stop_on_signals() -> None:
    """From now on INT, TERM and HUP raise StoppedError in the main thread. One that was ignored stays ignored.

    The same signal comes twice where a terminal and a parent both send it: for a while only the first counts.
    """
    if not _in_main_thread():
        return
    first: list[float] = []
    _Door.entered = None

    def stop(number: int, _: FrameType | None) -> None:
        now = time.monotonic()
        if first and now - first[0] < _PUTTING_AWAY_S:
            return
        first[:] = [now]
        if _Door.closed:
            _Door.waiting = number
        else:
            _enter(number)

    for one in _SIGNALS:
        if signal.getsignal(one) is not signal.SIG_IGN:
            signal.signal(one, stop)


def waits_are_interrupted() -> None:
    """See to it that INT ends a wait of the main thread again, after a library was imported that hears INT itself.

    polars has a handler of its own, whose flag (SA_RESTART) lets a wait for a lock go on until the lock is free.
    """
    signal.siginterrupt(signal.SIGINT, True)


@contextmanager
def undisturbed() -> Iterator[None]:
    """A block that no StoppedError tears: one that comes meanwhile is raised when the outermost block has ended.

    For short steps that make something and note that it is there, or put it away.
    """
    if not _in_main_thread():  # only the main thread hears signals
        yield
        return
    _Door.closed += 1
    try:
        yield
    finally:
        _Door.closed -= 1
        if not _Door.closed and _Door.waiting is not None:
            number, _Door.waiting = _Door.waiting, None
            _enter(number)


def stop_behind(error: BaseException) -> BaseException:
    """What ends this process: the stop that compiled code turned into an error of its own, or else the error itself.

    pydantic does so with whatever comes out of a function that it calls.
    """
    if isinstance(error, Exception) and _Door.entered is not None:
        return StoppedError(_Door.entered)
    return error


def _enter(number: int) -> NoReturn:
    _Door.entered = number
    raise StoppedError(number)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
