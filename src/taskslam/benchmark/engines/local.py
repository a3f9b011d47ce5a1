"""The engine of this machine: worker processes, one run each, as many at a time as cores and memory allow."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.allotment import Allotment
from taskslam.benchmark.engines.supervised import Order, Workers, drive, without_driving
from taskslam.benchmark.resources import Resources
from taskslam.benchmark.spec import RunSpec
from taskslam.errors import InputError


@dataclass(frozen=True)
class LocalEngine:
    """cores: that all runs together take. folders: where worlds and maps of the user's lie. resources: of a run."""

    cores: int = 1
    folders: tuple[Path, ...] = ()
    resources: Resources = field(default_factory=Resources)

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Generator[Result, None, None]:
        """As `Engine.run`. Whoever stops in the middle closes the generator: then all workers end, and keep rounds."""
        heard, workers, allotment = OneAtATime(watcher), Workers(), Allotment(self.cores)
        with ThreadPoolExecutor(max_workers=self.cores) as pool:
            try:
                yield from pool.map(lambda spec: self._run(spec, out, heard, workers, allotment), specs)
            except BaseException:
                workers.stop()
                raise

    def _run(self, spec: RunSpec, out: Path, watcher: Watcher, workers: Workers, allotment: Allotment) -> Result:
        result = without_driving(spec, out)
        if result is None:
            share = self.resources.of(spec.method)
            try:
                with allotment.lent(share) as cores:
                    watcher.begins(spec)
                    order = Order(spec, out, self.folders, min(share.cores, self.cores), cores)
                    result = drive(order, watcher, workers)
            except InputError as error:
                result = Result(spec.title, Ending.REFUSED, str(error), spec)
        watcher.ends(result)
        return result


class OneAtATime(Watcher):
    """Passes on what several threads say, one call at a time."""

    def __init__(self, watcher: Watcher) -> None:
        self._watcher = watcher
        self._lock = Lock()

    def begins(self, spec: RunSpec) -> None:
        """A run starts."""
        with self._lock:
            self._watcher.begins(spec)

    def goes_on(self, spec: RunSpec, progress: dict[str, object]) -> None:
        """A line of progress from a run."""
        with self._lock:
            self._watcher.goes_on(spec, progress)

    def ends(self, result: Result) -> None:
        """A run is over."""
        with self._lock:
            self._watcher.ends(result)
