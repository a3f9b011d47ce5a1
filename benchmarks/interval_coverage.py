"""How often do the intervals hold what they promise? Synthetic arrivals of which the truth is known.

Prints, for several ways in which arrivals can scatter, the share of 95 % intervals that hold the true value: the
two-way jackknife that the project uses, beside the percentile bootstrap over rounds and waypoints that it does not use,
as it comes and with the shrinkage of repeated rounds put right. Then with arrivals that the measurement lost, the same
for completeness, and how often two methods that are alike are called different.

    python benchmarks/interval_coverage.py [--trials 1000]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np

from taskslam.evaluation import intervals, permutation
from taskslam.evaluation.comparison import compare_pair
from taskslam.evaluation.completeness import completeness
from taskslam.evaluation.metrics_file import (
    ErrorShare,
    Interval,
    NormalizedArea,
    Orientation,
    Position,
    Repeatability,
    RunMetrics,
    Visit,
    WaypointMetrics,
)
from taskslam.evaluation.uncertainty import Sample, uncertainty

FloatArray = np.ndarray
UNEQUAL = 0.5  # sigma of the logarithm of a waypoint's scatter: some places are harder than others
RESAMPLES = 400


def independent(random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    return random.normal(size=shape)


def shared(random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Nine tenths of the variance are an offset that a round has at all its waypoints."""
    own, of_the_round = random.normal(size=shape), random.normal(size=(*shape[:2], 1, shape[3]))
    return np.asarray(0.1**0.5 * own + 0.9**0.5 * of_the_round)


def drift(random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """A random walk along the tour, scaled to the same variance at every waypoint."""
    return random.normal(size=shape).cumsum(axis=2) / np.sqrt(np.arange(1, shape[2] + 1))[:, None]


def heavy_tails(random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    return random.standard_t(3, size=shape)


def rare_bad_rounds(random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """One round in ten scatters four times as widely."""
    return random.normal(size=shape) * np.where(random.random((*shape[:2], 1, 1)) < 0.1, 4, 1)


Model = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]
MODELS: tuple[Model, ...] = (independent, shared, drift, heavy_tails, rare_bad_rounds)


def arrivals(model: Model, random: np.random.Generator, trials: int, M: int, N: int) -> tuple[FloatArray, FloatArray]:
    """(T, M, N, 3) visits about goals at the origin, in cm and radians, and the (T, N) scatter of each place."""
    scale = np.exp(random.normal(0, UNEQUAL, (trials, N)))
    scatter = model(random, (trials, M, N, 2)) * scale[:, None, :, None]
    bias = random.normal(0, 2, (trials, 1, N, 2))
    heading = 0.02 * model(random, (trials, M, N, 2))[..., :1] * scale[:, None, :, None]
    return np.concatenate([scatter + bias, heading], axis=-1), scale


def bootstrap(positions: FloatArray, random: np.random.Generator, corrected: bool) -> tuple[float, float]:
    """Percentile interval of E over resampled rounds and resampled waypoints of (M, N, 2) positions.

    corrected: each resample's E divided by what its repeated rounds take from it, sqrt((1 - sum w^2) / (1 - 1/M)).
    """
    M, N = positions.shape[:2]
    w = random.multinomial(M, np.full(M, 1 / M), RESAMPLES) / M
    w = w[(w**2).sum(axis=1) < 1]
    distances = np.linalg.norm(positions - np.einsum("bm,mnd->bnd", w, positions)[:, None], axis=-1)
    E = np.einsum("bm,bmn->bn", w, distances)
    if corrected:
        E *= np.sqrt((1 - 1 / M) / (1 - (w**2).sum(axis=1)))[:, None]
    v = random.multinomial(N, np.full(N, 1 / N), len(w)) / N
    low, high = np.quantile((v * E).sum(axis=1), [0.025, 0.975])
    return float(low), float(high)


def sample(visits: FloatArray, failed: int = 0, driven: int = 0) -> Sample:
    M, N = visits.shape[:2]
    return Sample(visits, np.zeros((N, 3)), N, N, M, False, "abort", driven or M * N, failed)


def held(interval: Interval | None, truth: float) -> bool:
    return interval is not None and interval.low <= truth <= interval.high


def means_table(trials: int, random: np.random.Generator) -> None:
    print("\nShare of 95 % intervals that hold the true mean, in %. M rounds at N waypoints.")
    print("E: jackknife over rounds and waypoints; here: over rounds, for the same waypoints; boot: percentile")
    print("bootstrap; boot+: corrected. wide: upper end of E's interval over its lower end, geometric mean.\n")
    heads = "".join(f"{name:>7}" for name in ("E", "here", "e", "Delta", "boot", "boot+", "wide"))
    print(f"{'scatter':16} {'M':>3} {'N':>3}{heads}")
    for M, N in ((3, 12), (5, 12), (10, 12), (20, 12), (5, 64)):
        for model in MODELS:
            many, scale = arrivals(model, random, 4000, M, N)
            unit = float((intervals.mean_distance(many[..., :2]) / scale).mean())
            truth = {
                "E": unit * np.exp(UNEQUAL**2 / 2),
                "e": float(np.linalg.norm(many[..., :2], axis=-1).mean()),
                "Delta": float(np.abs(many[..., 2] - many[..., 2].mean(axis=1, keepdims=True)).mean()),
            }
            hits, logs = np.zeros(6), []
            for visits, own in zip(*arrivals(model, random, trials, M, N), strict=True):
                found = uncertainty([sample(visits)])
                assert found.precision_m is not None
                hits += [
                    held(found.precision_m, truth["E"]),
                    held(found.precision_here_m, unit * own.mean()),
                    held(found.accuracy_m, truth["e"]),
                    held(found.precision_rad, truth["Delta"]),
                    *(
                        low <= truth["E"] <= high
                        for low, high in (bootstrap(visits[..., :2], random, corrected) for corrected in (False, True))
                    ),
                ]
                logs.append(np.log(found.precision_m.high / found.precision_m.low))
            cells = " ".join(f"{100 * share:6.1f}" for share in hits / trials)
            print(f"{model.__name__:16} {M:3} {N:3} {cells} {np.exp(np.mean(logs)):6.1f}", flush=True)


def lost_table(trials: int, random: np.random.Generator) -> None:
    print(
        "\nThe same with arrivals lost at random: share of 95 % intervals that hold the true mean, in %, and the mean"
    )
    print("of E over the truth. A waypoint of which fewer than two arrivals are left is not judged.\n")
    heads = "".join(f"{name:>7}" for name in ("E", "here", "e", "Delta", "ratio", "wide"))
    print(f"{'scatter':16} {'M':>3} {'N':>3} {'lost':>5}{heads}")
    for M, N in ((3, 12), (5, 12), (10, 12), (5, 64)):
        for share in (0.0, 0.05, 0.2):
            for model in MODELS:
                print(f"{model.__name__:16} {M:3} {N:3} {share:5.0%}{_lost_row(model, random, trials, M, N, share)}")


def _lost_row(model: Model, random: np.random.Generator, trials: int, M: int, N: int, share: float) -> str:
    many, scale = arrivals(model, random, 4000, M, N)
    unit = float((intervals.mean_distance(many[..., :2]) / scale).mean())
    e = float(np.linalg.norm(many[..., :2], axis=-1).mean())
    Delta = float(np.abs(many[..., 2] - many[..., 2].mean(axis=1, keepdims=True)).mean())
    hits, logs, ratios, judged = np.zeros(4), [], [], 0
    for driven, scatter in zip(*arrivals(model, random, trials, M, N), strict=True):
        driven[random.random((M, N)) < share] = np.nan
        left = (~np.isnan(driven[..., 0])).sum(axis=0) >= 2
        visits, own = driven[:, left], scatter[left]
        found = uncertainty([sample(visits)])
        if found.precision_m is None:
            continue
        judged += 1
        hits += [
            held(found.precision_m, unit * np.exp(UNEQUAL**2 / 2)),
            held(found.precision_here_m, unit * own.mean()),
            held(found.accuracy_m, e),
            held(found.precision_rad, Delta),
        ]
        ratios.append(float(intervals.mean_distance(visits[..., :2]).mean()) / unit / np.exp(UNEQUAL**2 / 2))
        logs.append(np.log(found.precision_m.high / found.precision_m.low))
    cells = " ".join(f"{100 * hit / judged:6.1f}" for hit in hits)
    return f" {cells} {np.mean(ratios):6.3f} {np.exp(np.mean(logs)):6.1f}"


def completeness_table(trials: int, random: np.random.Generator) -> None:
    print("\nCompleteness of 12 waypoints in 5 rounds; a failure ends its round. Share of 95 % intervals that hold its")
    print("expectation, and of Wilson's interval for 12 independent waypoints.\n")
    print(f"{'chance that a leg fails':34} {'C':>6} {'ours':>6} {'Wilson':>7}")
    cases = {f"{h:.1%} at every leg": np.full(12, h) for h in (0.002, 0.01, 0.03, 0.1)}
    cases |= {f"{h:.0%} at leg {leg}, else 0": np.eye(12)[leg - 1] * h for h, leg in ((0.2, 3), (0.2, 10), (0.5, 6))}
    for name, chance in cases.items():
        fails = random.random((trials, 5, 12)) < chance
        reached = np.logical_and.accumulate(~fails, axis=2)
        complete = np.asarray(reached.all(axis=1))
        truth = float(((1 - chance).cumprod() ** 5).mean())
        hits = np.zeros(2)
        for run, done in zip(reached, complete, strict=True):
            failed = int((~run).any(axis=1).sum())
            found = uncertainty(
                [
                    Sample(
                        None, np.empty((0, 3)), int(done.sum()), 12, 5, False, "abort", int(run.sum()) + failed, failed
                    )
                ]
            ).completeness
            hits += [held(found, truth), held(wilson(completeness(done), 12), truth)]
        print(f"{name:34} {truth:6.2f} {100 * hits[0] / trials:6.1f} {100 * hits[1] / trials:7.1f}", flush=True)


def wilson(share: float, count: int) -> Interval:
    z2 = 1.96**2
    centre = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = np.sqrt(z2 * (share * (1 - share) / count + z2 / (4 * count**2))) / (1 + z2 / count)
    return Interval(low=centre - half, high=centre + half)


def run_of(visits: FloatArray, method: str) -> RunMetrics:
    """A run that consists of arrivals alone: what a comparison reads."""
    M, N = visits.shape[:2]
    nothing = ErrorShare(position_m=None, heading_rad=None, spread_m=None)
    undefined = Position(precision_m=None, accuracy_m=None)
    turn = Orientation(precision_rad=None, accuracy_rad=None)
    waypoints = tuple(
        WaypointMetrics(
            goal=goal, target=(0.0, 0.0, 0.0), visits=M, rounds=M, complete=True, position=undefined,
            precision_rms_m=None, orientation=turn, mean_pose=None, control=nothing, estimation=nothing,
            arrivals=tuple(
                Visit(round=j, t_s=0.0, truth=tuple(visits[j, goal].tolist()), estimate=None, odometry=None)
                for j in range(M)
            ),
        )
        for goal in range(N)
    )  # fmt: skip
    return RunMetrics(
        directory=method, scenario="synthetic", method=method, mode="without-map", seed=0, rounds=M, completeness=1.0,
        complete_waypoints=N, planned_waypoints=N, position=undefined, precision_rms_m=None, orientation=turn,
        iso9283=Repeatability(), n_auc=NormalizedArea(published=None, published_real_grid=None, exact=None),
        uncertainty=uncertainty([sample(visits)]), control=nothing, estimation=nothing, waypoints=waypoints,
        failures=(), failures_by_kind={}, round_summaries=(), simulated_s=0.0, wall_s=0.0, compute_s=0.0,
        real_time_factor=None, frames=0, dropped_frames=0, notices=0, journal_truncated=False,
    )  # fmt: skip


def comparison_table(trials: int, random: np.random.Generator) -> None:
    print("\nTwo methods at 12 waypoints, precision. Share of 5 % tests that call them different: t test on the ratio,")
    print("exchange of rounds, both together (told apart), and signs flipped per waypoint, which we do not use.\n")
    print(f"{'scatter':16} {'M':>3} {'true ratio':>10} {'t':>6} {'rounds':>7} {'both':>6} {'signs':>6}")
    for M in (3, 5, 10):
        for ratio in (1.0, 0.5, 0.2):
            for model in MODELS:
                hits = np.zeros(4)
                for _ in range(trials):
                    scale = np.exp(random.normal(0, UNEQUAL, 12))[:, None]
                    drawn = model(random, (2, M, 12, 2)) * scale + random.normal(0, 2, (2, 1, 12, 2))
                    drawn[0] = drawn[0].mean(axis=0) + ratio * (drawn[0] - drawn[0].mean(axis=0))
                    a, b = np.concatenate([drawn, np.zeros((2, M, 12, 1))], axis=-1)
                    found = compare_pair("a", [run_of(a, "a")], "b", [run_of(b, "b")])
                    E = np.log(intervals.mean_distance(a[..., :2]) / intervals.mean_distance(b[..., :2]))
                    flipped, _ = permutation.flip_signs(E, "")
                    assert found.p is not None
                    assert found.p_permutation is not None
                    hits += [found.p < 0.05, found.p_permutation < 0.05, found.told_apart, flipped < 0.05]
                t, rounds, both_tests, signs = 100 * hits / trials
                print(
                    f"{model.__name__:16} {M:3} {ratio:10} {t:6.1f} {rounds:7.1f} {both_tests:6.1f} {signs:6.1f}",
                    flush=True,
                )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=1000)
    trials = parser.parse_args().trials
    random = np.random.default_rng(0)
    means_table(trials, random)
    lost_table(trials, np.random.default_rng(1))
    completeness_table(trials, random)
    comparison_table(max(trials // 4, 1), random)
