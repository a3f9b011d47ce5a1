"""Several seeds: do intervals hold what they promise, plans their power, and looks after every seed their 5 %?

Synthetic campaigns of which the truth is known: rounds nest in seeds, waypoints are common to all seeds. A seed scales
the scatter of its arrivals by a factor of its own, and each waypoint's a little more. Prints

- the share of 95 % intervals that hold the true mean E, and the true completeness where some seeds fail more often,
- for plans of `evaluation/power.py`, the power that they state and the share of 2000 campaigns that tell methods apart,
- for `evaluation/sequential.py`, the share of 2000 campaigns of alike methods that ever called two of them different.

    python benchmarks/seed_coverage.py [--trials 2000]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

import numpy as np

from interval_coverage import Model, drift, heavy_tails, independent, rare_bad_rounds, shared
from taskslam.evaluation import intervals, power, sequential
from taskslam.evaluation.evidence import ALPHA, Side, weigh_seeds
from taskslam.evaluation.seeds import spread
from taskslam.evaluation.uncertainty import Sample, uncertainty

FloatArray = np.ndarray
Draw = Callable[[np.random.Generator, tuple[int, ...], float], FloatArray]
UNEQUAL, OF_A_WAYPOINT = 0.5, 0.2  # sigma of the logarithm of scatter: of places, and of a place in a seed


def gaussian(random: np.random.Generator, shape: tuple[int, ...], size: float) -> FloatArray:
    """Factors whose logarithm is normal with this deviation."""
    return np.exp(size * random.normal(size=shape))


def laplace(random: np.random.Generator, shape: tuple[int, ...], size: float) -> FloatArray:
    """The same with the heavier tails of Laplace's distribution."""
    return np.exp(size * random.laplace(size=shape) / math.sqrt(2))


def student(random: np.random.Generator, shape: tuple[int, ...], size: float) -> FloatArray:
    """Factors from 1 upwards by half a Student's t with 3 degrees: now and then a seed far off."""
    return 1 + np.abs(size * random.standard_t(3, size=shape))


def rare(random: np.random.Generator, shape: tuple[int, ...], size: float) -> FloatArray:
    """One seed in ten scatters so many times as widely."""
    return np.where(random.random(shape) < 0.1, size, 1.0)


SEEDS = ((gaussian, 0.0), (gaussian, 0.3), (gaussian, 0.6), (laplace, 0.5), (student, 0.5), (rare, 3.0))


def campaigns(
    random: np.random.Generator, model: Model, seeds: tuple[Draw, float], T: int, S: int, M: int, N: int
) -> FloatArray:
    """(T, S, N) E of every waypoint in every seed."""
    draw, size = seeds
    place = np.exp(random.normal(0, UNEQUAL, (T, 1, 1, N, 1)))
    factor = draw(random, (T, S, 1, 1, 1), size) * np.exp(OF_A_WAYPOINT * random.normal(size=(T, S, 1, N, 1)))
    arrivals = model(random, (T * S, M, N, 2)).reshape(T, S, M, N, 2) * place * factor
    return intervals.mean_distance(arrivals)


def coverage(
    random: np.random.Generator, model: Model, seeds: tuple[Draw, float], T: int, S: int, M: int = 5, N: int = 12
) -> tuple[float, float]:
    """Share of intervals that hold the true mean E, and the median of upper over lower end."""
    truth = float(np.mean([campaigns(random, model, seeds, 5000, 1, M, N).mean() for _ in range(20)]))
    sure = spread(campaigns(random, model, seeds, T, S, M, N))
    half = sure.half_width()
    return float((np.abs(np.log(truth / sure.mean)) <= half).mean()), float(np.exp(2 * np.median(half)))


def gaps(random: np.random.Generator, T: int, S: int, share: float) -> float:
    """As `coverage`, where this share of the waypoints of a seed is not complete."""
    kind = (gaussian, 0.3)
    truth = float(np.mean([campaigns(random, independent, kind, 5000, 1, 5, 12).mean() for _ in range(20)]))
    held = []
    for E in campaigns(random, independent, kind, T, S, 5, 12):
        known = random.random(E.shape) >= share
        known[:, 0] = True  # every seed reaches the first
        table = np.where(known, E, np.nan)[:, known.any(axis=0)]
        sure = spread(table)
        held.append(abs(math.log(truth / float(sure.mean))) <= float(sure.half_width()))
    return float(np.mean(held))


def completeness_coverage(random: np.random.Generator, T: int, S: int, chances: tuple[float, float]) -> float:
    """Of completeness at 12 waypoints in 5 rounds, where one seed in four fails with the second chance a leg."""

    def drive(count: int) -> FloatArray:
        chance = np.where(random.random((count, S, 1, 1)) < 0.25, chances[1], chances[0])
        return np.logical_and.accumulate(random.random((count, S, 5, 12)) >= chance, axis=-1)

    truth = float(drive(20000).all(axis=2).mean())
    held = 0
    for reached in drive(T):
        samples = []
        for seed, run in enumerate(reached):
            failed = int((~run).any(axis=1).sum())
            done = int(run.all(axis=0).sum())
            samples.append(
                Sample(
                    None, None, done, 12, 5, False, "abort", int(run.sum()) + failed, failed, "synthetic", seed,
                    tuple(range(done)),
                )
            )  # fmt: skip
        found = uncertainty(samples).completeness
        held += found.low <= truth <= found.high
    return held / T


def simulated_power(
    random: np.random.Generator, design: power.Design, scatter: power.Scatter, ratio: float, campaigns: int
) -> float:
    """Share of campaigns in which both tests tell two methods apart, which scatter as the plan was told.

    A round adds its part at all waypoints, as one bad drive does, and a seed its own to all its rounds.
    """
    told, N = 0, 2
    for index in range(campaigns):
        sides = []
        for size in (1.0, ratio):
            logs = scatter.seeds * random.normal(size=(design.seeds, 1))
            logs = logs + (scatter.rounds * random.normal(size=(design.seeds, design.rounds))).mean(axis=1)[:, None]
            sides.append(np.broadcast_to(math.log(size) + logs, (design.seeds, N)))
        nothing, places = np.zeros((2, N, 3)), [("synthetic", goal) for goal in range(N)]
        a, b = ([Side(nothing, nothing[0], np.exp(own), own, None) for own in side] for side in sides)
        pairs = [(seed, places, a[seed], b[seed]) for seed in range(design.seeds)]
        found = weigh_seeds(pairs, str(index))
        told += (found.p() or 0.0) < ALPHA and found.permutation[0] < ALPHA
    return told / campaigns


def false_alarms(random: np.random.Generator, tails: str, methods: int, campaigns: int, seeds: int) -> float:
    """Share of campaigns of alike methods in which a look after some seed calls any two of them different."""

    def draw(shape: tuple[int, int]) -> FloatArray:
        return random.standard_normal(shape) if tails == "normal" else random.standard_t(3, size=shape)

    alarms = 0
    for _ in range(campaigns):
        values = draw((methods, seeds)) + random.standard_normal(seeds)  # what a seed does to all of them
        first, second = np.triu_indices(methods, 1)
        p = sequential.p_at_any_time(values[second] - values[first])
        alarms += p.min() <= ALPHA / len(first)  # Holm's first step: whether anything at all is told apart
    return alarms / campaigns


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=2000)
    trials = parser.parse_args().trials
    random = np.random.default_rng(0)
    print(
        "Share of 95 % intervals that hold the true E, in %; in brackets upper over lower end. 5 rounds, 12 waypoints."
    )
    heads = "".join(f"{f'{draw.__name__} {size:g}':>18}" for draw, size in SEEDS)
    print(f"{'seeds':5} {'arrivals scatter':16}{heads}")
    for S in (2, 3, 6, 10):
        for model in (independent, shared, drift, heavy_tails, rare_bad_rounds):
            cells = (coverage(random, model, kind, trials, S) for kind in SEEDS)
            row = "".join(f"{100 * held:10.1f} ({width:5.1f})" for held, width in cells)
            print(f"{S:5} {model.__name__:16}{row}", flush=True)
    print("\nThe same where waypoints of a seed are not complete (independent arrivals, gaussian 0.3), in %")
    for S in (3, 6):
        print(S, "seeds:", *(f"{share:.0%}: {100 * gaps(random, trials // 2, S, share):.1f}" for share in (0.1, 0.3)))
    print("\nCompleteness, where one seed in four fails more often a leg, in %")
    for chances in ((0.002, 0.002), (0.01, 0.01), (0.002, 0.02), (0.001, 0.1)):
        held = (f"{S} seeds {100 * completeness_coverage(random, trials // 4, S, chances):.1f}" for S in (3, 6))
        print(f"{chances[0]:.1%} and {chances[1]:.1%}:", *held, flush=True)
    plans(random)
    looks(random)


def plans(random: np.random.Generator) -> None:
    print("\nPlans: rounds, seeds, power stated, and share of 2000 campaigns that tell the methods apart, in %")
    for detect in (0.2, 0.5, 1.0):
        for scatter in (power.ASSUMED, power.Scatter(0.05, 0.3), power.Scatter(0.4, 0.4)):
            design = power.runs_needed(detect, scatter)
            assert design is not None
            seen = simulated_power(random, design, scatter, 1 + detect, 2000)
            what = f"{detect:4.0%} {scatter}: {design.rounds} rounds, {design.seeds} seeds"
            print(f"{what}, {100 * design.power:.1f}, {100 * seen:.1f}", flush=True)


def looks(random: np.random.Generator) -> None:
    print(
        "\nAlike methods, a look after each of 100 seeds: share of 2000 campaigns with a false alarm; 5 % are allowed"
    )
    for tails in ("normal", "t3"):
        alarms = (f"{K} methods {100 * false_alarms(random, tails, K, 2000, 100):.2f} %" for K in (2, 3, 8))
        print(f"{tails}:", ", ".join(alarms), flush=True)


if __name__ == "__main__":
    main()
