"""Good feature selection: of the points that could be seen, those are looked for that determine the pose best.

Zhao and Vela 2020: the log-determinant of the pose's information over a set of points is submodular, so that taking,
one after another, the point that adds most comes within 1 - 1/e of the best set; and it suffices to ask a few points
drawn at random each time ("lazier than lazy greedy", Mirzasoleiman et al. 2015). What is not found is not counted, and
another point is taken, until as many are found as are wanted.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.stereo_residuals import reproject
from taskslam.slam.gf_gg.frame import Features
from taskslam.slam.gf_gg.search import Views, nearest_feature
from taskslam.slam.vision.binary_words import Words
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
_PRIOR = 1e-3  # information before any point, so that the first have a determinant


@njit(cache=True)
def pose_information(T: FloatArray, places: FloatArray, views: Views, pinhole: Pinhole, scale: float) -> FloatArray:
    """(N, 6, 6) information about the pose (4, 4) T by each of (N, 3) points, if it is seen where `views` says."""
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    out = np.zeros((len(places), 6, 6))
    for n in range(len(places)):
        octave = views.octaves[n]
        if octave < 0:
            continue
        rows = reproject(T, places[n], views.places[n], pinhole, r, J, P)
        weight = scale ** (-2.0 * octave)
        for k in range(rows):
            for i in range(6):
                for j in range(6):
                    out[n, i, j] += weight * J[k, i] * J[k, j]
    return out


@njit(cache=True)
def next_random(state: int) -> int:
    """The next state of a linear congruential generator modulo 2^31 (Park and Miller 1988): 1 to 2^31 - 2."""
    return state * 48271 % 2147483647


@njit(cache=True)
def best_of(
    information: FloatArray, total: FloatArray, left: Ints, count: int, queries: int, state: int
) -> tuple[int, int]:
    """Which of left[:count] adds most to (6, 6) `total`, of so many drawn, and the generator's next state."""
    best, at = -np.inf, 0
    for query in range(min(queries, count)):
        state = next_random(state)
        position = state % count if queries < count else query
        gain = _log_determinant_of_sum(total, information[left[position]])
        if gain > best:
            best, at = gain, position
    return at, state


@njit(cache=True)
def select(information: FloatArray, wanted: int, queries: int, state: int) -> Ints:
    """(wanted,) rows of (N, 6, 6) `information`, in the order in which they were taken."""
    count = len(information)
    left, total = np.arange(count), _PRIOR * np.eye(6)
    chosen = np.empty(min(wanted, count), np.int64)
    for n in range(len(chosen)):
        at, state = best_of(information, total, left, count, queries, state)
        chosen[n] = left[at]
        total += information[left[at]]
        count -= 1
        left[at] = left[count]
    return chosen


@njit(cache=True)
def match_good(
    features: Features,
    views: Views,
    descriptors: Words,
    known: Ints,
    information: FloatArray,
    wanted: int,
    queries: int,
    radius: float,
    scale: float,
    most: int,
    ratio: float,
    state: int,
) -> Ints:
    """(N,) the feature in which each point is seen, or -1 where it was not found or not looked for.

    known: (N,) features that were found before, or -1: they are counted only when they are chosen. wanted: so many are
    found, if they are there. most, ratio, radius: as in `search.search`.
    """
    n = len(known)
    found = np.full(n, -1, np.int64)
    taken = np.zeros(len(features.octaves), np.bool_)
    for i in range(n):
        if known[i] >= 0:
            taken[known[i]] = True
    left = np.flatnonzero(views.octaves >= 0)
    count, total, matched = len(left), _PRIOR * np.eye(6), 0
    while count > 0 and matched < wanted:
        at, state = best_of(information, total, left, count, queries, state)
        i = left[at]
        count -= 1
        left[at] = left[count]
        j = known[i]
        if j < 0:
            octave = views.octaves[i]
            r = radius * views.reach[i] * scale**octave
            j = nearest_feature(
                features, views.places[i], octave - 1, octave + 1, r, descriptors, i, taken, most, ratio
            )
        if j >= 0:
            found[i] = j
            taken[j] = True
            total += information[i]
            matched += 1
    return found


@njit(cache=True)
def _log_determinant_of_sum(A: FloatArray, B: FloatArray) -> float:
    """`cholesky.log_determinant` of the sum of two (6, 6) matrices, written out: in a third of the time."""
    L = np.empty((6, 6))
    product = 1.0
    for i in range(6):
        for j in range(i + 1):
            value = A[i, j] + B[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i == j:
                if not value > 0.0:
                    return -np.inf
                product *= value
                L[i, i] = math.sqrt(value)
            else:
                L[i, j] = value / L[j, j]
    return math.log(product)
