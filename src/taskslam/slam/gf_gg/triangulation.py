"""Points that two keyframes see and none has yet: along the epipolar line, by two rays or by a disparity.

Mur-Artal et al. 2015, section VI.C; a disparity is preferred where it sees the point at a larger angle than the two
keyframes do (Mur-Artal and Tardos 2017).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.stereo_residuals import MONO, STEREO, reproject, square
from taskslam.slam.vision.binary_words import Words, hamming
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
_OFF_THE_LINE = 3.84  # squared, chi-square quantile at 95 % of one degree of freedom
_STRAIGHT = 0.9998  # cosine of the angle between two rays from which no depth follows
_OCTAVE_SLACK = 1.5


@njit(cache=True)
def match_between(
    T_second_first: FloatArray,
    seen: tuple[FloatArray, FloatArray],
    octaves: tuple[Ints, Ints],
    descriptors: tuple[Words, Words],
    groups: tuple[Ints, Ints],
    unused: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]],
    pinhole: Pinhole,
    scale: float,
    most: int,
) -> Ints:
    """(N,) for each unused feature of the first keyframe the one of the second that may be the same, or -1."""
    t, R = T_second_first[:3, 3], T_second_first[:3, :3]
    found = np.full(len(octaves[0]), -1, np.int64)
    taken = ~unused[1]
    line = np.empty(3)
    for i in range(len(found)):
        if not unused[0][i]:
            continue
        x = (seen[0][i, 0] - pinhole.cx) / pinhole.f
        y = (seen[0][i, 1] - pinhole.cy) / pinhole.f
        d0 = R[0, 0] * x + R[0, 1] * y + R[0, 2]
        d1 = R[1, 0] * x + R[1, 1] * y + R[1, 2]
        d2 = R[2, 0] * x + R[2, 1] * y + R[2, 2]
        line[0], line[1], line[2] = t[1] * d2 - t[2] * d1, t[2] * d0 - t[0] * d2, t[0] * d1 - t[1] * d0
        norm = line[0] * line[0] + line[1] * line[1]
        if norm < 1e-12:
            continue
        best = most + 1
        for j in range(len(octaves[1])):
            if taken[j] or groups[0][i] != groups[1][j]:
                continue
            distance = hamming(descriptors[0], i, descriptors[1], j)
            if distance >= best:
                continue
            u = (seen[1][j, 0] - pinhole.cx) / pinhole.f
            v = (seen[1][j, 1] - pinhole.cy) / pinhole.f
            off = (line[0] * u + line[1] * v + line[2]) * pinhole.f
            if off * off > _OFF_THE_LINE * norm * scale ** (2 * octaves[1][j]):
                continue
            best, found[i] = distance, j
        if found[i] >= 0:
            taken[found[i]] = True
    return found


@njit(cache=True)
def triangulate(
    T_first: FloatArray,
    T_second: FloatArray,
    seen: tuple[FloatArray, FloatArray],
    octaves: tuple[Ints, Ints],
    pinhole: Pinhole,
    scale: float,
) -> FloatArray:
    """(N, 3) places in the world of N pairs of features, NaN where the two do not see one point.

    T_first, T_second: (4, 4) `T_camera_world`. seen: (N, 3) each; octaves: (N,) each.
    """
    R1, R2 = T_first[:3, :3], T_second[:3, :3]
    c1, c2 = np.zeros(3), np.zeros(3)
    for a in range(3):
        for b in range(3):
            c1[a] -= R1[b, a] * T_first[b, 3]
            c2[a] -= R2[b, a] * T_second[b, 3]
    out = np.full((len(octaves[0]), 3), np.nan)
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    d1, d2 = np.empty(3), np.empty(3)
    for i in range(len(out)):
        first, second = seen[0][i], seen[1][i]
        _ray(R1, first, pinhole, d1)
        _ray(R2, second, pinhole, d2)
        n1, n2 = math.sqrt(np.sum(d1 * d1)), math.sqrt(np.sum(d2 * d2))
        cosine = np.sum(d1 * d2) / (n1 * n2)
        spread1, spread2 = _stereo_cosine(first, pinhole), _stereo_cosine(second, pinhole)
        if min(spread1, spread2) < cosine:
            if spread1 <= spread2:
                X = c1 + d1 * (pinhole.f * pinhole.baseline / (first[0] - first[2]))
            else:
                X = c2 + d2 * (pinhole.f * pinhole.baseline / (second[0] - second[2]))
        elif 0.0 < cosine < _STRAIGHT:
            X = _between(c1, d1, c2, d2)
        else:
            continue
        good = True
        for view in range(2):
            T, at, octave = (T_first, first, octaves[0][i]) if view == 0 else (T_second, second, octaves[1][i])
            rows = reproject(T, X, at, pinhole, r, J, P)
            limit = STEREO if rows == 3 else MONO
            good = good and rows > 0 and square(r, rows, scale ** (-2.0 * octave)) <= limit
        # What is so much nearer should look so much larger.
        near = math.sqrt(np.sum((X - c1) ** 2)) * scale ** octaves[0][i]
        far = math.sqrt(np.sum((X - c2) ** 2)) * scale ** octaves[1][i]
        slack = _OCTAVE_SLACK * scale
        if good and near < slack * far and far < slack * near:
            out[i] = X
    return out


@njit(cache=True)
def _ray(R: FloatArray, seen: FloatArray, pinhole: Pinhole, d: FloatArray) -> None:
    """In the world, of depth 1."""
    x, y = (seen[0] - pinhole.cx) / pinhole.f, (seen[1] - pinhole.cy) / pinhole.f
    for a in range(3):
        d[a] = R[0, a] * x + R[1, a] * y + R[2, a]


@njit(cache=True)
def _stereo_cosine(seen: FloatArray, pinhole: Pinhole) -> float:
    """Of the angle at which the two cameras of a pair see a point; 1 without a disparity."""
    if np.isnan(seen[2]):
        return 1.0
    depth = pinhole.f * pinhole.baseline / (seen[0] - seen[2])
    return math.cos(2.0 * math.atan2(0.5 * pinhole.baseline, depth))


@njit(cache=True)
def _between(c1: FloatArray, d1: FloatArray, c2: FloatArray, d2: FloatArray) -> FloatArray:
    """The middle of the shortest line between two rays."""
    a, b, c = np.sum(d1 * d1), np.sum(d1 * d2), np.sum(d2 * d2)
    w = c2 - c1
    p, q = np.sum(d1 * w), np.sum(d2 * w)
    determinant = a * c - b * b
    s, t = (c * p - b * q) / determinant, (b * p - a * q) / determinant
    return 0.5 * (c1 + s * d1 + c2 + t * d2)
