import pytest

from taskslam.evaluation.completeness import expected_completeness, failure_chance
from taskslam.evaluation.pooled import missing_sequences, pool
from taskslam.evaluation.upstream import Deviation
from taskslam.geometry import SE2

NAMES = ("precision_m", "precision_here_m", "accuracy_m", "precision_rad", "accuracy_rad")


def test_every_interval_holds_its_number(scattered):
    run = scattered("a", 0.02, fails_at=4)
    found = run.uncertainty
    values = (run.position.precision_m,) * 2 + (run.position.accuracy_m,)
    values += (run.orientation.precision_rad, run.orientation.accuracy_rad)
    for name, value in zip(NAMES, values, strict=True):
        interval = getattr(found, name)
        assert interval.low < value < interval.high, name
    assert found.completeness.low <= run.completeness <= found.completeness.high
    assert found.n_auc_exact.low < run.n_auc.exact < found.n_auc_exact.high


def test_the_bias_of_five_rounds_is_taken_out(scattered):
    run = scattered("a", 0.02)
    assert run.uncertainty.precision_unbiased_m == pytest.approx(run.position.precision_m / 0.8**0.5)
    assert run.uncertainty.rounds_to_halve == 13


def test_intervals_scale_with_the_unit(scattered):
    small, large = scattered("a", 0.001).uncertainty, scattered("b", 0.1).uncertainty
    for name in NAMES[:3]:
        one, other = getattr(small, name), getattr(large, name)
        assert (other.low, other.high) == pytest.approx((100 * one.low, 100 * one.high), rel=1e-6)


def test_two_rounds_have_an_interval_for_accuracy_alone(scattered):
    found = scattered("a", 0.02, rounds=2).uncertainty
    assert found.precision_m is None
    assert found.n_auc_exact is None
    assert found.accuracy_m is not None
    assert found.rounds_to_halve is None


def test_one_round_has_none(scattered):
    found = scattered("a", 0.02, rounds=1).uncertainty
    assert [getattr(found, name) for name in NAMES] == [None] * 5
    assert found.precision_unbiased_m is None


def test_a_true_pose_that_was_not_measured_takes_the_interval_away_and_not_the_number(build):
    from taskslam.evaluation import run_metrics
    from taskslam.record import load_run

    run = build(goals=1, rounds=4)
    for number, offset in enumerate([SE2(0.1, 0, 0), SE2(-0.1, 0, 0), SE2(0, 0.1, 0), None]):
        run.round(number, {0: offset})
    metrics = run_metrics(load_run(run.write()), "run")
    assert metrics.uncertainty.precision_m is None
    assert metrics.position.precision_m is not None


def test_a_run_without_failure_is_no_proof_of_completeness(scattered):
    found = scattered("a", 0.02).uncertainty
    assert found.legs.failed == 0
    assert found.legs.driven == 30
    assert found.completeness.high == 1.0
    assert found.completeness.low < 0.5


def test_one_failure_is_counted_once(scattered):
    legs = scattered("a", 0.02, fails_at=4).uncertainty.legs
    assert (legs.driven, legs.failed) == (4 * 6 + 5, 1)


def test_no_failure_in_sixty_legs_by_the_table():
    low, high = failure_chance(0, 60)
    assert low == 0.0
    assert high == pytest.approx(0.0408, abs=1e-4)  # Jeffreys: the 97.5 % point of Beta(1/2, 60 1/2)
    assert failure_chance(0, 0) == (0.0, 1.0)
    assert failure_chance(5, 5)[1] == 1.0
    with pytest.raises(ValueError, match="6 failures in 5 legs"):
        failure_chance(6, 5)


def test_expected_completeness_by_hand():
    # Two waypoints, two rounds, every leg fails by one half: 1/4 and 1/16; with map the first round primes.
    assert expected_completeness(0.5, 2, 2) == pytest.approx((1 / 4 + 1 / 16) / 2)
    assert expected_completeness(0.5, 2, 2, on_failure="skip") == pytest.approx(1 / 4)
    assert expected_completeness(0.5, 2, 2, with_map=True) == pytest.approx((0.5**5 + 0.5**6) / 2)
    assert expected_completeness(0.0, 12, 5) == 1.0


def test_more_sequences_narrow_the_pooled_interval(scattered):
    runs = [scattered(f"a{n}", 0.02, seed=n, seed_name=n) for n in range(4)]
    single, together = runs[0].uncertainty, pool(runs).uncertainty
    assert together.precision_m.high / together.precision_m.low < single.precision_m.high / single.precision_m.low
    assert together.legs.driven == 4 * single.legs.driven
    assert together.completeness.low > single.completeness.low


def test_a_pooled_sequence_without_a_run_lowers_completeness(scattered):
    run = scattered("a", 0.02)
    found = pool([run], missing=[6]).uncertainty.completeness
    assert found.high == pytest.approx(0.5)


def test_the_published_code_misses_no_sequence(scattered):
    house, office = scattered("a", 0.02), scattered("b", 0.02, scenario_name="office")
    assert missing_sequences([house], [house, office]) == [6]
    assert missing_sequences([house], [house, office], {Deviation.MISSING_SEQUENCE}) == []
