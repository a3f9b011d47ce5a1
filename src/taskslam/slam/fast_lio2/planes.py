"""Points of a scan on planes of the map: how far off, and how that depends on the state.

The residual is the distance of a point, placed by the state, from the plane through its nearest neighbours in the map
(eq. (12) of FAST-LIO2); the derivatives follow from R exp(d) = R + R hat(d) to first order.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.fast_lio2.state import State
from taskslam.slam.fast_lio2.voxel_map import Keys, nearest
from taskslam.slam.inertial.rotations import rotate

COLUMNS = 12  # of the Jacobian that are not zero: rotation, position, extrinsic rotation and translation
_SHARP, _WIDE = 0.25, 0.02
_LEAST_SPREAD = 1e-4  # of the second direction by the first, squared: below, the neighbours stand in a line


@njit(cache=True)
def plane_through(  # type: ignore[no-untyped-def]
    table: FloatArray, slots: npt.NDArray[np.int64], plane: FloatArray
):
    """Fit a plane to points of the map; returns how far the farthest of them lies off it, inf if they form a line.

    Also returns how wide they spread across their longest direction, squared, by that direction's square.
    plane: (4,) filled with the unit normal n and d, so that n p + d is a point's distance. Least squares along the axis
    across which the points spread most.
    """
    count = len(slots)
    mx, my, mz = 0.0, 0.0, 0.0
    for slot in slots:
        mx, my, mz = mx + table[slot, 0], my + table[slot, 1], mz + table[slot, 2]
    mx, my, mz = mx / count, my / count, mz / count
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for slot in slots:
        x, y, z = table[slot, 0] - mx, table[slot, 1] - my, table[slot, 2] - mz
        xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
    across_x, across_y, across_z = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    spread = max(across_x, across_y, across_z)
    if spread <= _LEAST_SPREAD * (xx + yy + zz) ** 2:
        return math.inf, 0.0
    if spread == across_x:
        nx, ny, nz = across_x, xz * yz - xy * zz, xy * yz - xz * yy
    elif spread == across_y:
        nx, ny, nz = xz * yz - xy * zz, across_y, xy * xz - yz * xx
    else:
        nx, ny, nz = xy * yz - xz * yy, xy * xz - yz * xx, across_z
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    offset = -(nx * mx + ny * my + nz * mz)
    plane[0], plane[1], plane[2], plane[3] = nx, ny, nz, offset
    farthest = 0.0
    for slot in slots:
        off = abs(nx * table[slot, 0] + ny * table[slot, 1] + nz * table[slot, 2] + offset)
        farthest = max(farthest, off)
    return farthest, spread / (xx + yy + zz) ** 2


@njit(cache=True)
def find_planes(  # type: ignore[no-untyped-def]
    keys: Keys, table: FloatArray, size: float, points, x: State, neighbours: int, farthest: float, tolerance: float
) -> FloatArray:
    """(N, 5) planes of the map at (N, 3) points in the LiDAR frame; a normal of 0 where there is none.

    After normal and offset stands 1 where the neighbours leave no doubt about the normal, else 0.
    """
    planes = np.zeros((len(points), 5))
    slots, squares = np.empty(neighbours, np.int64), np.empty(neighbours)
    R, p = x.R @ x.R_il, x.R @ x.p_il + x.p
    for n in range(len(points)):
        wx, wy, wz = rotate(R, points[n, 0], points[n, 1], points[n, 2])
        found = nearest(keys, table, size, wx + p[0], wy + p[1], wz + p[2], farthest, slots, squares)
        if found < neighbours:
            continue
        off, width = plane_through(table, slots, planes[n])
        if off > tolerance:
            planes[n] = 0.0
        elif off < _SHARP * tolerance and width > _WIDE:
            planes[n, 4] = 1.0
    return planes


@njit(cache=True)
def residuals(  # type: ignore[no-untyped-def]
    points: FloatArray, planes: FloatArray, x: State, score: float, with_extrinsic: bool
):
    """Distances (K,) and their derivatives (K, 12) of the points that fit their planes.

    A point fits if 1 - 0.9 |distance| / sqrt(its range) exceeds `score`. The derivative is by the errors of R, p, R_il
    and p_il, the latter two only with_extrinsic.
    """
    r, H = np.empty(len(points)), np.zeros((len(points), COLUMNS))
    R_il, R = x.R_il, x.R
    used = 0
    for n in range(len(points)):
        a, b, c = planes[n, 0], planes[n, 1], planes[n, 2]
        if a == 0.0 and b == 0.0 and c == 0.0:
            continue
        lx, ly, lz = points[n, 0], points[n, 1], points[n, 2]
        ix, iy, iz = rotate(R_il, lx, ly, lz)
        ix, iy, iz = ix + x.p_il[0], iy + x.p_il[1], iz + x.p_il[2]
        wx, wy, wz = rotate(R, ix, iy, iz)
        distance = a * (wx + x.p[0]) + b * (wy + x.p[1]) + c * (wz + x.p[2]) + planes[n, 3]
        if 1.0 - 0.9 * abs(distance) / math.sqrt(math.sqrt(lx * lx + ly * ly + lz * lz)) <= score:
            continue
        r[used] = distance
        nx, ny, nz = rotate(R.T, a, b, c)
        row = H[used]
        row[0], row[1], row[2] = iy * nz - iz * ny, iz * nx - ix * nz, ix * ny - iy * nx
        row[3], row[4], row[5] = a, b, c
        if with_extrinsic:
            mx, my, mz = rotate(R_il.T, nx, ny, nz)
            row[6], row[7], row[8] = ly * mz - lz * my, lz * mx - lx * mz, lx * my - ly * mx
            row[9], row[10], row[11] = nx, ny, nz
        used += 1
    return r[:used], H[:used]
