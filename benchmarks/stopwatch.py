"""`Stopwatch`: time by stage, each stage without what was named within it."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from threading import get_ident
from typing import Any


class Stopwatch:
    """Time by stage in one thread, by a clock of seconds; `rest` is what has no name."""

    def __init__(self, rest: str, clock: Callable[[], float] = time.perf_counter) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self._running: list[str] = [rest]
        self._clock = clock
        self._since = clock()
        self._thread = get_ident()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time spent within belongs to `name`."""
        if get_ident() != self._thread:
            yield
            return
        self._turn()
        self._running.append(name)
        try:
            yield
        finally:
            self._turn()
            self._running.pop()

    def _turn(self) -> None:
        now = self._clock()
        self.spent[self._running[-1]] += now - self._since
        self._since = now

    def restart(self) -> None:
        """Forget what was so far."""
        self._turn()
        self.spent.clear()

    @contextmanager
    def watching(self, stages: Iterable[tuple[Any, str, str]]) -> Iterator[None]:
        """Functions, given by owner and name, count under a title as long as this lasts."""
        stages = list(stages)
        kept = [(owner, name, getattr(owner, name)) for owner, name, _ in stages]
        for owner, name, title in stages:
            setattr(owner, name, self._timed(getattr(owner, name), title))
        try:
            yield
        finally:
            for owner, name, function in kept:
                setattr(owner, name, function)

    def _timed(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        """The same function, or generator, under a name."""

        def call(*arguments: Any, **more: Any) -> Any:
            with self.stage(name):
                result = function(*arguments, **more)
            return self._steps(result, name) if isinstance(result, Iterator) else result

        return call

    def _steps(self, generator: Iterator[Any], name: str) -> Iterator[Any]:
        while True:
            with self.stage(name):
                try:
                    value = next(generator)
                except StopIteration:
                    return
            yield value
