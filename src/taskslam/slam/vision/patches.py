"""Patches of five pixels, a cross: what a point looked like, and how another image differs from that.

The photometric residual of a pixel is r = I(w(x)) - s, s = gain I_host(x), the gain being that of the exposure since.
It is linear in the point's shift in the image with the host's gradient times the gain, g, which stands for that of the
other image: gradients are sampled once. Weights are those of direct sparse odometry (Engel et al. 2018, eq. 7) times
those of a t-distribution over r in units of its gradient:

    e^2 = r^2 c^2 / (c^2 + |g|^2),    w = c^2 / (c^2 + |g|^2) (nu + 1) / (nu + e^2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.pyramid import GreyImage, bilinear

PIXELS = 5
CROSS_X = (0.0, 1.0, -1.0, 0.0, 0.0)
CROSS_Y = (0.0, 0.0, 0.0, 1.0, -1.0)
Patches = npt.NDArray[np.float32]

UNSEEN, OUTLIER, INLIER = -1, 0, 1


class Weighting(NamedTuple):
    """c2: c^2 of the weight, squared grey levels. nu: degrees of freedom.

    outlier: a pixel is one if r^2 > outlier |g|^2. most_outliers: of a patch that still counts.
    """

    c2: float
    nu: float
    outlier: float
    most_outliers: int


@njit(cache=True)
def sample_patches(image: GreyImage, points: FloatArray, level: int) -> Patches:
    """(N, 5, 3) grey level, dI/dx and dI/dy of the pixels about (N, 2) points given in pixels of level 0.

    image: of that level of the pyramid; gradients in grey levels per pixel of it. Where the image ends, it is repeated.
    """
    rows, columns = image.shape
    scale = 0.5**level
    right, bottom = columns - 1.001, rows - 1.001
    patches = np.empty((points.shape[0], PIXELS, 3), np.float32)
    for p in range(points.shape[0]):
        for i in range(PIXELS):
            x = (points[p, 0] + 0.5) * scale - 0.5 + CROSS_X[i]
            y = (points[p, 1] + 0.5) * scale - 0.5 + CROSS_Y[i]
            x, y = min(max(x, 0.0), right), min(max(y, 0.0), bottom)
            patches[p, i, 0] = bilinear(image, x, y)
            west, east = bilinear(image, max(x - 1.0, 0.0), y), bilinear(image, min(x + 1.0, right), y)
            north, south = bilinear(image, x, max(y - 1.0, 0.0)), bilinear(image, x, min(y + 1.0, bottom))
            patches[p, i, 1], patches[p, i, 2] = 0.5 * (east - west), 0.5 * (south - north)
    return patches


@njit(cache=True, inline="always")
def compare(image, f, cx, cy, q, R, gain, patches, p, weighting):  # type: ignore[no-untyped-def]
    """How a patch lies on an image of its level with pinhole f, cx, cy.

    q: x, y, z of the point over its depth in the host; R: (3, 3) rotation from the host. All pixels of patch p have the
    depth of its middle. Returns UNSEEN, OUTLIER or INLIER and the sums over its pixels of w times gx^2, gx gy, gy^2,
    gx r, gy r, r^2, gx s, gy s, s^2 and s r, zero unless INLIER.
    """
    rows, columns = image.shape
    step = 1.0 / f
    gxx, gxy, gyy, gxr, gyr, rr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    gxs, gys, ss, sr = 0.0, 0.0, 0.0, 0.0
    outliers, state = 0, INLIER
    for i in range(PIXELS):
        dx, dy = CROSS_X[i] * step, CROSS_Y[i] * step
        depth = q[2] + dx * R[2, 0] + dy * R[2, 1]
        if depth < 1e-3:
            state = UNSEEN
            break
        u = f * (q[0] + dx * R[0, 0] + dy * R[0, 1]) / depth + cx
        v = f * (q[1] + dx * R[1, 0] + dy * R[1, 1]) / depth + cy
        if not (u >= 0.0 and v >= 0.0 and u < columns - 1 and v < rows - 1):
            state = UNSEEN
            break
        s, gx, gy = gain * patches[p, i, 0], gain * patches[p, i, 1], gain * patches[p, i, 2]
        r = bilinear(image, u, v) - s
        g2 = gx * gx + gy * gy
        if r * r > weighting.outlier * g2:
            outliers += 1
            if outliers > weighting.most_outliers:
                state = OUTLIER
                break
            continue
        w = weighting.c2 / (weighting.c2 + g2)
        w *= (weighting.nu + 1.0) / (weighting.nu + w * r * r)
        gxx += w * gx * gx
        gxy += w * gx * gy
        gyy += w * gy * gy
        gxr += w * gx * r
        gyr += w * gy * r
        rr += w * r * r
        gxs += w * gx * s
        gys += w * gy * s
        ss += w * s * s
        sr += w * s * r
    if state != INLIER:
        gxx, gxy, gyy, gxr, gyr, rr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        gxs, gys, ss, sr = 0.0, 0.0, 0.0, 0.0
    return state, gxx, gxy, gyy, gxr, gyr, rr, gxs, gys, ss, sr
