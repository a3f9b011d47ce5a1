"""Open-loop replay: M rounds of a dataset through a SLAM method, recorded as a run without goals.

without-map: every round is a process of its own that starts from nothing. with-map: a priming round, then rounds that
begin with its map. A method that can save its map gives it to a fresh process for each round; another one that goes on
with its map (`map_mode: continue`) lives through all rounds, and is carried back to the beginning of the recording
between two of them.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from taskslam.benchmark.playback import LINGER, Beginning, Played, check_sensors, find_beginning, play
from taskslam.benchmark.run import finished_run, latency_words, machine, versions
from taskslam.datasets.dataset import Dataset
from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.processes.memory import own_peak_memory
from taskslam.record import Manifest, MethodNotice, RoundEnded, RoundStarted, RunEnded, RunWriter
from taskslam.slam import MapMode, MethodCard
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.host import Limits, MethodHost
from taskslam.slam.guest.latency import LatencyModel
from taskslam.slam.registry import load_method


@dataclass(frozen=True)
class ReplayRequest:
    """What to replay with. rounds: those that count; options: the method's own."""

    method: str
    mode: Mode = Mode.WITHOUT_MAP
    rounds: int = 1
    options: Mapping[str, Any] = field(default_factory=dict)
    latency: LatencyModel = field(default_factory=LatencyModel)
    limits: Limits = field(default_factory=Limits)


def replay(
    dataset: Dataset, request: ReplayRequest, out: Path, observer: Observer | None = None, overwrite: bool = False
) -> tuple[Path, bool]:
    """Replay; the run directory OUT/dataset/method/mode/seed0, and whether every round came to the dataset's end.

    A finished replay of the very same configuration is kept.

    Raises:
        DatasetError: the dataset lacks a sensor of the method, or cannot be read on.
        InputError: with-map for a method that keeps no map; UnknownMethodError, MethodUnavailableError.
        RecordError: another run stands there. InfrastructureError.
    """
    observer = observer or Observer()
    card = load_method(request.method).card
    if request.mode is Mode.WITH_MAP and card.map_mode is MapMode.NONE:
        raise InputError(f"method '{request.method}' keeps no map (map_mode none on its card): replay it without-map")
    check_sensors(dataset, card)
    directory = out / dataset.name / request.method.replace(":", "_").replace("/", "_") / request.mode / "seed0"
    described = _described(dataset)
    asked = (_hash(described), request.rounds, request.options, request.latency)
    if not overwrite and (finished := finished_run(directory, *asked)) is not None:
        observer.notice(f"{directory}: finished before, kept (--overwrite replays it again)")
        return directory, finished.complete
    with RunWriter(directory, replace=overwrite) as record:
        complete = _Replay(dataset, request, card, record, observer).run(described)
    return directory, complete


class _Replay:
    """One run: the counters that its rounds leave."""

    def __init__(
        self, dataset: Dataset, request: ReplayRequest, card: MethodCard, record: RunWriter, observer: Observer
    ) -> None:
        self._dataset = dataset
        self._request = request
        self._record = record
        self._observer = observer
        self._beginning: Beginning = find_beginning(dataset, card)
        self._time = 0  # ns of the run: rounds lie one after the other
        self._failure: str | None = None
        self._compute_s = 0.0
        self._method_peak_bytes = 0
        self._counted = (0, 0)

    def run(self, described: dict[str, Any]) -> bool:
        """All rounds, then run.json; whether every round came to the end."""
        started, wall = datetime.now(UTC), time.perf_counter()
        complete = self._without_map() if self._request.mode is Mode.WITHOUT_MAP else self._with_map()
        self._record.event(RunEnded(self._time, complete))
        request = self._request
        skipped = dict(sorted(self._dataset.skipped.items()))
        self._record.finish(
            Manifest(
                source="replay",
                scenario_name=self._dataset.name,
                scenario={"title": f"{self._dataset.name} (replay)", "dataset": described, "skipped": skipped},
                scenario_hash=_hash(described),
                method=request.method,
                method_card=json.loads(json.dumps(asdict(load_method(request.method).card), default=str)),
                method_options=dict(request.options),
                mode=request.mode,
                seed=0,
                rounds=request.rounds,
                latency=latency_words(request.latency),
                versions=versions(),
                machine=machine(),
                started_utc=started.isoformat(),
                wall_s=time.perf_counter() - wall,
                simulated_s=self._time / NANOSECONDS,
                compute_s=self._compute_s,
                method_peak_bytes=self._method_peak_bytes or None,
                own_peak_bytes=own_peak_memory(),
                complete=complete,
                failure=self._failure,
            )
        )
        return complete

    def _without_map(self) -> bool:
        complete = True
        for number in range(self._request.rounds):
            complete = self._lifetime(number, priming=False) and complete
        return complete

    def _with_map(self) -> bool:
        if not load_method(self._request.method).card.can_save_map:
            return self._one_lifetime()
        with tempfile.TemporaryDirectory() as folder:
            saved = Path(folder) / "map"
            if not self._lifetime(0, priming=True, then=lambda method: method.save_map(saved)):
                return False
            complete = True
            for number in range(1, self._request.rounds + 1):
                began = self._lifetime(number, priming=False, first=lambda method: method.load_map(saved))
                complete = began and complete
            return complete

    def _one_lifetime(self) -> bool:
        """All rounds in one process; the robot is carried back between them."""
        method, shift, number = self._new_method(), 0, 0
        self._begin(0, priming=True)
        try:
            method.start()
            for number in range(self._request.rounds + 1):
                if number:
                    self._begin(number, priming=False)
                played = self._play(method, number, shift)
                shift += played.end - self._beginning.stamp + 2 * LINGER
                self._end(method, number, Outcome.REACHED)
        except MethodFailedError as failure:
            self._fail(method, number, failure)
            return False
        finally:
            self._stop(method)
        return True

    def _lifetime(
        self,
        number: int,
        priming: bool,
        first: Callable[[MethodHost], None] | None = None,
        then: Callable[[MethodHost], None] | None = None,
    ) -> bool:
        """One round in a process of its own; whether it came to the dataset's end."""
        method = self._new_method()
        self._begin(number, priming)
        try:
            method.start()
            if first is not None:
                first(method)
            self._play(method, number, 0)
            if then is not None:
                then(method)
            self._end(method, number, Outcome.REACHED)
        except MethodFailedError as failure:
            self._fail(method, number, failure)
            return False
        finally:
            self._stop(method)
        return True

    def _new_method(self) -> MethodHost:
        request, log = self._request, self._record.method_log
        self._counted = (0, 0)
        return MethodHost(request.method, request.options, self._dataset.rig, log, request.latency, request.limits)

    def _play(self, method: MethodHost, number: int, shift: int) -> Played:
        base = self._time

        def elapsed(stamp: int) -> int:
            return base + max(0, stamp - self._beginning.stamp)

        def ticked(now: int) -> None:
            self._time = now
            self._observer.ticked(now)

        return play(self._dataset, self._beginning, method, self._record, number, shift, elapsed, ticked)

    def _begin(self, number: int, priming: bool) -> None:
        rounds = self._request.rounds + (self._request.mode is Mode.WITH_MAP)
        self._observer.round_begins(number, rounds, priming)
        self._record.event(RoundStarted(self._time, number, priming))

    def _end(self, method: MethodHost, number: int, outcome: Outcome) -> None:
        frames, dropped = method.frames - self._counted[0], method.dropped_frames - self._counted[1]
        self._counted = (method.frames, method.dropped_frames)
        self._record.event(RoundEnded(self._time, number, outcome, frames, dropped))

    def _fail(self, method: MethodHost, number: int, failure: MethodFailedError) -> None:
        self._failure = f"round {number}: {failure.outcome}: {failure.detail}"
        self._observer.notice(self._failure)
        self._record.event(MethodNotice(self._time, number, f"{failure.outcome}: {failure.detail}"))
        self._end(method, number, failure.outcome)

    def _stop(self, method: MethodHost) -> None:
        method.stop()
        self._compute_s += method.compute_s
        self._method_peak_bytes = max(self._method_peak_bytes, method.peak_memory)


def _described(dataset: Dataset) -> dict[str, Any]:
    """What of the dataset decides the result, as far as it can be known without reading it all."""
    return {
        "name": dataset.name,
        "kind": dataset.kind,
        "bytes": _size(dataset.path),
        "sensors": sorted(dataset.sensors),
        "rig": dataset.rig.model_dump(mode="json"),
    }


def _size(path: Path) -> int:
    if path.is_file():
        return path.stat().st_size
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def _hash(described: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(described, sort_keys=True).encode()).hexdigest()
