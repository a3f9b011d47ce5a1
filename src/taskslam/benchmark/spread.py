"""Which runs say where a method's spread comes from: each source held, or alone, in turn (`spread_shares.py`).

Nothing new is asked of a run: the noise is drawn from its seed, which no method sees; a method's own seed is one of its
options; and threads are what is left where the very same spec is driven again, into a folder of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from taskslam.benchmark.engine import Engine, Result, Watcher
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.evaluation.spread_shares import Share, spread_shares

EVERYTHING, NOISE, METHOD_SEED, THREADS = "everything", "sensor noise", "method's seed", "threads"


@dataclass(frozen=True)
class SpreadRun:
    """A run of a study of spread. part: what it is for; group: runs of one share what is held; folder: under `out`."""

    part: str
    group: int
    folder: str
    spec: RunSpec

    def place(self, out: Path) -> Path:
        """Where its run directory stands."""
        return run_folder(out / self.folder, self.spec)


def spread_runs(
    spec: RunSpec, runs: int = 10, groups: int = 2, seed_option: str | None = None
) -> tuple[SpreadRun, ...]:
    """The runs that share out the spread of a spec's method in its mode at its place.

    runs: of each part; groups: values at which a source is held. seed_option: the name of the method's option for its
    own seed, such as `seed`; without one it has none. Raises ValueError for fewer than two runs a group.
    """
    if groups < 1 or runs < 2 * groups:
        raise ValueError(f"{runs} runs in {groups} groups; expected at least two in each")

    def with_seeds(noise: int, own: int) -> RunSpec:
        options = spec.options | ({seed_option: own} if seed_option else {})
        return spec.model_copy(update={"seed": noise, "options": options})

    found = [SpreadRun(EVERYTHING, 0, "everything", with_seeds(index, index)) for index in range(runs)]
    for index in range(runs):
        group, repeat = index % groups, index // groups
        found.append(SpreadRun(THREADS, group, f"threads/{repeat}", with_seeds(group, group)))
        if seed_option:
            found.append(SpreadRun(NOISE, group, "noise_held", with_seeds(group, 1000 + index)))
            found.append(SpreadRun(METHOD_SEED, group, "method_seed_held", with_seeds(1000 + index, group)))
        else:
            found.append(SpreadRun(NOISE, group, f"threads/{repeat}", with_seeds(group, group)))
    return tuple(found)


def drive_spread(runs: Sequence[SpreadRun], engine: Engine, out: Path, watcher: Watcher) -> Iterator[Result]:
    """Drive what is not finished, each folder by itself: no two specs in one are alike, but those in several are."""
    for folder in dict.fromkeys(run.folder for run in runs):
        specs = dict.fromkeys(run.spec for run in runs if run.folder == folder)
        yield from engine.run(tuple(specs), out / folder, watcher)


def shares_in(runs: Sequence[SpreadRun], value_of: Callable[[SpreadRun], float]) -> tuple[Share, ...]:
    """The share of each source. value_of: the result of a run, NaN where there is none.

    Raises ValueError as `spread_shares`.
    """
    groups: dict[str, dict[int, list[float]]] = {}
    for run in runs:
        groups.setdefault(run.part, {}).setdefault(run.group, []).append(value_of(run))
    (everything,) = groups.pop(EVERYTHING).values()
    alone = {THREADS: list(groups.pop(THREADS).values())}
    return spread_shares(everything, {part: list(values.values()) for part, values in groups.items()}, alone)
