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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taskslam.benchmark.campaign.notes import Note, notes
from taskslam.benchmark.campaign.plan_file import KeptPlan, campaign_folder, has_plan, read_plan
from taskslam.benchmark.campaign.price import Prices
from taskslam.benchmark.campaign.state import State, where_is
from taskslam.benchmark.resources import Resources
from taskslam.benchmark.spec import Drive, RunSpec, run_folder
from taskslam.errors import InputError, RecordError
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.reading import LARGEST_JOURNAL, LARGEST_MANIFEST, read_bytes
from taskslam.record.compression import plain_or_compressed
from taskslam.record.events import Event, GoalStarted, RoundStarted
from taskslam.record.journal import read_lines
from taskslam.record.manifest import Manifest
from taskslam.record.newest import Newest, few, newest_state, read_newest, with_way
from taskslam.record.place import partial_folder
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
        if self.seen.mode is Mode.WITH_MAP:
            return f"round {number} of {self.rounds - 1}" if number else "priming round"
        return f"round {number + 1} of {self.rounds}"


class Watched:
    """A folder that is looked at again and again."""

    def __init__(self, folder: Path) -> None:
        """Look for the first time. Raises RecordError if there is no run and no campaign, or its plan is damaged."""
        self.folder = folder.absolute()
        self._plan: tuple[int, KeptPlan] | None = None
        self._finished: dict[Path, tuple[int, Seen]] = {}
        self._specs: dict[Path, RunSpec] = {}
        self._priced: tuple[float, int, Prices] | None = None
        if not self.look().runs:
            raise RecordError(
                f"{folder}: no run, finished or under way; expected a campaign's folder, or that of a run"
            )

    def look(self) -> Look:
        """How far all is at this moment. Raises RecordError: a campaign's plan has become unreadable."""
        said = notes(self.folder)
        if has_plan(self.folder):
            specs = self._kept_plan().plan.specs
            runs = tuple(self._seen(run_folder(self.folder, spec), spec, said.get(spec.digest)) for spec in specs)
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

    def _kept_plan(self) -> KeptPlan:
        written = (campaign_folder(self.folder) / "plan.json").stat().st_mtime_ns
        if self._plan is None or self._plan[0] != written:
            self._plan = (written, read_plan(self.folder))
        return self._plan[1]

    def _places(self) -> Iterator[Path]:
        """Where runs stand or will, sorted: below the folder, or at it."""
        begun = find_partial_runs(self.folder)
        begun += [partial_folder(self.folder)] if (partial_folder(self.folder) / JOURNAL).exists() else []
        places = {_place_of(folder) for folder in begun} | set(find_runs(self.folder))
        return iter(sorted(places))

    def _found(self, place: Path) -> Seen | None:
        """A run that no plan tells of, by what its folder says."""
        if place not in self._specs:
            for folder in (place, partial_folder(place)):
                with contextlib.suppress(RecordError, InputError):
                    text = read_bytes(folder / SPEC, "run's spec", RecordError, LARGEST_MANIFEST)
                    self._specs[place] = RunSpec.from_json(text)
                    break
        spec = self._specs.get(place)
        return self._seen(place, spec) if spec is not None else self._seen_finished(place, None)

    def _seen(self, folder: Path, spec: RunSpec, note: Note | None = None) -> Seen:
        state = where_is(folder, note)
        if state is State.FINISHED and (finished := self._seen_finished(folder, spec)) is not None:
            return finished
        detail = "" if note is None or state is State.FINISHED else f"{note.ending}: {note.detail}"
        done = 0.0 if state is State.WAITING else _share_done(folder, spec)
        return Seen(folder, spec.task.name, spec.way, spec.mode, spec.seed, state, done, spec, None, detail)

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
        share = self._kept_plan().campaign.resources if self._plan is not None else Resources()
        prices = self._prices(specs, share, len(runs) - len(open_runs))
        left = [
            (run, run.spec, prices.of(run.spec))
            for run in open_runs
            if run.spec is not None and isinstance(run.spec.task, Drive)
        ]
        core_s = sum((1.0 - run.done) * price.core_s for run, _, price in left)
        cores = sum(share.of(spec.method).cores for run, spec, _ in left if run.state is State.UNDER_WAY)
        return Outlook(core_s, core_s / cores if cores else None, all(price.measured for *_, price in left))

    def _prices(self, specs: list[RunSpec], share: Resources, finished: int) -> Prices:
        """Prices by what is finished, read anew when that has changed, but not at every look."""
        now = time.monotonic()
        if self._priced is None or (self._priced[1] != finished and now - self._priced[0] > _PRICES_STAY_S):
            self._priced = (now, finished, Prices(specs, self._out(), share))
        return self._priced[2]

    def _out(self) -> Path:
        """The folder of results that this one is, or is in: where finished runs stand by the names of their specs."""
        for place, spec in self._specs.items():
            out = place.parents[len(run_folder(Path(), spec).parts) - 1]
            if run_folder(out, spec) == place:
                return out
        return self.folder


def _place_of(partial: Path) -> Path:
    """Where the run of a hidden folder will stand."""
    return partial.with_name(partial.name.removeprefix(".").removesuffix(".partial"))


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
