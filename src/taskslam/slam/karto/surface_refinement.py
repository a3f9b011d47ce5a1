"""Sub-cell refinement of a correlative match: Gauss-Newton on point-to-line distances to the reference surfaces.

A correlative match is no finer than its grid (1 cm, 0.2 degrees), which the benchmark would read as imprecision. This
moves the match to where the hits lie on the lines through the reference hits (point-to-line metric: Censi 2008, ICRA;
lines from the local mean and scatter of the hits: Biber and Strasser 2003, IROS). The predicted
pose takes part as a prior, so that a direction that the walls leave open (along a corridor) stays as predicted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray, wrap
from taskslam.slam.karto.scan_points import ScanPoints

CELL = 0.05  # metres; a line is fitted to the hits of 3 x 3 cells
_NOISE = 0.015  # metres: hit noise and line error
_OUTLIER = 0.05  # metres: scale of the Cauchy weight
_ITERATIONS = 10
_MINIMUM_HITS = 5.0  # in the 3 x 3 cells
_ONE_NORMAL = 0.95  # length of the mean of the hits' normals: below it they belong to a corner or to two faces
_FLAT = 0.1  # largest ratio of the scatter across the line to that along it
_FULL_WEIGHT = 5.0  # metres: hits nearer than this count in proportion to their distance
PRIOR = np.array([0.004, 0.004, 0.01])  # metres, metres, radians: trust in the pose predicted from the last scan
_CELLS = 0.02  # metres: a correlative match this far from the prediction may still be rounding


@dataclass(frozen=True, slots=True)
class Refined:
    """pose: (3,). covariance: (3, 3) of the least squares. share: hits that found a line within 10 cm, 0..1."""

    pose: FloatArray
    covariance: FloatArray
    share: float


class SurfaceMap:
    """Lines through the hits of the reference scans, cell by cell."""

    def __init__(self, reach: float) -> None:
        """Covers `reach` metres on all sides of the centre."""
        self._size = 2 * (int(np.ceil(reach / CELL)) + 2)
        self._origin = np.zeros(2)
        self._index = np.full((self._size, self._size), -1, np.int32)
        self._lines = np.zeros((0, 4))

    def fill(self, points: FloatArray, normals: FloatArray, centre: FloatArray) -> None:
        """Take reference hits and normals, (N, 2) each, world frame, around (2+,) `centre`."""
        self._origin = (np.round(centre[:2] / CELL) - self._size // 2) * CELL
        self._index[:] = -1
        self._lines = _fit_lines(points, normals, self._origin, self._index)

    def refine(self, scan: ScanPoints, start: FloatArray, predicted: FloatArray) -> Refined:
        """Move `start` (3,) so that the scan's hits lie on the lines.

        predicted: (3,) by odometry from the last pose; holds the direction that the lines leave open, along a corridor.
        The further the start is from it, the less it is trusted.
        """
        doubt = max(0.0, float(np.hypot(*(start - predicted)[:2])) - _CELLS)
        trust = PRIOR + np.array([doubt, doubt, abs(float(wrap(start[2] - predicted[2])))])
        pose, information, share = _gauss_newton(
            self._index,
            self._lines,
            self._origin,
            scan.points,
            scan.normals,
            start,
            predicted,
            1.0 / trust**2,
        )
        return Refined(pose, np.linalg.inv(information), share)


@njit(cache=True)
def _fit_lines(points: FloatArray, normals: FloatArray, origin: FloatArray, index: npt.NDArray[np.int32]) -> FloatArray:
    """(L, 4): mean x, y (from the origin) and unit normal of the hits in 3 x 3 cells; index: its row for each cell."""
    size = index.shape[0]
    slots = np.full((size, size), -1, np.int32)
    moments = np.zeros((points.shape[0], 8))  # count, x, y, xx, xy, yy, sum of normals
    touched = np.empty((points.shape[0], 2), np.int64)
    count = 0
    for p in range(points.shape[0]):
        if normals[p, 0] == 0.0 and normals[p, 1] == 0.0:
            continue
        x, y = points[p, 0] - origin[0], points[p, 1] - origin[1]
        i, j = int(np.floor(y / CELL)), int(np.floor(x / CELL))
        if i < 2 or j < 2 or i >= size - 2 or j >= size - 2:
            continue
        if slots[i, j] < 0:
            slots[i, j] = count
            touched[count, 0] = i
            touched[count, 1] = j
            count += 1
        m = moments[slots[i, j]]
        # Relative to the cell's corner: squares of far coordinates would eat the digits that the scatter needs.
        x -= j * CELL
        y -= i * CELL
        m[0] += 1.0
        m[1] += x
        m[2] += y
        m[3] += x * x
        m[4] += x * y
        m[5] += y * y
        m[6] += normals[p, 0]
        m[7] += normals[p, 1]
    lines = np.empty((9 * count, 4))
    found = 0
    for t in range(count):
        for i in range(touched[t, 0] - 1, touched[t, 0] + 2):
            for j in range(touched[t, 1] - 1, touched[t, 1] + 2):
                if index[i, j] != -1:
                    continue
                index[i, j] = -2  # looked at
                n, sx, sy, sxx, sxy, syy, nx, ny = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for di in range(-1, 2):
                    for dj in range(-1, 2):
                        slot = slots[i + di, j + dj]
                        if slot < 0:
                            continue
                        m = moments[slot]
                        ox, oy = dj * CELL, di * CELL
                        n += m[0]
                        sx += m[1] + m[0] * ox
                        sy += m[2] + m[0] * oy
                        sxx += m[3] + 2 * ox * m[1] + m[0] * ox * ox
                        sxy += m[4] + ox * m[2] + oy * m[1] + m[0] * ox * oy
                        syy += m[5] + 2 * oy * m[2] + m[0] * oy * oy
                        nx += m[6]
                        ny += m[7]
                # Normals that disagree are a corner or both faces of a thin wall: no one line.
                if n < _MINIMUM_HITS or np.hypot(nx, ny) < _ONE_NORMAL * n:
                    continue
                mx, my = sx / n, sy / n
                cxx, cxy, cyy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
                half = 0.5 * (cxx + cyy)
                root = np.sqrt(0.25 * (cxx - cyy) ** 2 + cxy * cxy)
                if half - root > _FLAT * (half + root):
                    continue
                angle = 0.5 * np.arctan2(2 * cxy, cxx - cyy)
                ux, uy = -np.sin(angle), np.cos(angle)
                if ux * nx + uy * ny < 0:
                    ux, uy = -ux, -uy
                index[i, j] = found
                lines[found, 0] = mx + j * CELL
                lines[found, 1] = my + i * CELL
                lines[found, 2] = ux
                lines[found, 3] = uy
                found += 1
    return lines[:found].copy()


@njit(cache=True)
def _gauss_newton(
    index: npt.NDArray[np.int32],
    lines: FloatArray,
    origin: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    start: FloatArray,
    predicted: FloatArray,
    prior: FloatArray,
) -> tuple[FloatArray, FloatArray, float]:
    size = index.shape[0]
    pose = start.copy()
    H = np.zeros((3, 3))
    used = 0
    for _ in range(_ITERATIONS):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        H[:] = 0.0
        b = np.zeros(3)
        used = 0
        for p in range(points.shape[0]):
            rx = c * points[p, 0] - s * points[p, 1]
            ry = s * points[p, 0] + c * points[p, 1]
            x, y = rx + pose[0] - origin[0], ry + pose[1] - origin[1]
            i, j = int(np.floor(y / CELL)), int(np.floor(x / CELL))
            if i < 0 or j < 0 or i >= size or j >= size:
                continue
            row = index[i, j]
            if row < 0:
                continue
            nx, ny = lines[row, 2], lines[row, 3]
            # A hit whose own surface faces elsewhere belongs to another wall.
            facing = nx * (c * normals[p, 0] - s * normals[p, 1]) + ny * (s * normals[p, 0] + c * normals[p, 1])
            if facing < 0.8 and (normals[p, 0] != 0.0 or normals[p, 1] != 0.0):
                continue
            e = nx * (x - lines[row, 0]) + ny * (y - lines[row, 1])
            used += 1
            # Crowded hits on near walls must not outvote far ones, which tell the heading. By the distance of the line:
            # a hit's own carries its noise, and leaving out crowded hits chooses by it; either pulls the pose.
            near = np.hypot(lines[row, 0] + origin[0] - pose[0], lines[row, 1] + origin[1] - pose[1])
            w = min(1.0, near / _FULL_WEIGHT) / (_NOISE * _NOISE * (1.0 + (e / _OUTLIER) ** 2))
            jt = nx * -ry + ny * rx
            H[0, 0] += w * nx * nx
            H[0, 1] += w * nx * ny
            H[0, 2] += w * nx * jt
            H[1, 1] += w * ny * ny
            H[1, 2] += w * ny * jt
            H[2, 2] += w * jt * jt
            b[0] += w * nx * e
            b[1] += w * ny * e
            b[2] += w * jt * e
        H[1, 0], H[2, 0], H[2, 1] = H[0, 1], H[0, 2], H[1, 2]
        for k in range(3):
            d = pose[k] - predicted[k]
            if k == 2:
                d = np.arctan2(np.sin(d), np.cos(d))
            H[k, k] += prior[k]
            b[k] += prior[k] * d
        step = np.linalg.solve(H, -b)
        pose += step
        if abs(step[0]) + abs(step[1]) < 1e-5 and abs(step[2]) < 1e-6:
            break
    share = used / points.shape[0] if points.shape[0] > 0 else 0.0
    pose[2] = np.arctan2(np.sin(pose[2]), np.cos(pose[2]))
    return pose, H, share
