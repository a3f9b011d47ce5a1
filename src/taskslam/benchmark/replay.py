"""Open-loop replay: M rounds of a dataset through a SLAM method, recorded as a run without goals.

without-map: every round is a process of its own that starts from nothing. with-map: a priming round, then rounds that
begin with its map. A method that can save its map gives it to a fresh process for each round; another one that goes on
with its map (`map_mode: continue`) lives through all rounds, and is carried back to the beginning of the recording
between two of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from taskslam.benchmark.playback import LINGER, Beginning, Played, check_sensors, find_beginning, play
from taskslam.benchmark.run import finished_run, machine, said_by, versions
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.datasets.dataset import Dataset
from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.processes.memory import own_peak_memory
from taskslam.processes.scratch import Scratch
from taskslam.record import DrivenBy, Manifest, MethodNotice, RoundEnded, RoundStarted, RunEnded, RunWriter
from taskslam.record.place import settle
from taskslam.slam import MapMode, MethodCard
from taskslam.slam.cards import card_of
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.host import Limits, MethodHost


def replay(
    dataset: Dataset,
    spec: RunSpec,
    out: Path,
    observer: Observer | None = None,
    overwrite: bool = False,
    limits: Limits | None = None,
) -> tuple[Path, bool]:
    """Replay; the run directory, and whether every round came to the dataset's end. spec: of `spec_of_replay`.

    A finished replay of the very same spec is kept, and without-map the rounds of an interrupted one that had ended.

    Raises:
        DatasetError: the dataset lacks a sensor of the method, or cannot be read on.
        InputError: with-map for a method that keeps no map; UnknownMethodError, MethodUnavailableError.
        RecordError: another run stands there. InfrastructureError.
    """
    observer = observer or Observer()
    card = card_of(spec.method)
    if spec.mode is Mode.WITH_MAP and card.map_mode is MapMode.NONE:
        raise InputError(f"method '{spec.method}' keeps no map (map_mode none on its card): replay it without-map")
    check_sensors(dataset, card)
    directory = run_folder(out, spec)
    settle(directory)
    if not overwrite and (finished := finished_run(directory, spec)) is not None:
        observer.notice(f"{directory}: finished before, kept (--overwrite replays it again)")
        return directory, finished.complete
    resume = spec.mode is Mode.WITHOUT_MAP
    with RunWriter(directory, overwrite, spec.to_json(), resume) as record:
        if record.notice:
            observer.notice(record.notice)
        complete = _Replay(dataset, spec, limits or Limits(), card, record, observer, out).run()
    return directory, complete


class _Replay:
    """One run: the counters that its rounds leave."""

    def __init__(
        self,
        dataset: Dataset,
        spec: RunSpec,
        limits: Limits,
        card: MethodCard,
        record: RunWriter,
        observer: Observer,
        out: Path,
    ) -> None:
        self._dataset = dataset
        self._card = card
        self._out = out
        self._proven = False
        self._spec = spec
        self._limits = limits
        self._record = record
        self._observer = observer
        self._beginning: Beginning = find_beginning(dataset, card)
        done = record.resumed
        self._time = done.now  # ns of the run: rounds lie one after the other
        self._failure = done.failure
        self._compute_s = done.compute_s
        self._method_peak_bytes = done.peak_bytes
        self._method_cpu_s = done.cpu_s
        self._stop_failures = [*done.stop_failures]
        self._counted = (0, 0)

    def run(self) -> bool:
        """All rounds, then run.json; whether every round came to the end."""
        wall, before = time.perf_counter(), self._record.resumed.wall_s
        complete = self._without_map() if self._spec.mode is Mode.WITHOUT_MAP else self._with_map()
        self._record.event(RunEnded(self._time, complete))
        task = self._spec.task.model_dump(mode="json", exclude={"source", "rounds"})
        skipped = dict(sorted(self._dataset.skipped.counts.items()))
        self._record.finish(
            Manifest(
                **said_by(self._spec, self._card),
                driven_by=DrivenBy.RECORDING,
                scenario={
                    "title": f"{self._dataset.name} (replay)",
                    "dataset": task,
                    "skipped": skipped,
                    "notes": self._dataset.notes,
                },
                versions=versions(),
                machine=machine(),
                started_utc=self._record.began_utc,
                wall_s=before + time.perf_counter() - wall,
                simulated_s=self._time / NANOSECONDS,
                compute_s=self._compute_s,
                method_peak_bytes=self._method_peak_bytes or None,
                method_cpu_s=self._method_cpu_s or None,
                stop_failures=tuple(self._stop_failures),
                own_peak_bytes=own_peak_memory(),
                complete=complete,
                failure=self._failure,
            )
        )
        return complete

    def _without_map(self) -> bool:
        done = self._record.resumed
        complete = done.complete
        for number in range(done.rounds, self._spec.task.rounds):
            complete = self._lifetime(number, priming=False) and complete
        return complete

    def _with_map(self) -> bool:
        if not self._card.can_save_map:
            return self._one_lifetime()
        with Scratch("replay") as scratch:
            saved = scratch.folder / "map"
            if not self._lifetime(0, priming=True, then=lambda method: method.save_map(saved)):
                return False
            complete = True
            for number in range(1, self._spec.task.rounds + 1):
                began = self._lifetime(number, priming=False, first=lambda method: method.load_map(saved))
                complete = began and complete
            return complete

    def _one_lifetime(self) -> bool:
        """All rounds in one process; the robot is carried back between them."""
        method, shift, number = self._new_method(), 0, 0
        self._begin(0, priming=True)
        try:
            method.start()
            for number in range(self._spec.task.rounds + 1):
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
            method.stop()
            self._end(method, number, Outcome.REACHED)
        except MethodFailedError as failure:
            self._fail(method, number, failure)
            return False
        finally:
            self._stop(method)
        return True

    def _new_method(self) -> MethodHost:
        spec, log, rig = self._spec, self._record.method_log, self._dataset.rig
        self._counted = (0, 0)
        return MethodHost(
            spec.method,
            spec.options,
            rig,
            log,
            spec.latency,
            self._limits,
            self._card,
            (self._out, self._dataset.path),
            self._proven,
        )

    def _play(self, method: MethodHost, number: int, shift: int) -> Played:
        base = self._time

        def elapsed(stamp: int) -> int:
            return base + max(0, stamp - self._beginning.stamp)

        def ticked(now: int) -> None:
            self._time = now
            self._observer.ticked(now)

        return play(self._dataset, self._beginning, method, self._record, number, shift, elapsed, ticked)

    def _begin(self, number: int, priming: bool) -> None:
        rounds = self._spec.task.rounds + (self._spec.mode is Mode.WITH_MAP)
        self._observer.round_begins(number, rounds, priming)
        self._record.event(RoundStarted(self._time, number, priming))

    def _end(self, method: MethodHost, number: int, outcome: Outcome) -> None:
        frames, dropped = method.frames - self._counted[0], method.dropped_frames - self._counted[1]
        self._counted = (method.frames, method.dropped_frames)
        self._record.tally(number, method.compute_s, method.peak_memory, method.cpu_s, method.stop_failure)
        self._record.event(RoundEnded(self._time, number, outcome, frames, dropped))

    def _fail(self, method: MethodHost, number: int, failure: MethodFailedError) -> None:
        self._failure = f"round {number}: {failure.outcome}: {failure.detail}"
        self._observer.notice(self._failure)
        self._record.event(MethodNotice(self._time, number, f"{failure.outcome}: {failure.detail}"))
        self._end(method, number, failure.outcome)

    def _stop(self, method: MethodHost) -> None:
        method.stop()
        self._proven = self._proven or method.started
        self._method_cpu_s += method.cpu_s
        if method.stop_failure:
            self._stop_failures.append(method.stop_failure)
            self._observer.notice(method.stop_failure)
        self._compute_s += method.compute_s
        self._method_peak_bytes = max(self._method_peak_bytes, method.peak_memory)
