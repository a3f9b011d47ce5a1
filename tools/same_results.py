"""Do two states of this repository give the same results up to chance, as where only noise has changed?

    python tools/same_results.py BASE [--seeds 10] [--goals 3] [--methods karto hector kiss_icp rko_lio]

Drives tours of the built-in house at a commit and in the working tree, one round for each seed, and prints for every
method how complete they were, how precise, and how far off SLAM was at arrivals, with the p-value of Kolmogorov and
Smirnov's test between the two sets of seeds. Precision is the distance from the median arrival of both sides' seeds:
were it from a middle of each side's own, its seeds would not be independent.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from scipy import stats

from same_bytes import ROOT, drive, drive_commit
from taskslam.record.events import Arrival
from taskslam.record.run_directory import load_run

METHODS = ("karto", "hector", "kiss_icp", "rko_lio")
_WORDS = {
    "complete": "share of the goals reached",
    "E": "from the median arrival, mm",
    "e": "from the goal, mm",
    "slam": "SLAM at arrivals, mm",
    "heading": "SLAM's heading at arrivals, mrad",
}


def main() -> None:
    """Drive both, and print what became of each quantity."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", help="a commit")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--goals", type=int, default=3)
    parser.add_argument("--methods", nargs="+", default=METHODS)
    asked = parser.parse_args()
    tour = f"--mode without-map --rounds 1 --set sequence.path={list(range(asked.goals + 1))}".replace(", ", ",")
    methods = " ".join(f"-m {method}" for method in asked.methods)
    commands = [f"run house {methods} {tour} --seed {seed} --out runs" for seed in range(asked.seeds)]
    with tempfile.TemporaryDirectory() as scratch:
        before, after = Path(scratch) / "before", Path(scratch) / "after"
        drive_commit(asked.base, before, Path(scratch), commands)
        drive(ROOT, after, commands)
        print(f"| method | quantity | {asked.base} | now | p |\n|---|---|---|---|---|")
        for method in asked.methods:
            compare(method, *(results(side, method, asked.seeds, asked.goals) for side in (before, after)))


def results(side: Path, method: str, seeds: int, goals: int) -> dict[str, np.ndarray]:
    """Each quantity's value for each seed."""
    runs = [load_run(side / f"runs/house/{method}/without-map/seed{seed}") for seed in range(seeds)]
    arrivals = [[event for event in run.events if isinstance(event, Arrival)] for run in runs]
    place = np.full((seeds, goals, 2), np.nan)
    off, slam, heading = (np.full((seeds, goals), np.nan) for _ in range(3))
    for seed, reached in enumerate(arrivals):
        for at in reached:
            assert at.truth is not None
            place[seed, at.goal] = at.truth.x, at.truth.y
            off[seed, at.goal] = at.truth.distance_to(at.target)
            if at.estimate is not None:
                error = at.truth.inverse() @ at.estimate
                slam[seed, at.goal], heading[seed, at.goal] = np.hypot(error.x, error.y), abs(error.theta)
    found = {"e": off, "slam": slam, "heading": heading}
    complete = np.array([len(reached) / goals for reached in arrivals])
    return {"place": place, "complete": complete} | {name: 1e3 * np.nanmean(of, axis=1) for name, of in found.items()}


def compare(method: str, before: dict[str, np.ndarray], after: dict[str, np.ndarray]) -> None:
    """A line for each quantity: mean and standard deviation over seeds."""
    middle = np.nanmedian(np.concatenate([before["place"], after["place"]]), axis=0)
    for side in (before, after):
        side["E"] = 1e3 * np.nanmean(np.linalg.norm(side["place"] - middle, axis=2), axis=1)
    for name, words in _WORDS.items():
        one, two = before[name], after[name]
        p = stats.ks_2samp(one[np.isfinite(one)], two[np.isfinite(two)]).pvalue
        sides = " | ".join(f"{np.nanmean(side):.2f} ± {np.nanstd(side, ddof=1):.2f}" for side in (one, two))
        print(f"| {method} | {words} | {sides} | {p:.2f} |", flush=True)


if __name__ == "__main__":
    main()
