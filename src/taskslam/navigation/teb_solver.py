"""Levenberg-Marquardt on the band: banded Cholesky, obstacle association, automatic resizing.

The normal equations of a band are banded (eleven diagonals), so a step costs a time linear in its length. The damping
follows Nielsen's rule (Madsen, Nielsen, Tingleff 2004, "Methods for non-linear least squares problems"), which is the
one that g2o uses below teb_local_planner.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.navigation.teb_problem import BAND, TebParameters, evaluate

FIRST = 3  # the start pose is fixed: the first unknown is dt_0


@njit(cache=True)
def optimize(
    z: FloatArray, n: int, v_start: float, w_start: float, obstacles: FloatArray, p: TebParameters
) -> tuple[int, float, float]:
    """Optimise a band in place: `outer` times resize, associate obstacles, `inner` Levenberg-Marquardt iterations.

    z: (N, 4) band with room for max_samples poses; n: poses used; obstacles: (M, 2) points in the band's frame.
    Returns (n, motion cost, obstacle cost), the costs with the last outer iteration's weights.
    """
    capacity = z.shape[0]
    H = np.empty((4 * capacity, BAND))
    L = np.empty((4 * capacity, BAND))
    g = np.empty(4 * capacity)
    step = np.empty(4 * capacity)
    trial = np.empty_like(z)
    near = np.empty((capacity, 4, 2))
    factor = 1.0
    motion, obstacle = 0.0, 0.0
    for _ in range(p.outer):
        n = resize(z, n, p)
        associate(z, n, obstacles, p.cutoff, near)
        motion, obstacle = _levenberg_marquardt(z, n, v_start, w_start, near, factor, p, H, L, g, step, trial)
        factor *= p.weight_adapt
    return n, motion, obstacle


@njit(cache=True)
def _levenberg_marquardt(
    z: FloatArray,
    n: int,
    v_start: float,
    w_start: float,
    near: FloatArray,
    factor: float,
    p: TebParameters,
    H: FloatArray,
    L: FloatArray,
    g: FloatArray,
    step: FloatArray,
    trial: FloatArray,
) -> tuple[float, float]:
    last = 4 * (n - 1)  # the goal pose is fixed: the last unknown is dt_(n-2)
    motion, obstacle = evaluate(z, n, v_start, w_start, near, factor, p, True, H, g)
    largest = 0.0
    for i in range(FIRST, last):
        largest = max(largest, H[i, 0])
    damping, growth = 1e-5 * largest, 2.0
    for iteration in range(p.inner):
        accepted = False
        for _ in range(10):
            if not solve_banded(H, g, FIRST, last, damping, L, step):
                damping *= growth
                growth *= 2.0
                continue
            trial[:n] = z[:n]
            predicted = 0.0
            for i in range(FIRST, last):
                trial[i // 4, i % 4] += step[i]
                predicted += step[i] * (damping * step[i] - g[i])
            for i in range(n - 1):
                trial[i, 3] = max(trial[i, 3], 0.1 * z[i, 3])  # time never stops nor runs backwards
            new_motion, new_obstacle = evaluate(trial, n, v_start, w_start, near, factor, p, False, H, g)
            gain = (motion + obstacle - new_motion - new_obstacle) / (predicted + 1e-12)
            if gain > 0.0 and math.isfinite(gain):
                z[:n] = trial[:n]
                converged = gain * predicted < 1e-6 * (motion + obstacle)
                motion, obstacle = new_motion, new_obstacle
                damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
                growth = 2.0
                accepted = not converged
                break
            damping *= growth
            growth *= 2.0
        if not accepted:
            break
        if iteration + 1 < p.inner:
            evaluate(z, n, v_start, w_start, near, factor, p, True, H, g)
    return motion, obstacle


@njit(cache=True)
def solve_banded(
    H: FloatArray, g: FloatArray, first: int, last: int, damping: float, L: FloatArray, step: FloatArray
) -> bool:
    """Solve (H + damping I) step = -g over unknowns first..last-1 by Cholesky; False if not positive definite.

    H: lower band, H[i, k] = entry (i, i - k); unknowns before `first` and from `last` on are fixed and left out.
    """
    for i in range(first, last):
        reach = min(BAND - 1, i - first)
        for k in range(reach, -1, -1):
            j = i - k
            total = H[i, k]
            if k == 0:
                total += damping
            for m in range(max(first, i - BAND + 1, j - BAND + 1), j):
                total -= L[i, i - m] * L[j, j - m]
            if k == 0:
                if not total > 0.0:
                    return False
                L[i, 0] = math.sqrt(total)
            else:
                L[i, k] = total / L[j, 0]
    for i in range(first, last):
        total = -g[i]
        for m in range(max(first, i - BAND + 1), i):
            total -= L[i, i - m] * step[m]
        step[i] = total / L[i, 0]
    for i in range(last - 1, first - 1, -1):
        total = step[i]
        for m in range(i + 1, min(last, i + BAND)):
            total -= L[m, m - i] * step[m]
        step[i] = total / L[i, 0]
    return True


@njit(cache=True)
def associate(z: FloatArray, n: int, obstacles: FloatArray, cutoff: float, near: FloatArray) -> None:
    """The nearest obstacle point within `cutoff` in each quadrant about each inner pose; nan where there is none.

    teb_local_planner takes the nearest one to the left and to the right, and all within 1.5 times the minimum distance.
    Front and rear halves of both sides keep what lies ahead too, at a bounded number of terms.
    """
    near[:n] = np.nan
    best = np.empty(4)
    for i in range(1, n - 1):
        best[:] = cutoff * cutoff
        x, y = z[i, 0], z[i, 1]
        c, s = math.cos(z[i, 2]), math.sin(z[i, 2])
        for o in range(obstacles.shape[0]):
            dx, dy = obstacles[o, 0] - x, obstacles[o, 1] - y
            d2 = dx * dx + dy * dy
            if d2 >= cutoff * cutoff:
                continue
            q = (0 if c * dy - s * dx > 0.0 else 2) + (0 if c * dx + s * dy > 0.0 else 1)
            if d2 < best[q]:
                best[q] = d2
                near[i, q, 0], near[i, q, 1] = obstacles[o, 0], obstacles[o, 1]


@njit(cache=True)
def resize(z: FloatArray, n: int, p: TebParameters) -> int:
    """Split intervals longer than dt_ref + hysteresis and merge those shorter than dt_ref - hysteresis; returns n."""
    i = 0
    while i < n - 1:
        dt = z[i, 3]
        if dt > p.dt_ref + p.dt_hysteresis and n < p.max_samples:
            for j in range(n - 1, i, -1):
                z[j + 1] = z[j]
            turn = z[i + 2, 2] - z[i, 2]
            turn = math.atan2(math.sin(turn), math.cos(turn))
            z[i + 1, 0] = 0.5 * (z[i, 0] + z[i + 2, 0])
            z[i + 1, 1] = 0.5 * (z[i, 1] + z[i + 2, 1])
            z[i + 1, 2] = z[i, 2] + 0.5 * turn
            z[i, 3] = 0.5 * dt
            z[i + 1, 3] = 0.5 * dt
            n += 1
        elif dt < p.dt_ref - p.dt_hysteresis and n > p.min_samples:
            if i < n - 2:
                # drop pose i + 1, its interval grows
                z[i, 3] = dt + z[i + 1, 3]
                for j in range(i + 1, n - 1):
                    z[j] = z[j + 1]
            else:
                # the last interval: drop the pose before the goal
                z[i - 1, 3] += dt
                z[i] = z[i + 1]
                i += 1
            n -= 1
        else:
            i += 1
    return n
