import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.evaluation.permutation import cliffs_delta, exchange_rounds, flip_signs, holm


def difference(a, b):
    return a.mean(axis=1) - b.mean(axis=1)


def test_five_against_five_rounds_that_never_overlap_have_the_smallest_p():
    p, floor = exchange_rounds([(np.arange(5.0), np.arange(5.0) + 100)], difference, "")
    assert p == pytest.approx(2 / 252)
    assert floor == pytest.approx(2 / 252)


def test_three_against_three_can_never_be_significant():
    p, floor = exchange_rounds([(np.arange(3.0), np.arange(3.0) + 100)], difference, "")
    assert p == floor == pytest.approx(0.1)


def test_equal_rounds_are_never_different():
    assert exchange_rounds([(np.ones(5), np.ones(5))], difference, "")[0] == 1.0


def test_exchanging_rounds_by_hand():
    # Two and two: of the six deals, {1, 4} {2, 3} and its mirror give 0; {1, 3} and mirror 1; {1, 2} and mirror 2.
    p, _ = exchange_rounds([(np.array([1.0, 3.0]), np.array([2.0, 4.0]))], difference, "")
    assert p == pytest.approx(4 / 6)


def test_the_same_seed_gives_the_same_p_and_several_sequences_sharpen_it():
    pairs = [(np.arange(5.0), np.arange(5.0) + 100)] * 3
    first, second = (exchange_rounds(pairs, difference, "a seed") for _ in range(2))
    assert first == second
    assert first[0] == pytest.approx(1 / 5000)


def test_many_rounds_are_sampled():
    random = np.random.default_rng(0)
    p, floor = exchange_rounds([(random.normal(size=20), random.normal(size=20) + 3)], difference, "")
    assert p < 0.01
    assert floor == 1 / 5000


def test_signs_of_ten_that_agree_are_flipped_exactly():
    assert flip_signs(np.ones(10), "") == (2 / 1024, 2 / 1024)
    assert flip_signs(np.ones(40), "")[0] == pytest.approx(1 / 5000)


def test_holm_by_hand():
    # 0.01 x 4; 0.02 x 3; 0.03 x 2, raised to the one before; 0.04 x 1, likewise.
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []


@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_holm_never_lowers_a_p_and_keeps_the_order(values):
    adjusted = holm(values)
    assert all(a >= p for a, p in zip(adjusted, values, strict=True))
    assert sorted(range(len(values)), key=lambda i: (values[i], i)) == sorted(
        range(len(values)), key=lambda i: (adjusted[i], values[i], i)
    )


@given(st.lists(st.integers(0, 5), min_size=1, max_size=9), st.lists(st.integers(0, 5), min_size=1, max_size=9))
def test_cliffs_delta_counts_pairs(a, b):
    expected = np.mean([np.sign(x - y) for x in a for y in b])
    assert cliffs_delta(np.array(a, float), np.array(b, float)) == pytest.approx(expected)
