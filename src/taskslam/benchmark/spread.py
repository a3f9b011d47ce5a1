"""Which runs say where a method's spread comes from: each source held, or alone, in turn (`spread_shares.py`).

Nothing new is asked of a run: the noise is drawn from its seed, which no method sees; a method's own seed is one of its
options; and threads are what is left where the very same spec is driven again, into a folder of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from taskslam.benchmark.spec import RunSpec

EVERYTHING, NOISE, METHOD_SEED, THREADS = "everything", "sensor noise", "method's seed", "threads"


@dataclass(frozen=True)
class SpreadRun:
    """A run of a study of spread. part: what it is for; group: runs of one share what is held; folder: under `out`."""

    part: str
    group: int
    folder: str
    spec: RunSpec


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
