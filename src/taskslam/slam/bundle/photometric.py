"""Photometric bundle adjustment of a window of stereo keyframes (Engel et al. 2018; Qu et al. 2022, section III.D).

Every point is compared with every other keyframe, left and right, and with the right image of its own host. Poses move
by T_world_k <- T_world_k exp(xi_k), so that a point of host h moves in keyframe t by the twist

    eta = Ad(T_t_h) xi_h - xi_t,

over which the residuals are linear as in `vision/direct_alignment.py`; over its inverse depth d, with t the translation
of T_t_h, du/dd = f (t_x - x t_z) / q_z. Inverse depths are eliminated (`schur.py`), the first keyframe stays.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.schur import NormalEquations, solve_by_schur
from taskslam.slam.vision.direct_alignment import twist_jacobian
from taskslam.slam.vision.patches import INLIER, UNSEEN, Patches, Weighting, compare
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import adjoint, exp_se3, product

_DAMPING = 1e-4
Stack = npt.NDArray[np.uint8]


class Adjustment(NamedTuple):
    """T_world_keyframes: (K, 4, 4); inverse_depths: (N,), 1/m.

    seen, fitting: (N,) images of the window in which a point lies, and of these those that it fits. costs: mean
    weighted squared residual a patch before each step.
    """

    T_world_keyframes: FloatArray
    inverse_depths: FloatArray
    seen: npt.NDArray[np.int64]
    fitting: npt.NDArray[np.int64]
    costs: list[float]


def adjust(
    lefts: tuple[Stack, ...],
    rights: tuple[Stack, ...],
    pinhole: Pinhole,
    T_world_keyframes: FloatArray,
    gains: FloatArray,
    hosts: npt.NDArray[np.int64],
    rays: FloatArray,
    inverse_depths: FloatArray,
    patches: tuple[Patches, ...],
    weighting: Weighting,
    coarsest: int,
    iterations: int,
    bounds: tuple[float, float],
) -> Adjustment:
    """Adjust poses and inverse depths from level `coarsest` to 0, at most so many `iterations` on each.

    lefts, rights: of each level, (K, H, W) the keyframes' images. gains: (K,) of their exposures, which stay. bounds:
    of inverse depths, 1/m. The rest is as in `direct_alignment.align`. A level ends when a step moves the images by
    less than a tenth of their pixels.
    """
    T, depths, costs = T_world_keyframes.copy(), inverse_depths.copy(), []
    seen, fitting = np.zeros(len(hosts), np.int64), np.zeros(len(hosts), np.int64)
    for level in range(coarsest, -1, -1):
        here = pinhole.at_level(level)
        for _ in range(iterations):
            equations, seen, fitting, cost = linearise(
                lefts[level], rights[level], here, T, gains, hosts, rays, depths, patches[level], weighting
            )
            costs.append(cost)
            step, change, solved = solve_by_schur(equations, 6, _DAMPING)
            if not solved:
                break
            T = moved(T, step)
            depths = np.clip(depths + change, *bounds)
            if here.f * _largest_motion(step, depths) < 0.1:
                break
    return Adjustment(T, depths, seen, fitting, costs)


def moved(T_world_keyframes: FloatArray, step: FloatArray) -> FloatArray:
    """(K, 4, 4) poses after a (6 K,) step."""
    return np.stack([product(T, exp_se3(xi)) for T, xi in zip(T_world_keyframes, step.reshape(-1, 6), strict=True)])


def _largest_motion(step: FloatArray, inverse_depths: FloatArray) -> float:
    """By how much the step of any keyframe moves the points, in units of the depth."""
    twists = step.reshape(-1, 6)
    shift, turn = np.linalg.norm(twists[:, :3], axis=1), np.linalg.norm(twists[:, 3:], axis=1)
    return float((shift * inverse_depths.mean() + turn).max())


@njit(cache=True)
def linearise(
    lefts: Stack,
    rights: Stack,
    pinhole: Pinhole,
    T_world_keyframes: FloatArray,
    gains: FloatArray,
    hosts: npt.NDArray[np.int64],
    rays: FloatArray,
    inverse_depths: FloatArray,
    patches: Patches,
    weighting: Weighting,
) -> Any:
    """`NormalEquations` of one level, images in which each point is seen and fits (N,), and the mean cost a patch."""
    f, cx, cy, baseline = pinhole.f, pinhole.cx, pinhole.cy, pinhole.baseline
    K, N = len(T_world_keyframes), len(hosts)
    relative, adjoints = np.zeros((K, K, 4, 4)), np.zeros((K, K, 6, 6))
    for t in range(K):
        R = np.ascontiguousarray(T_world_keyframes[t, :3, :3].T)
        for h in range(K):
            relative[t, h] = np.eye(4)
            relative[t, h, :3, :3] = product(R, np.ascontiguousarray(T_world_keyframes[h, :3, :3]))
            apart = T_world_keyframes[h, :3, 3] - T_world_keyframes[t, :3, 3]
            for i in range(3):
                relative[t, h, i, 3] = R[i, 0] * apart[0] + R[i, 1] * apart[1] + R[i, 2] * apart[2]
            adjoints[t, h] = adjoint(relative[t, h])
    pairs, sides = np.zeros((K, K, 6, 6)), np.zeros((K, K, 6))
    H, b = np.zeros((6 * K, 6 * K)), np.zeros(6 * K)
    W, info, slope = np.zeros((N, 6 * K)), np.zeros(N), np.zeros(N)
    seen, fitting = np.zeros(N, np.int64), np.zeros(N, np.int64)
    J0, J1, w = np.zeros(6), np.zeros(6), np.zeros(6)
    cost = 0.0
    for p in range(N):
        h, d = hosts[p], inverse_depths[p]
        for t in range(K):
            P = relative[t, h]
            q0 = P[0, 0] * rays[p, 0] + P[0, 1] * rays[p, 1] + P[0, 2] + d * P[0, 3]
            q1 = P[1, 0] * rays[p, 0] + P[1, 1] * rays[p, 1] + P[1, 2] + d * P[1, 3]
            q2 = P[2, 0] * rays[p, 0] + P[2, 1] * rays[p, 1] + P[2, 2] + d * P[2, 3]
            if q2 < 1e-3:
                continue
            x, y, z = q0 / q2, q1 / q2, d / q2
            w[:] = 0.0
            moves = False
            for eye in range(1 if t == h else 0, 2):
                aside = baseline * eye
                image = lefts[t] if eye == 0 else rights[t]
                state, gxx, gxy, gyy, gxr, gyr, e, _, _, _, _ = compare(
                    image, f, cx, cy, (q0 - d * aside, q1, q2), P, gains[t] / gains[h], patches, p, weighting
                )
                if state == UNSEEN:
                    continue
                seen[p] += 1
                if state != INLIER:
                    continue
                fitting[p] += 1
                cost += e
                xe = x - aside * z
                du, dv = f * (P[0, 3] - aside - xe * P[2, 3]) / q2, f * (P[1, 3] - y * P[2, 3]) / q2
                a0, a1 = gxx * du + gxy * dv, gxy * du + gyy * dv
                info[p] += a0 * du + a1 * dv
                slope[p] += gxr * du + gyr * dv
                if t == h:
                    continue
                moves = True
                twist_jacobian(J0, J1, f, x, y, z, xe)
                for i in range(6):
                    w[i] += J0[i] * a0 + J1[i] * a1
                    sides[t, h, i] += J0[i] * gxr + J1[i] * gyr
                    b0, b1 = J0[i] * gxx + J1[i] * gxy, J0[i] * gxy + J1[i] * gyy
                    for j in range(i, 6):
                        pairs[t, h, i, j] += b0 * J0[j] + b1 * J1[j]
            if moves:
                A = adjoints[t, h]
                for i in range(6):
                    W[p, 6 * t + i] -= w[i]
                    for j in range(6):
                        W[p, 6 * h + j] += A[i, j] * w[i]
    for t in range(K):
        for h in range(K):
            if t == h:
                continue
            M, A = pairs[t, h], adjoints[t, h]
            for i in range(6):
                for j in range(i):
                    M[i, j] = M[j, i]
            MA = product(M, A)
            At = np.ascontiguousarray(A.T)
            H[6 * t : 6 * t + 6, 6 * t : 6 * t + 6] += M
            H[6 * h : 6 * h + 6, 6 * h : 6 * h + 6] += product(At, MA)
            H[6 * t : 6 * t + 6, 6 * h : 6 * h + 6] -= MA
            H[6 * h : 6 * h + 6, 6 * t : 6 * t + 6] -= np.ascontiguousarray(MA.T)
            for i in range(6):
                b[6 * t + i] -= sides[t, h, i]
                for j in range(6):
                    b[6 * h + j] += A[i, j] * sides[t, h, i]
    equations = NormalEquations(H, b, W, info, slope)
    return equations, seen, fitting, cost / max(fitting.sum(), 1)
