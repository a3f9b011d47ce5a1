"""The depth filter: an inverse depth as a Gaussian, and the chance that a measurement of it is any good, as a Beta.

Vogiatzis and Hernandez 2011, "Video-based, real-time multi-view stereo": a measurement x comes with probability pi from
N(d, tau^2), else from anywhere within the range. The posterior over d and pi is kept in the same form by its moments.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.pinhole import Pinhole

_SPAN = 5.0  # 1/m: the range of inverse depths in which a wrong measurement lies


@njit(cache=True)
def update_depth(state: FloatArray, x: float, tau2: float, span: float) -> None:
    """Take a measurement into (4,) `state`: mean and variance of the inverse depth (1/m, 1/m^2), and the Beta's a, b.

    tau2: the measurement's variance; span: 1/m, the range in which a wrong one lies.
    """
    mean, variance, a, b = state[0], state[1], state[2], state[3]
    total = variance + tau2
    s2 = 1.0 / (1.0 / variance + 1.0 / tau2)
    m = s2 * (mean / variance + x / tau2)
    good = a / (a + b) * math.exp(-0.5 * (x - mean) ** 2 / total) / math.sqrt(2.0 * math.pi * total)
    bad = b / (a + b) / span
    good, bad = good / (good + bad), bad / (good + bad)
    first = good * (a + 1.0) / (a + b + 1.0) + bad * a / (a + b + 1.0)
    scale = (a + b + 1.0) * (a + b + 2.0)
    second = good * (a + 1.0) * (a + 2.0) / scale + bad * a * (a + 1.0) / scale
    state[0] = good * m + bad * mean
    state[1] = good * (s2 + m * m) + bad * (variance + mean * mean) - state[0] ** 2
    state[2] = (second - first) / (first - second / first)
    state[3] = state[2] * (1.0 - first) / first


def start_depths(inverse_depths: FloatArray, deviation: float) -> FloatArray:
    """(N, 4) states of points that were measured once: as likely right as wrong, on the strength of twenty guesses."""
    count = len(inverse_depths)
    return np.column_stack([inverse_depths, np.full(count, deviation**2), np.full((count, 2), 10.0)])


@njit(cache=True)
def observe(
    depths: FloatArray,
    T_camera_hosts: FloatArray,
    hosts: npt.NDArray[np.int64],
    rays: FloatArray,
    seen: FloatArray,
    normals: FloatArray,
    pinhole: Pinhole,
    deviation: float,
) -> None:
    """Take into (N, 4) states where the points are seen in another camera, (N, 2) pixels with such a `deviation`.

    A shift of the point in the image is one of its inverse depth as far as it lies along the epipolar line: with
    j = du/dd, the measured one is d + j . r / j . j, of variance deviation^2 / j . j. normals: (N, 2) directions along
    which alone a place is known, or zeros.
    """
    f, cx, cy = pinhole.f, pinhole.cx, pinhole.cy
    for n in range(len(hosts)):
        P, d = T_camera_hosts[hosts[n]], depths[n, 0]
        q0 = P[0, 0] * rays[n, 0] + P[0, 1] * rays[n, 1] + P[0, 2] + d * P[0, 3]
        q1 = P[1, 0] * rays[n, 0] + P[1, 1] * rays[n, 1] + P[1, 2] + d * P[1, 3]
        q2 = P[2, 0] * rays[n, 0] + P[2, 1] * rays[n, 1] + P[2, 2] + d * P[2, 3]
        x, y = q0 / q2, q1 / q2
        j0, j1 = f * (P[0, 3] - x * P[2, 3]) / q2, f * (P[1, 3] - y * P[2, 3]) / q2
        r0, r1 = seen[n, 0] - f * x - cx, seen[n, 1] - f * y - cy
        if normals[n, 0] != 0.0 or normals[n, 1] != 0.0:
            j0, r0 = normals[n, 0] * j0 + normals[n, 1] * j1, normals[n, 0] * r0 + normals[n, 1] * r1
            j1, r1 = 0.0, 0.0
        size = j0 * j0 + j1 * j1
        if size > 1e-3:
            update_depth(depths[n], d + (j0 * r0 + j1 * r1) / size, deviation * deviation / size, _SPAN)
            depths[n, 0] = max(depths[n, 0], 1e-3)
