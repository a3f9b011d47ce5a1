"""Golden numbers, worked out by hand. Synthetic runs: visits mirrored about the goal give E = e = their distance."""

import pytest

from taskslam.evaluation import run_metrics
from taskslam.evaluation.pooled import (
    missing_sequences,
    pool,
    pooled_accuracies,
    pooled_area,
    pooled_completeness,
    pooled_precisions,
)
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import load_run


@pytest.fixture
def run(build):
    """Two rounds that end `spread` metres before and behind each goal; the goals from `fails_at` on are missed once."""

    def make(name, goals, spread, fails_at=None, **manifest):
        builder = build(name, goals=goals, rounds=manifest.pop("rounds", 2), mode=manifest.get("mode", "without-map"))
        for number in range(builder.rounds):
            offset = SE2(spread if number % 2 else -spread, 0.0, 0.0)
            fails = fails_at is not None and number == 1
            reached = range(fails_at if fails else goals)
            builder.round(number, dict.fromkeys(reached, offset), failed=(fails_at, Outcome.LOST) if fails else None)
        return run_metrics(load_run(builder.write(**{"scenario_name": name, **manifest})), name)

    return make


@pytest.fixture
def house(run):
    """Four waypoints, all complete, E = 6 cm."""
    return run("house", 4, 0.06)


@pytest.fixture
def office(run):
    """Six waypoints of which the first two are complete, E = 30 cm."""
    return run("office", 6, 0.30, fails_at=2)


def test_completeness_is_of_all_waypoints_together(house, office):
    assert pooled_completeness([house, office]) == pytest.approx(6 / 10)  # the mean of 1 and 1/3 would be 2/3


def test_a_missing_run_stays_in_the_denominator(house, office):
    assert pooled_completeness([house], missing=[6]) == pytest.approx(4 / 10)
    assert pooled_completeness([house, office], missing=[2, 8]) == pytest.approx(6 / 20)


def test_only_complete_waypoints_are_pooled_each_with_weight_one(house, office):
    assert pooled_precisions([house, office]) == pytest.approx([0.06] * 4 + [0.30] * 2)
    assert pooled_accuracies([house, office]) == pytest.approx([0.06] * 4 + [0.30] * 2)
    pooled = pool([house, office])
    assert pooled.position.precision_m == pytest.approx((4 * 0.06 + 2 * 0.30) / 6)  # 14 cm
    assert pooled.position.accuracy_m == pytest.approx(0.14)


def test_the_exact_area_is_over_all_planned_waypoints(house, office):
    # (4 (120 - 6) + 2 (120 - 30)) / (10 * 120) and, with ten more waypoints never driven, half of it.
    assert pooled_area([house, office]).exact == pytest.approx(636 / 1200)
    assert pooled_area([house, office], missing=[10]).exact == pytest.approx(318 / 1200)


def test_the_published_area_by_hand(run):
    # E 6 cm is below 15 cm; E 31 cm is below 45 cm. y = 0, .4, .4, .6 ... .6 at 0, 15, 30, 45 ... 120 cm.
    pooled = pooled_area([run("near", 4, 0.06), run("far", 6, 0.31, fails_at=2)])
    trapezoids = (0.4 / 2 + 0.4 + (0.4 + 0.6) / 2 + 5 * 0.6) * 15
    assert pooled.published == pytest.approx(trapezoids / 120)


def test_one_sequence_pools_to_its_own_metrics(office):
    pooled = pool([office])
    assert pooled.completeness == office.completeness
    assert pooled.position == office.position
    assert pooled.orientation == office.orientation
    assert pooled.area == office.n_auc


def test_failures_frames_and_times_add_up(house, office):
    pooled = pool([house, office], missing=[5])
    assert pooled.failures_by_kind == {"lost": 1}
    assert (pooled.frames, pooled.dropped_frames) == (400, 8)
    assert pooled.real_time_factor == pytest.approx(400 / 20)
    assert (pooled.runs, pooled.planned_runs, pooled.planned_waypoints) == (2, 3, 15)


def test_a_method_that_completes_nothing_has_no_mean_and_no_area(run):
    pooled = pool([run("house", 3, 0.1, fails_at=0)])
    assert pooled.completeness == 0.0
    assert pooled.position.precision_m is None
    assert pooled.area.exact == 0.0


def test_a_single_round_has_no_area(run, house):
    assert pool([house, run("office", 3, 0.1, rounds=1)]).area.exact is None


def test_a_sequence_is_missing_where_another_method_drove_it_in_that_mode(house, run):
    others = [
        house,
        run("office", 6, 0.1),
        run("again", 6, 0.1, seed=4, scenario_name="office"),
        run("hall", 7, 0.1, mode="with-map"),
    ]
    assert missing_sequences([house], others) == [6, 6]
    assert missing_sequences(others, others) == []


def test_nothing_to_pool_is_refused():
    with pytest.raises(ValueError, match="at least one run"):
        pool([])
    with pytest.raises(ValueError, match="without waypoints"):
        pooled_completeness([])
