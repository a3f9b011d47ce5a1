"""A folder of runs as somebody sees it who only looks: a campaign, what one command drove, or a single run.

    watched = Watched(Path("tuning"))
    look = watched.look()           # every run and how far it is, and when all of it will be done
    watched.closer(look.runs[0])    # one of them: its goals, what happened, where the robot is

Nothing is written there and no lock is taken: whoever drives notices nothing.
"""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from taskslam.benchmark.campaign.notes import Note, notes
from taskslam.benchmark.campaign.plan_file import KeptPlan, campaign_folder, has_plan, read_plan
from taskslam.benchmark.campaign.price import Price, Prices
from taskslam.benchmark.campaign.state import State, where_is
from taskslam.benchmark.resources import Resources
from taskslam.benchmark.spec import Drive, RunSpec, run_folder
from taskslam.errors import InputError, RecordError
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.reading import LARGEST_JOURNAL, LARGEST_MANIFEST, read_bytes
from taskslam.record.compression import plain_or_compressed
from taskslam.record.events import Event, GoalStarted, RoundStarted, round_in_words
from taskslam.record.journal import read_lines
from taskslam.record.manifest import Manifest
from taskslam.record.newest import Newest, few, newest_state, read_newest, with_way
from taskslam.record.place import finished_place, partial_folder
from taskslam.record.run_directory import (
    JOURNAL,
    MANIFEST,
    SPEC,
    find_partial_runs,
    find_runs,
    load_manifest,
    round_folder,
)
from taskslam.record.trajectories import read_trajectory

_PRICES_STAY_S = 20.0  # before finished runs are asked again what runs cost
_GOALS_DONE = tuple(f'"event":"{kind}"'.encode() for kind in ("arrival", "goal_failed", "goal_skipped"))
_ROUND_DONE = b'"event":"round_ended"'
_NO_SCAN = np.empty((0, 2))


@dataclass(frozen=True)
class Seen:
    """A run from outside.

    folder: where it stands, or will; spec: None of one that does not say its own; done: share of its goals that are
    behind it; complete: of a finished run, whether every goal was reached; detail: what failed, or kept it from being
    driven; written_ns: of a finished run, when that was, by the clock of its file.
    """

    folder: Path
    scenario: str
    way: str
    mode: Mode
    seed: int
    state: State
    done: float
    spec: RunSpec | None = None
    complete: bool | None = None
    detail: str = ""
    written_ns: int = 0

    @property
    def title(self) -> str:
        """For people."""
        return f"{self.scenario} · {self.way} · {self.mode} · seed {self.seed}"

    @property
    def files(self) -> Path:
        """Where its files are now."""
        return self.folder if self.state is State.FINISHED else partial_folder(self.folder)


@dataclass(frozen=True)
class Outlook:
    """What is left, and how long it takes as things go now.

    core_s: seconds of a core, by the prices of the runs; seconds: None where nothing is under way; measured: whether
    finished runs of this folder have told all prices.
    """

    core_s: float
    seconds: float | None
    measured: bool


@dataclass(frozen=True)
class Look:
    """All runs of the folder, in the order of its plan or of their names. outlook: None if it cannot be told."""

    runs: tuple[Seen, ...]
    outlook: Outlook | None

    @property
    def counts(self) -> Counter[State]:
        """How many runs are how far."""
        return Counter(run.state for run in self.runs)

    @property
    def under_way(self) -> list[Seen]:
        """Those that are being driven."""
        return [run for run in self.runs if run.state is State.UNDER_WAY]


@dataclass(frozen=True)
class Closer:
    """A run from close by. rounds: with a priming round; goals: of one round; newest: None where nothing is known."""

    seen: Seen
    rounds: int
    start: SE2 | None
    goals: tuple[SE2, ...]
    events: tuple[Event, ...]
    newest: Newest | None

    @property
    def now(self) -> int | None:
        """The newest instant that is known, ns of simulated time."""
        known = [event.t for event in self.events[-1:]] + ([] if self.newest is None else [self.newest.t])
        return max(known, default=None)

    @property
    def round(self) -> int | None:
        """The last round that was begun."""
        return next((event.round for event in reversed(self.events) if isinstance(event, RoundStarted)), None)

    @property
    def heading(self) -> int | None:
        """The goal that the robot is on its way to, or the last one that it was."""
        return next((event.goal for event in reversed(self.events) if isinstance(event, GoalStarted)), None)

    def round_in_words(self, number: int) -> str:
        """A round as a person counts."""
        primed = self.seen.mode is Mode.WITH_MAP
        name = round_in_words(number, primed)
        return name if primed and number == 0 else f"{name} of {self.rounds - primed}"


class Watched:
    """A folder that is looked at again and again."""

    def __init__(self, folder: Path) -> None:
        """Look for the first time. Raises RecordError if there is no run and no campaign, or its plan is damaged."""
        self.folder = folder.absolute()
        self._plan: tuple[int, KeptPlan, tuple[Seen, ...]] | None = None
        self._begun: dict[Path, Seen] = {}
        self._finished: dict[Path, tuple[int, Seen]] = {}
        self._digests: dict[Path, str] = {}
        self._prices: _Priced | None = None
        if not self.look().runs:
            raise RecordError(
                f"{folder}: no run, finished or under way; expected a campaign's folder, or that of a run"
            )

    def look(self) -> Look:
        """How far all is at this moment. Raises RecordError: a campaign's plan has become unreadable."""
        if has_plan(self.folder):
            said = notes(self.folder)
            runs = tuple(self._seen(run, said) for run in self._planned()[1])
        else:
            found = (self._found(place) for place in self._places())
            runs = tuple(run for run in found if run is not None)
        return Look(runs, self._outlook(runs))

    def closer(self, run: Seen) -> Closer:
        """What is known of one run; of one that has not begun, its tour."""
        start, goals, rounds = _tour(run.spec)
        events: tuple[Event, ...] = ()
        with contextlib.suppress(RecordError):
            lines, _ = read_lines(run.files / JOURNAL)
            events = tuple(line.event for line in lines if not isinstance(line.event, str))
        if run.state is not State.FINISHED:
            return Closer(run, rounds, start, goals, events, read_newest(run.files))
        manifest = self._manifest(run.folder)
        if manifest is not None:
            start, goals = manifest.start, manifest.goals
            rounds = manifest.rounds + (manifest.mode is Mode.WITH_MAP)
        return Closer(run, rounds, start, goals, events, _last_of(run.folder, events))

    def _planned(self) -> tuple[KeptPlan, tuple[Seen, ...]]:
        """The campaign, and its runs as if none had begun; read anew when the plan has changed."""
        written = (campaign_folder(self.folder) / "plan.json").stat().st_mtime_ns
        if self._plan is None or self._plan[0] != written:
            kept = read_plan(self.folder)
            runs = tuple(_waiting(run_folder(self.folder, spec), spec) for spec in kept.plan.specs)
            self._plan = (written, kept, runs)
            self._digests, self._prices = {}, None
        return self._plan[1:]

    def _places(self) -> Iterator[Path]:
        """Where runs stand or will, sorted: below the folder, or at it."""
        begun = find_partial_runs(self.folder)
        begun += [partial_folder(self.folder)] if (partial_folder(self.folder) / JOURNAL).exists() else []
        places = {finished_place(folder) for folder in begun} | set(find_runs(self.folder))
        return iter(sorted(places))

    def _found(self, place: Path) -> Seen | None:
        """A run that no plan tells of, by what its folder says."""
        if place not in self._begun:
            for folder in (place, partial_folder(place)):
                with contextlib.suppress(RecordError, InputError):
                    text = read_bytes(folder / SPEC, "run's spec", RecordError, LARGEST_MANIFEST)
                    self._begun[place] = _waiting(place, RunSpec.from_json(text))
                    break
        run = self._begun.get(place)
        return self._seen_finished(place, None) if run is None else self._seen(run, {})

    def _seen(self, run: Seen, said: Mapping[str, Note]) -> Seen:
        """How far a run is by now. said: why runs could not be driven, by their digests."""
        assert run.spec is not None
        note = said.get(self._digest_of(run)) if said else None
        state = where_is(run.folder, note)
        if state is State.WAITING:
            return run
        if state is State.FINISHED:
            return self._seen_finished(run.folder, run.spec) or replace(run, state=state, done=1.0)
        detail = "" if note is None else f"{note.ending}: {note.detail}"
        return replace(run, state=state, done=_share_done(run.folder, run.spec), detail=detail)

    def _digest_of(self, run: Seen) -> str:
        assert run.spec is not None
        if run.folder not in self._digests:
            self._digests[run.folder] = run.spec.digest
        return self._digests[run.folder]

    def _seen_finished(self, folder: Path, spec: RunSpec | None) -> Seen | None:
        try:
            written = (folder / MANIFEST).stat().st_mtime_ns
        except OSError:
            return None
        if (kept := self._finished.get(folder)) is None or kept[0] != written:
            manifest = self._manifest(folder)
            if manifest is None:
                return None
            way = manifest.method if spec is None else spec.way
            seen = Seen(
                folder, manifest.scenario_name, way, manifest.mode, manifest.seed, State.FINISHED, 1.0, spec,
                manifest.complete, manifest.failure or "", written,
            )  # fmt: skip
            kept = self._finished[folder] = (written, seen)
        return kept[1]

    def _manifest(self, folder: Path) -> Manifest | None:
        try:
            return load_manifest(folder)
        except RecordError:
            return None

    def _outlook(self, runs: tuple[Seen, ...]) -> Outlook | None:
        open_runs = [run for run in runs if run.state not in {State.FINISHED, State.NOT_DRIVEN}]
        specs = [run.spec for run in runs if run.spec is not None and isinstance(run.spec.task, Drive)]
        if not open_runs or not specs:
            return None
        prices = self._priced(specs, len(runs) - len(open_runs))
        left = [(run, prices.of(run)) for run in open_runs if run.spec is not None and isinstance(run.spec.task, Drive)]
        core_s = sum((1.0 - run.done) * price.core_s for run, price in left)
        share = self._resources
        cores = sum(share.of(run.spec.method).cores for run in open_runs if run.spec and run.state is State.UNDER_WAY)
        return Outlook(core_s, core_s / cores if cores else None, all(price.measured for _, price in left))

    @property
    def _resources(self) -> Resources:
        return Resources() if self._plan is None else self._plan[1].campaign.resources

    def _priced(self, specs: list[RunSpec], finished: int) -> _Priced:
        """Prices by what is finished, read anew when that has changed, but not at every look."""
        now, old = time.monotonic(), self._prices
        if old is None or (old.finished != finished and now - old.asked > _PRICES_STAY_S):
            self._prices = old = _Priced(Prices(specs, self._out(), self._resources), now, finished)
        return old

    def _out(self) -> Path:
        """The folder of results that this one is, or is in: where finished runs stand by the names of their specs."""
        for place, run in self._begun.items():
            assert run.spec is not None
            out = place.parents[len(run_folder(Path(), run.spec).parts) - 1]
            if run_folder(out, run.spec) == place:
                return out
        return self.folder


@dataclass(frozen=True)
class _Priced:
    """What runs cost, as it was asked at an instant (s) when so many were finished."""

    prices: Prices
    asked: float
    finished: int
    known: dict[Path, Price] = field(default_factory=dict)

    def of(self, run: Seen) -> Price:
        assert run.spec is not None
        if run.folder not in self.known:
            self.known[run.folder] = self.prices.of(run.spec)
        return self.known[run.folder]


def _waiting(folder: Path, spec: RunSpec) -> Seen:
    """A run as if it had not begun."""
    return Seen(folder, spec.task.name, spec.way, spec.mode, spec.seed, State.WAITING, 0.0, spec)


def _tour(spec: RunSpec | None) -> tuple[SE2 | None, tuple[SE2, ...], int]:
    """Start, goals and rounds, with a priming round."""
    if spec is None:
        return None, (), 0
    rounds = spec.task.rounds + (spec.mode is Mode.WITH_MAP)
    if not isinstance(spec.task, Drive):
        return None, (), rounds
    scenario = spec.task.scenario
    return scenario.start.pose, tuple(scenario.goals), rounds


def _share_done(folder: Path, spec: RunSpec) -> float:
    """The share of its goals that a run's journal tells of; of its rounds, where there are no goals."""
    try:
        data = read_bytes(partial_folder(folder) / JOURNAL, "journal", RecordError, LARGEST_JOURNAL)
    except RecordError:
        return 0.0
    _, goals, rounds = _tour(spec)
    if not goals:
        return min(1.0, data.count(_ROUND_DONE) / max(rounds, 1))
    return min(1.0, sum(data.count(mark) for mark in _GOALS_DONE) / (rounds * len(goals)))


def _last_of(run: Path, events: tuple[Event, ...]) -> Newest | None:
    """What a finished run leaves to be seen: where the robot went in its last round, and where it stands."""
    started = [event.round for event in events if isinstance(event, RoundStarted)]
    if not started:
        return None
    for name in ("truth", "estimate", "odometry"):
        path = plain_or_compressed(round_folder(run, started[-1]) / f"{name}.tum")
        with contextlib.suppress(RecordError):
            track = read_trajectory(path)
            if len(track):
                poses = [SE2(*row) for row in few(track.poses.tolist())]
                truth = poses[-1] if name == "truth" else None
                state = newest_state(events[-1].t, started[-1], truth, None if truth else poses[-1], _NO_SCAN)
                return with_way(state, poses)
    return None
