"""The timed elastic band as a least-squares problem: residuals, analytic Jacobians, normal equations.

A band is an (N, 4) array `z` with rows x, y, theta, dt: n poses in the local costmap's frame and the n - 1 times
between them. Sources: Roesmann et al. 2012 ("Trajectory modification considering dynamic constraints of autonomous
robots") for the objectives, Roesmann et al. 2013 ("Efficient trajectory optimization using a sparse model") for their
sparsity.

Over an interval, `lon` and `lat` are the displacement along and across the mean heading. Of a robot that cannot slide,
lat is zero and lon is the signed chord, so both velocity and direction follow from lon without a sign function.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.navigation.settings import TebSettings

# Acceleration ties three poses and two times: x_i .. theta_(i+2), eleven neighbours in the interleaved order.
BAND = 11


class TebParameters(NamedTuple):
    """What the kernels need of `TebSettings`, in a form that numba takes."""

    v_low: float
    v_high: float
    w_high: float
    a_high: float
    alpha_high: float
    near: float
    inflation_dist: float
    cutoff: float
    weight_v: float
    weight_w: float
    weight_a: float
    weight_alpha: float
    weight_nh: float
    weight_forward: float
    weight_time: float
    weight_obstacle: float
    weight_inflation: float
    weight_adapt: float
    dt_ref: float
    dt_hysteresis: float
    min_samples: int
    max_samples: int
    inner: int
    outer: int

    @staticmethod
    def of(s: TebSettings) -> TebParameters:
        """Penalties begin `penalty_epsilon` before each limit."""
        e = s.penalty_epsilon
        return TebParameters(
            v_low=-s.max_vel_x_backwards + e,
            v_high=s.max_vel_x - e,
            w_high=s.max_vel_theta - e,
            a_high=s.acc_lim_x - e,
            alpha_high=s.acc_lim_theta - e,
            near=s.min_obstacle_dist + e,
            inflation_dist=s.inflation_dist,
            cutoff=s.min_obstacle_dist * s.obstacle_association_cutoff_factor,
            weight_v=s.weight_max_vel_x,
            weight_w=s.weight_max_vel_theta,
            weight_a=s.weight_acc_lim_x,
            weight_alpha=s.weight_acc_lim_theta,
            weight_nh=s.weight_kinematics_nh,
            weight_forward=s.weight_kinematics_forward_drive,
            weight_time=s.weight_optimaltime,
            weight_obstacle=s.weight_obstacle,
            weight_inflation=s.weight_inflation,
            weight_adapt=s.weight_adapt_factor,
            dt_ref=s.dt_ref,
            dt_hysteresis=s.dt_hysteresis,
            min_samples=s.min_samples,
            max_samples=s.max_samples,
            inner=s.no_inner_iterations,
            outer=s.no_outer_iterations,
        )


@njit(cache=True, inline="always")
def _wrap(a: float) -> float:
    if a > math.pi or a < -math.pi:
        a -= 2.0 * math.pi * math.floor((a + math.pi) / (2.0 * math.pi))
    return a


@njit(cache=True, inline="always")
def _outside(value: float, low: float, high: float) -> float:
    """How far a value is beyond [low, high], with its sign; 0 inside."""
    if value > high:
        return value - high
    if value < low:
        return value - low
    return 0.0


@njit(cache=True)
def _add(H: FloatArray, g: FloatArray, base: int, J: FloatArray, size: int, residual: float, weight: float) -> None:
    """Add one weighted row to the normal equations; H[i, k] holds the entry (i, i - k)."""
    for a in range(size):
        wa = weight * J[a]
        if wa == 0.0:
            continue
        g[base + a] += wa * residual
        for b in range(a + 1):
            H[base + a, a - b] += wa * J[b]


@njit(cache=True)
def evaluate(
    z: FloatArray,
    n: int,
    v_start: float,
    w_start: float,
    near: FloatArray,
    obstacle_factor: float,
    p: TebParameters,
    build: bool,
    H: FloatArray,
    g: FloatArray,
) -> tuple[float, float]:
    """Sum of weighted squared residuals without and with obstacles: (motion, obstacles).

    z: (N, 4) band, n poses used; v_start, w_start: present body velocity, and the band ends at rest (`free_goal_vel`
    false); near: (N, 4, 2) obstacle points that each pose must keep away from, nan for none; obstacle_factor: the
    growth of the obstacle weight in this outer iteration. With `build`, H (4N, BAND) and g (4N,) are overwritten with
    J^T W J (lower band) and J^T W r in the interleaved order of z.
    """
    if build:
        H[: 4 * n] = 0.0
        g[: 4 * n] = 0.0
    motion, obstacles = 0.0, 0.0
    J = np.zeros(BAND)
    Jlon, Jv, Jw = np.zeros(7), np.zeros(7), np.zeros(7)
    Jv_last, Jw_last = np.zeros(7), np.zeros(7)
    v_last, w_last, dt_last = 0.0, 0.0, 0.0
    for i in range(n - 1):
        base = 4 * i
        dx, dy = z[i + 1, 0] - z[i, 0], z[i + 1, 1] - z[i, 1]
        turn = _wrap(z[i + 1, 2] - z[i, 2])
        middle = z[i, 2] + 0.5 * turn
        c, s = math.cos(middle), math.sin(middle)
        dt = z[i, 3]
        lon, lat = c * dx + s * dy, c * dy - s * dx
        v, w = lon / dt, turn / dt

        # non-holonomic: the arc constraint |(cos t1 + cos t2) dy - (sin t1 + sin t2) dx| = 2 cos(turn / 2) |lat|
        k = 2.0 * math.cos(0.5 * turn)
        sliding = k * lat
        motion += p.weight_nh * sliding * sliding + p.weight_time * dt * dt
        backwards = min(lon, 0.0)
        motion += p.weight_forward * backwards * backwards
        too_fast, too_swift = _outside(v, p.v_low, p.v_high), _outside(w, -p.w_high, p.w_high)
        motion += p.weight_v * too_fast * too_fast + p.weight_w * too_swift * too_swift
        if build:
            Jlon[0], Jlon[1], Jlon[2], Jlon[4], Jlon[5], Jlon[6] = -c, -s, 0.5 * lat, c, s, 0.5 * lat
            dk = math.sin(0.5 * turn) * lat
            J[0], J[1], J[2], J[3] = k * s, -k * c, -0.5 * k * lon + dk, 0.0
            J[4], J[5], J[6] = -k * s, k * c, -0.5 * k * lon - dk
            _add(H, g, base, J, 7, sliding, p.weight_nh)
            g[base + 3] += p.weight_time * dt
            H[base + 3, 0] += p.weight_time
            if lon < 0.0:
                _add(H, g, base, Jlon, 7, lon, p.weight_forward)
            for a in range(7):
                Jv[a] = Jlon[a] / dt
            Jv[3] = -v / dt
            Jw[2], Jw[3], Jw[6] = -1.0 / dt, -w / dt, 1.0 / dt
            if too_fast != 0.0:
                _add(H, g, base, Jv, 7, too_fast, p.weight_v)
            if too_swift != 0.0:
                _add(H, g, base, Jw, 7, too_swift, p.weight_w)

        # accelerations: between intervals, from the present velocity, and to rest at the end
        if i == 0:
            a_lon, a_turn = (v - v_start) / dt, (w - w_start) / dt
            excess, swing = _outside(a_lon, -p.a_high, p.a_high), _outside(a_turn, -p.alpha_high, p.alpha_high)
            if build:
                if excess != 0.0:
                    for a in range(7):
                        J[a] = Jv[a] / dt
                    J[3] -= a_lon / dt
                    _add(H, g, base, J, 7, excess, p.weight_a)
                if swing != 0.0:
                    for a in range(7):
                        J[a] = Jw[a] / dt
                    J[3] -= a_turn / dt
                    _add(H, g, base, J, 7, swing, p.weight_alpha)
        else:
            span = dt_last + dt
            a_lon, a_turn = 2.0 * (v - v_last) / span, 2.0 * (w - w_last) / span
            excess, swing = _outside(a_lon, -p.a_high, p.a_high), _outside(a_turn, -p.alpha_high, p.alpha_high)
            if build:
                if excess != 0.0:
                    _difference(J, Jv_last, Jv, a_lon, span)
                    _add(H, g, base - 4, J, 11, excess, p.weight_a)
                if swing != 0.0:
                    _difference(J, Jw_last, Jw, a_turn, span)
                    _add(H, g, base - 4, J, 11, swing, p.weight_alpha)
        motion += p.weight_a * excess * excess + p.weight_alpha * swing * swing
        if i == n - 2:
            a_lon, a_turn = -v / dt, -w / dt
            excess, swing = _outside(a_lon, -p.a_high, p.a_high), _outside(a_turn, -p.alpha_high, p.alpha_high)
            motion += p.weight_a * excess * excess + p.weight_alpha * swing * swing
            if build:
                if excess != 0.0:
                    for a in range(7):
                        J[a] = -Jv[a] / dt
                    J[3] -= a_lon / dt
                    _add(H, g, base, J, 7, excess, p.weight_a)
                if swing != 0.0:
                    for a in range(7):
                        J[a] = -Jw[a] / dt
                    J[3] -= a_turn / dt
                    _add(H, g, base, J, 7, swing, p.weight_alpha)
        if build:
            Jv_last[:] = Jv
            Jw_last[:] = Jw
        v_last, w_last, dt_last = v, w, dt

        if i == 0:
            continue
        for q in range(4):
            ox, oy = z[i, 0] - near[i, q, 0], z[i, 1] - near[i, q, 1]
            d = math.hypot(ox, oy)
            if not d < p.inflation_dist:
                continue
            d = max(d, 1e-6)
            too_near, within = max(p.near - d, 0.0), p.inflation_dist - d
            weight = obstacle_factor * p.weight_obstacle
            obstacles += weight * too_near * too_near + p.weight_inflation * within * within
            if build:
                J[0], J[1] = -ox / d, -oy / d
                _add(H, g, base, J, 2, within, p.weight_inflation)
                if too_near > 0.0:
                    _add(H, g, base, J, 2, too_near, weight)
    return motion, obstacles


@njit(cache=True)
def _difference(J: FloatArray, before: FloatArray, after: FloatArray, value: float, span: float) -> None:
    """Jacobian of value = 2 (after - before) / span over the eleven variables of two intervals."""
    scale = 2.0 / span
    for a in range(11):
        J[a] = 0.0
    for a in range(7):
        J[a] -= scale * before[a]
        J[a + 4] += scale * after[a]
    J[3] -= value / span
    J[7] -= value / span
