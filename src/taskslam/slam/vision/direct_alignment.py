"""Direct alignment: the pose from which a stereo pair shows the patches of all keyframes as the keyframes show them.

Gauss-Newton on the photometric residuals (`patches.py`) in the left and the right image over the twist eta of
T_camera_keyframe = exp(eta) T_camera_keyframe, one for all keyframes. With q = x / depth_host the point in the camera
and d its inverse depth in the host, u = f q_x / q_z + cx, and the point moves by d v + omega x q:

    du/deta = f (d/q_z, 0, -x d/q_z, -x y, 1 + x^2, -y),    x = q_x / q_z, y = q_y / q_z,

and alike for v; the right camera sees (q_x - d baseline) / q_z. The logarithm a of the exposure's gain may be estimated
beside it: dr/da = -s. (Engel et al. 2018, eq. 4, without the offset.)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.cholesky import solve_positive
from taskslam.slam.vision.patches import CROSS_X, CROSS_Y, INLIER, PIXELS, UNSEEN, Patches, Weighting, compare
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import GreyImage, Pyramid, bilinear
from taskslam.slam.vision.se3 import exp_se3, product

_DAMPING = 1e-6


class Alignment(NamedTuple):
    """T: (4, 4) motion that was found, to be multiplied from the left; gain: of the exposure.

    cost: mean weighted squared residual of a patch that fits. states: (N,) UNSEEN, OUTLIER or INLIER in the left image;
    pixels: (N, 2) where each point lies in it, level 0. seen, fitting: patches in both images that lie inside, and of
    these those that are inliers.
    """

    T: FloatArray
    gain: float
    cost: float
    states: npt.NDArray[np.int8]
    pixels: FloatArray
    seen: int
    fitting: int


def align(
    left: Pyramid,
    right: Pyramid,
    pinhole: Pinhole,
    T_camera_hosts: FloatArray,
    gains: FloatArray,
    gain: float,
    hosts: npt.NDArray[np.int64],
    rays: FloatArray,
    inverse_depths: FloatArray,
    patches: tuple[Patches, ...],
    weighting: Weighting,
    iterations: int,
    expose: bool = True,
    finest: int = 0,
) -> Alignment:
    """Align from the coarsest level to level `finest`, at most so many `iterations` on each.

    T_camera_hosts: (K, 4, 4) poses of the hosts in the camera, as predicted; gains: (K,) of their exposures. gain: that
    of this pair, as predicted; it is estimated, too, if `expose` says so. hosts: (N,) index of each point's host;
    rays: (N, 2) x / z, y / z in it; inverse_depths: (N,) 1 / z, 1/m. patches: `sample_patches` of every level.
    A level ends when a step moves the image by less than a tenth of its pixels.
    """
    T = np.eye(4)
    result = Alignment(T, gain, 0.0, np.full(len(hosts), UNSEEN, np.int8), np.zeros((len(hosts), 2)), 0, 0)
    for level in range(len(left) - 1, finest - 1, -1):
        result = Alignment(
            *_align_level(
                left[level],
                right[level],
                pinhole.at_level(level),
                T,
                T_camera_hosts,
                gains,
                result.gain,
                hosts,
                rays,
                inverse_depths,
                patches[level],
                weighting,
                iterations,
                expose,
            )
        )
        T = result.T
    return result._replace(pixels=(result.pixels + 0.5) * 2.0**finest - 0.5)


@njit(cache=True)
def _align_level(
    left: GreyImage,
    right: GreyImage,
    pinhole: Pinhole,
    start: FloatArray,
    T_camera_hosts: FloatArray,
    gains: FloatArray,
    gain: float,
    hosts: npt.NDArray[np.int64],
    rays: FloatArray,
    inverse_depths: FloatArray,
    patches: Patches,
    weighting: Weighting,
    iterations: int,
    expose: bool,
) -> Any:
    f, cx, cy, baseline = pinhole.f, pinhole.cx, pinhole.cy, pinhole.baseline
    T = start.copy()
    count = len(hosts)
    states = np.empty(count, np.int8)
    pixels = np.empty((count, 2))
    H, b = np.zeros((7, 7)), np.zeros(7)
    J0, J1 = np.zeros(6), np.zeros(6)
    poses = np.empty_like(T_camera_hosts)
    cost, seen, fitting = 0.0, 0, 0
    for _ in range(iterations):
        for k in range(len(poses)):
            poses[k] = product(T, T_camera_hosts[k])
        H[:] = 0.0
        b[:] = 0.0
        cost, seen, fitting = 0.0, 0, 0
        motion, depths = 0.0, 0
        for p in range(count):
            P = poses[hosts[p]]
            d = inverse_depths[p]
            q0 = P[0, 0] * rays[p, 0] + P[0, 1] * rays[p, 1] + P[0, 2] + d * P[0, 3]
            q1 = P[1, 0] * rays[p, 0] + P[1, 1] * rays[p, 1] + P[1, 2] + d * P[1, 3]
            q2 = P[2, 0] * rays[p, 0] + P[2, 1] * rays[p, 1] + P[2, 2] + d * P[2, 3]
            states[p] = UNSEEN
            if q2 < 1e-3:
                continue
            x, y, z = q0 / q2, q1 / q2, d / q2
            pixels[p, 0], pixels[p, 1] = f * x + cx, f * y + cy
            for eye in range(2):
                if eye == 0:
                    state, gxx, gxy, gyy, gxr, gyr, e, gxs, gys, ss, sr = compare(
                        left, f, cx, cy, (q0, q1, q2), P, gain / gains[hosts[p]], patches, p, weighting
                    )
                    states[p] = state
                    xe = x
                else:
                    state, gxx, gxy, gyy, gxr, gyr, e, gxs, gys, ss, sr = compare(
                        right, f, cx, cy, (q0 - d * baseline, q1, q2), P, gain / gains[hosts[p]], patches, p, weighting
                    )
                    xe = x - baseline * z
                if state == UNSEEN:
                    continue
                seen += 1
                if state != INLIER:
                    continue
                fitting += 1
                cost += e
                motion += z
                depths += 1
                twist_jacobian(J0, J1, f, x, y, z, xe)
                for i in range(6):
                    b[i] += J0[i] * gxr + J1[i] * gyr
                    a0, a1 = J0[i] * gxx + J1[i] * gxy, J0[i] * gxy + J1[i] * gyy
                    for j in range(i, 6):
                        H[i, j] += a0 * J0[j] + a1 * J1[j]
                    H[i, 6] -= J0[i] * gxs + J1[i] * gys
                H[6, 6] += ss
                b[6] -= sr
        if fitting < 6:
            break
        for i in range(7):
            for j in range(i):
                H[i, j] = H[j, i]
            H[i, i] *= 1.0 + _DAMPING
        if not expose:
            H[6, :6] = 0.0
            H[:6, 6] = 0.0
            b[6] = 0.0
        step, solved = solve_positive(H, -b)
        if not solved:
            break
        T = product(exp_se3(step[:6]), T)
        gain *= np.exp(step[6])
        moved = np.sqrt(np.sum(step[:3] ** 2)) * motion / depths + np.sqrt(np.sum(step[3:6] ** 2))
        if f * moved < 0.1:
            break
    return T, gain, cost / max(fitting, 1), states, pixels, seen, fitting


@njit(cache=True, inline="always")
def twist_jacobian(J0, J1, f, x, y, z, xe):  # type: ignore[no-untyped-def]
    """Write d(u, v)/d(eta) into two rows of six.

    x, y, z: the point in the left camera over its depth there, and one over that depth; xe: x in the camera that looks
    (the left one's own, or the right one's).
    """
    J0[0], J0[1], J0[2] = f * z, 0.0, -f * xe * z
    J0[3], J0[4], J0[5] = -f * xe * y, f * (1.0 + xe * x), -f * y
    J1[0], J1[1], J1[2] = 0.0, f * z, -f * y * z
    J1[3], J1[4], J1[5] = -f * (1.0 + y * y), f * y * x, f * x


@njit(cache=True)
def correlations(
    image: GreyImage,
    pinhole: Pinhole,
    T_camera_hosts: FloatArray,
    hosts: npt.NDArray[np.int64],
    rays: FloatArray,
    inverse_depths: FloatArray,
    patches: Patches,
) -> FloatArray:
    """(N,) zero-mean normalised correlations of the patches with what the left image shows in their places.

    All of one level of the pyramid; NaN where a patch does not lie in the image. Whatever gain or offset there is
    between the images, chance gives 0 on average: unlike a residual, this tells a flat picture from a fitting one.
    """
    f, cx, cy = pinhole.f, pinhole.cx, pinhole.cy
    rows, columns = image.shape
    found = np.full(len(hosts), np.nan)
    for p in range(len(hosts)):
        P, d = T_camera_hosts[hosts[p]], inverse_depths[p]
        sa, sb, saa, sbb, sab = 0.0, 0.0, 0.0, 0.0, 0.0
        inside = True
        for i in range(PIXELS):
            x, y = rays[p, 0] + CROSS_X[i] / f, rays[p, 1] + CROSS_Y[i] / f
            q2 = P[2, 0] * x + P[2, 1] * y + P[2, 2] + d * P[2, 3]
            if q2 < 1e-3:
                inside = False
                break
            u = f * (P[0, 0] * x + P[0, 1] * y + P[0, 2] + d * P[0, 3]) / q2 + cx
            v = f * (P[1, 0] * x + P[1, 1] * y + P[1, 2] + d * P[1, 3]) / q2 + cy
            if not (u >= 0.0 and v >= 0.0 and u < columns - 1 and v < rows - 1):
                inside = False
                break
            a, b = bilinear(image, u, v), float(patches[p, i, 0])
            sa += a
            sb += b
            saa += a * a
            sbb += b * b
            sab += a * b
        if inside:
            va, vb = saa - sa * sa / PIXELS, sbb - sb * sb / PIXELS
            found[p] = (sab - sa * sb / PIXELS) / np.sqrt(va * vb) if va > 0.0 and vb > 0.0 else 0.0
    return found
