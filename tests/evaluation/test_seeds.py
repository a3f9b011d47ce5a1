"""Several seeds: intervals over seeds and waypoints, pooled rows. Synthetic, of which the truth is known."""

import math

import numpy as np
import pytest

from taskslam.evaluation import evaluate_runs, intervals
from taskslam.evaluation.comparison import compare_methods, compare_pair
from taskslam.evaluation.pooled import pool
from taskslam.evaluation.rows import rows_of
from taskslam.evaluation.seeds import design_effect, mean_interval, seed_table, several_seeds, spread


def test_a_full_table_has_the_variance_of_crossed_random_effects():
    table = np.random.default_rng(1).gamma(4.0, size=(2, 6, 9))
    table[:, :, 0] += 5.0
    sure, known = spread(table), intervals.two_way_variance([table])
    assert sure.mean == pytest.approx(table.mean(axis=(1, 2)))
    assert sure.seeds == pytest.approx(known.rounds)
    rest = table - table.mean(axis=1)[:, None] - table.mean(axis=2)[..., None] + table.mean(axis=(1, 2))[:, None, None]
    interaction = (rest**2).sum(axis=(1, 2)) / (5 * 8) / (6 * 9)
    assert sure.waypoints == pytest.approx(table.mean(axis=1).var(axis=1, ddof=1) / 9 - interaction)
    assert sure.freedom == (5, 8)


def test_seeds_that_agree_leave_the_waypoints_alone():
    places = np.array([1.0, 2.0, 6.0])
    sure = spread(np.tile(places, (3, 1)))
    assert sure.seeds == pytest.approx(0.0)
    assert sure.waypoints == pytest.approx(places.var(ddof=1) / 3)
    assert sure.half_width() == pytest.approx(intervals.quantile(0.95, 2) * math.sqrt(sure.waypoints) / 3.0)


def test_three_seeds_know_less_than_their_number_of_rounds_would_say():
    """Worked by hand: seed means 1, 2, 3 at one waypoint: 2 +- 4.303 * sqrt(1 / 3)."""
    sure = spread(np.array([[1.0], [2.0], [3.0]]))
    assert float(sure.half_width() * sure.mean) == pytest.approx(4.302653 * math.sqrt(1 / 3), rel=1e-6)


def test_a_waypoint_that_a_seed_missed_is_a_gap_and_no_row():
    cells = [(0, ("a", 0), (1.0,)), (0, ("a", 1), (3.0,)), (4, ("a", 0), (2.0,)), (4, ("a", 0), (4.0,))]
    table = seed_table(cells)[0]
    assert table[0].tolist() == [1.0, 3.0]
    assert table[1, 0] == 3.0  # a seed that was driven twice counts once
    assert np.isnan(table[1, 1])
    with pytest.raises(ValueError, match="two seeds"):
        spread(table[:1])


@pytest.mark.parametrize("missing", [0.0, 0.25])
@pytest.mark.parametrize("seeds", [3, 6])
@pytest.mark.parametrize("tails", ["normal", "laplace"])
def test_intervals_hold_the_truth_in_95_of_100_campaigns(seeds, missing, tails):
    """benchmarks/seed_coverage.py has thousands of each of many kinds."""
    random = np.random.default_rng(seeds)
    T, N = 500, 10
    draw = random.standard_normal if tails == "normal" else lambda shape: random.laplace(size=shape) / math.sqrt(2)
    place, own, cell = (np.exp(size * random.normal(size=shape)) for size, shape in (
        (0.5, (T, 1, N)), (0.0, (T, seeds, 1)), (0.25, (T, seeds, N))))  # fmt: skip
    values = place * own * cell * np.exp(0.3 * draw((T, seeds, 1)))
    seed_mean = math.exp(0.3**2 / 2) if tails == "normal" else 1 / (1 - 0.3**2 / 2)
    truth = math.exp((0.5**2 + 0.25**2) / 2) * seed_mean
    known = random.random((T, seeds, N)) >= missing
    known[..., 0] = True
    known[:, 0] = True
    held = 0
    for table in np.where(known, values, np.nan):
        sure = spread(table)
        held += abs(math.log(truth / float(sure.mean))) <= float(sure.half_width())
    assert 0.92 <= held / T <= 0.98  # 95 +- 2 %, and as much again for 500 trials


def test_seeds_that_fail_unlike_count_fewer_legs():
    assert design_effect([0, 0, 0], [60, 60, 60]) == 1.0
    assert design_effect([2, 2, 2], [60, 60, 60]) == 1.0
    assert design_effect([0, 0, 5], [60, 60, 30]) > 4
    assert several_seeds([("a", 0), ("b", 1)]) is False
    assert several_seeds([("a", 0), ("a", 1)]) is True


@pytest.fixture
def seeded(scattered):
    """Runs of one method over seeds; each has a scatter of its own."""

    def make(name, spread, seeds, **options):
        random = np.random.default_rng(len(name))
        factors = np.exp(0.3 * random.normal(size=seeds)).tolist()
        return [
            scattered(f"{name}{seed}", spread * factor, seed=100 * seed, seed_name=seed, **options)
            for seed, factor in enumerate(factors)
        ]

    return make


def test_runs_of_several_seeds_are_one_row_and_its_interval_is_over_seeds(seeded):
    runs = seeded("a", 0.02, 3)
    (row,) = rows_of({"a": runs})
    assert row.seeds == (0, 1, 2)
    assert row.uncertainty.seeds == 3
    assert row.planned_waypoints == row.complete_waypoints == 18
    E = [w.position.precision_m for run in runs for w in run.waypoints]
    assert row.position.precision_m == pytest.approx(np.mean(E))
    assert row.quantities["precision"].low < row.position.precision_m < row.quantities["precision"].high
    expected = mean_interval(runs, lambda waypoint: waypoint.position.precision_m)
    assert row.uncertainty.precision_m.low == pytest.approx(expected.low)
    for key in ("estimation_precision", "accuracy", "heading_precision", "heading_accuracy", "success_2cm_2deg"):
        assert row.quantities[key].low < row.quantities[key].high, key
    assert row.uncertainty.rounds_to_halve is None
    assert row.uncertainty.seeds_to_halve == intervals.rounds_to_halve(3)


def test_one_seed_stays_as_it_was(seeded):
    (run,) = seeded("a", 0.02, 1)
    (row,) = rows_of({"a": [run]})
    assert row.uncertainty == run.uncertainty
    assert row.quantities == run.quantities
    assert row.uncertainty.seeds == 1


def test_a_seed_that_another_method_drove_counts_as_missed(seeded):
    a, b = seeded("a", 0.02, 3), seeded("bb", 0.02, 2)
    rows = {row.method: row for row in rows_of({"a": a, "bb": b})}
    assert (rows["bb"].missing, rows["bb"].planned_waypoints, rows["bb"].complete_waypoints) == (1, 18, 12)
    assert rows["a"].missing == 0


def test_a_seed_that_completes_less_leaves_gaps(seeded, scattered):
    runs = [*seeded("a", 0.02, 2), scattered("late", 0.02, seed=7, seed_name=9, fails_at=2)]
    pooled = pool(runs)
    assert pooled.complete_waypoints == 14
    assert pooled.uncertainty.seeds == 3
    assert pooled.uncertainty.precision_m.low < pooled.position.precision_m < pooled.uncertainty.precision_m.high


def test_a_method_that_one_of_three_seeds_completed_has_no_interval(seeded, build):
    from taskslam.evaluation import run_metrics
    from taskslam.outcomes import Outcome
    from taskslam.record import load_run

    runs = seeded("a", 0.02, 1)
    for seed in (1, 2):
        lost = build(f"lost{seed}", goals=6)
        lost.round(0, {}, failed=(0, Outcome.LOST))
        runs.append(run_metrics(load_run(lost.write(method="a", seed=seed)), f"lost{seed}"))
    (row,) = rows_of({"a": runs})
    assert row.position.precision_m == runs[0].position.precision_m
    assert row.uncertainty.seeds == 1
    assert [row.quantities[key].low for key in ("precision", "estimation_precision", "accuracy")] == [None] * 3
    assert row.quantities["completeness"].low == 0.0
    assert row.quantities["completeness"].high > 0.9  # one of three


def test_three_seeds_describe_and_six_decide(seeded):
    three = compare_methods({"good": seeded("good", 0.005, 3), "worse": seeded("worse", 0.05, 3)})[0]
    assert three.over_seeds
    assert three.seeds == 3
    assert not three.told_apart
    assert three.verdict.startswith("3 seeds describe good and worse and do not decide: ")
    assert three.verdict.endswith("About 6 seeds would.")
    six = compare_methods({"good6": seeded("good6", 0.005, 6), "worse6": seeded("worse6", 0.05, 6)})[0]
    assert six.told_apart
    assert six.p_permutation == pytest.approx(2 / 64)
    assert "is more repeatable than worse6 here" in six.verdict
    assert "36 common waypoints, 6 seeds" in six.verdict


def test_a_gate_judges_the_very_seeds_that_it_drives_again(seeded):
    old, new = seeded("old", 0.005, 2), seeded("new", 0.05, 2)
    found = compare_pair("new", new, "base", old)
    assert not found.over_seeds
    assert found.told_apart


def test_metrics_json_holds_the_rows(seeded, tmp_path):
    seeded("a", 0.02, 2)
    metrics = evaluate_runs([tmp_path / "results"])
    assert [len(row.seeds) for row in metrics.rows] == [1, 1]  # two methods by their names, a0 and a1
    assert [row.directories for row in metrics.rows] == [("a0",), ("a1",)]
