"""Selection of blocks by log-determinant, against numpy asking every block every time."""

import numpy as np
import pytest

from taskslam.slam.gf_gg.good_graph import select_blocks
from taskslam.slam.vision.cholesky import log_determinant


@pytest.fixture
def system():
    random = np.random.default_rng(6)
    J = random.normal(size=(200, 72)) * np.repeat(random.uniform(0.2, 3.0, 12), 6)
    J *= random.random((200, 72)) < 0.4
    return J.T @ J + 1e-2 * np.eye(72)


def columns(blocks):
    return np.concatenate([np.arange(6 * block, 6 * block + 6) for block in blocks])


def exhaustive(system, first, wanted):
    chosen = list(first)
    while len(chosen) < wanted:
        rest = [j for j in range(len(system) // 6) if j not in chosen]
        values = [np.linalg.slogdet(system[np.ix_(columns([*chosen, j]), columns([*chosen, j]))])[1] for j in rest]
        chosen.append(rest[int(np.argmax(values))])
    return chosen


@pytest.mark.parametrize("first", [[0], [4, 11]])
def test_it_is_exhaustive_greedy(system, first):
    assert select_blocks(system, np.array(first), 7).tolist() == exhaustive(system, first, 7)


def test_of_fewer_than_wanted_all_are_taken(system):
    assert sorted(select_blocks(system, np.array([0]), 50)) == list(range(12))


def test_what_nobody_determines_is_left_out(system):
    system[30:36] = 0.0
    system[:, 30:36] = 0.0
    assert 5 not in select_blocks(system, np.array([0]), 12)


def test_log_determinant(system):
    assert log_determinant(system) == pytest.approx(np.linalg.slogdet(system)[1])
    assert log_determinant(-system) == -np.inf
