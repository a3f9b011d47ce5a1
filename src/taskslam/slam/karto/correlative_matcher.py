"""Correlative scan matching: the pose in a window at which the most hits of a scan lie on hits of the reference scans.

Response of a pose: mean grid value over the scan's hits, as a fraction (Olson 2009, eq. 3; OpenKarto's GetResponse).
Search: coarse over the whole window with a thinned scan, then fine around the best with all hits. OpenKarto's penalty
(1 - 0.2 d^2 / variance, never below its minimum) pulls towards the predicted pose. Covariance: response-weighted
scatter of the poses that are nearly as good as the best (Olson 2009, eq. 10; OpenKarto takes those within 0.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray, wrap
from taskslam.slam.karto.correlation_grid import FULL, Bytes, CorrelationGrid
from taskslam.slam.karto.scan_points import Points, ScanPoints, thin
from taskslam.slam.karto.settings import KartoSettings

AnyFloats = npt.NDArray[np.floating[Any]]

PENALTY_GAIN = 0.2  # OpenKarto's DISTANCE_PENALTY_GAIN and ANGLE_PENALTY_GAIN
WORST_VARIANCE = 500.0  # OpenKarto's MAX_VARIANCE: nothing is known
_NEARLY_AS_GOOD = 0.1
_EXPANSION = np.deg2rad(20.0)  # how far use_response_expansion widens the heading search, up to three times


@dataclass(frozen=True, slots=True)
class Match:
    """pose: (3,) of the base in the reference frame; response 0..1; covariance: (3, 3) m^2, rad^2."""

    pose: FloatArray
    response: float
    covariance: FloatArray


@dataclass(frozen=True, slots=True)
class _Penalty:
    distance_variance: float
    angle_variance: float
    minimum_distance: float
    minimum_angle: float


class CorrelativeMatcher:
    """Matches scans in a square window around a predicted pose. Owns one grid."""

    def __init__(
        self, dimension: float, resolution: float, smear_deviation: float, coarse_step: int, settings: KartoSettings
    ) -> None:
        """A window of `dimension` metres on each side; coarse_step: cells between poses of the coarse search."""
        self._settings = settings
        self._half = dimension / 2
        self._coarse_step = coarse_step * resolution
        self._thinning = max(0.1, resolution)
        self._penalty = _Penalty(
            settings.distance_variance_penalty,
            settings.angle_variance_penalty,
            settings.minimum_distance_penalty,
            settings.minimum_angle_penalty,
        )
        # Half a metre more: the sensor is not at the base, and a scan centre is rounded.
        self.grid = CorrelationGrid(resolution, smear_deviation, settings.max_laser_range + dimension + 0.5)

    def show(self, reference: FloatArray, centre: FloatArray) -> None:
        """Take the reference hits (N, 2), world frame, to match against around (2+,) `centre`."""
        self.grid.fill(reference, centre[:2])

    def match(self, scan: ScanPoints, predicted: FloatArray, *, penalize: bool, fine: bool = True) -> Match:
        """Best pose of the base near `predicted` (3,) against the reference last shown."""
        s = self._settings
        thinned = scan.points[thin(scan.points, self._thinning)]
        window = self._half, self._coarse_step
        half_angle = s.coarse_search_angle_offset
        best, response = self._search(
            thinned, predicted, predicted, window, (half_angle, s.coarse_angle_resolution), penalize
        )
        for _ in range(3):
            if response > 1e-6 or not s.use_response_expansion:
                break
            half_angle += float(_EXPANSION)
            best, response = self._search(
                thinned, predicted, predicted, window, (half_angle, s.coarse_angle_resolution), penalize
            )
        covariance = self._covariance(thinned, predicted, best, penalize)
        if fine:
            window = self._coarse_step / 2, self.grid.resolution
            turn = s.coarse_angle_resolution / 2, s.fine_search_angle_offset
            best, response = self._search(scan.points, best, predicted, window, turn, penalize)
        best[2] = wrap(best[2])
        return Match(best, min(response, 1.0), covariance)

    def _search(
        self,
        points: Points,
        centre: FloatArray,
        predicted: FloatArray,
        window: tuple[float, float],
        turn: tuple[float, float],
        penalize: bool,
    ) -> tuple[FloatArray, float]:
        """Best pose and its response; window: half size and step in metres; turn: half range and step in radians."""
        (half, step), (half_angle, angle_step) = window, turn
        n, n_angle = round(half / step), round(half_angle / angle_step)
        shifts = np.arange(-n, n + 1) * step
        angles = np.arange(-n_angle, n_angle + 1) * angle_step
        volume = _responses(self.grid.values, self.grid.origin, self.grid.resolution, points, centre, shifts, angles)
        if penalize:
            volume *= self._penalties(centre - predicted, shifts, angles)
        # The first of equals in a fixed order would lean to one corner: of equal responses take the most central.
        top = volume.max()
        a, y, x = np.nonzero(volume >= top - 1e-9)
        central = np.argmin(np.abs(a - n_angle) * 1e-3 + (y - n) ** 2 + (x - n) ** 2)
        best = centre + np.array([shifts[x[central]], shifts[y[central]], angles[a[central]]])
        return best, float(top)

    def _penalties(self, offset: FloatArray, shifts: AnyFloats, angles: AnyFloats) -> FloatArray:
        p = self._penalty
        squared = (offset[0] + shifts[None, :]) ** 2 + (offset[1] + shifts[:, None]) ** 2
        distance = np.maximum(1.0 - PENALTY_GAIN * squared / p.distance_variance, p.minimum_distance)
        angle = np.maximum(1.0 - PENALTY_GAIN * (offset[2] + angles) ** 2 / p.angle_variance, p.minimum_angle)
        return np.asarray(angle[:, None, None] * distance[None, :, :])

    def _covariance(self, points: Points, predicted: FloatArray, best: FloatArray, penalize: bool) -> FloatArray:
        """(3, 3): x and y over the window at the best heading, heading at the best place."""
        s = self._settings
        step = 2 * self.grid.resolution
        n = round(self._half / step)
        shifts = np.arange(-n, n + 1) * step
        centre = np.array([predicted[0], predicted[1], best[2]])
        plane = _responses(
            self.grid.values, self.grid.origin, self.grid.resolution, points, centre, shifts, np.zeros(1)
        )
        if penalize:
            plane *= self._penalties(centre - predicted, shifts, np.zeros(1))
        weights = plane[0]
        top = float(weights.max())
        covariance = np.diag([WORST_VARIANCE, WORST_VARIANCE, 4 * s.coarse_angle_resolution**2])
        if top > 1e-6:
            w = np.where(weights >= top - _NEARLY_AS_GOOD, weights, 0.0)
            total = w.sum()
            dx = centre[0] + shifts[None, :] - best[0]
            dy = centre[1] + shifts[:, None] - best[1]
            # A match is never better than a tenth of the search step (OpenKarto's floor); a poor one is worth less.
            floor = 0.1 * step**2
            covariance[0, 0] = max(float((w * dx * dx).sum() / total), floor) / top
            covariance[1, 1] = max(float((w * dy * dy).sum() / total), floor) / top
            covariance[0, 1] = covariance[1, 0] = float((w * dx * dy).sum() / total) / top
        angles = np.arange(-10, 11) * s.coarse_angle_resolution / 2
        line = _responses(self.grid.values, self.grid.origin, self.grid.resolution, points, best, np.zeros(1), angles)
        w = line[:, 0, 0]
        top = float(w.max())
        if top > 1e-6:
            w = np.where(w >= top - _NEARLY_AS_GOOD, w, 0.0)
            covariance[2, 2] = max(float((w * angles**2).sum() / w.sum()), 0.1 * s.fine_search_angle_offset**2) / top
        return covariance


@njit(cache=True)
def _responses(
    grid: Bytes,
    origin: FloatArray,
    resolution: float,
    points: Points,
    centre: FloatArray,
    shifts: FloatArray,
    angles: FloatArray,
) -> FloatArray:
    """(A, S, S) response at centre + (shifts[x], shifts[y], angles[a]).

    Shifts are rounded to whole cells, so a heading's hits are turned once and then only moved (OpenKarto's look-up).
    """
    n = points.shape[0]
    count = shifts.shape[0]
    out = np.zeros((angles.shape[0], count, count))
    if n == 0:
        return out
    height, width = np.int64(grid.shape[0]), np.int64(grid.shape[1])
    flat = grid.ravel()
    cells = np.empty(count, np.int64)
    for k in range(count):
        cells[k] = np.int64(np.round(shifts[k] / resolution))
    low, high = cells[0], cells[count - 1]
    index = np.empty(n, np.int64)
    for a in range(angles.shape[0]):
        c, s = np.cos(centre[2] + angles[a]), np.sin(centre[2] + angles[a])
        inside = 0
        for p in range(n):
            x = c * points[p, 0] - s * points[p, 1] + centre[0] - origin[0]
            y = s * points[p, 0] + c * points[p, 1] + centre[1] - origin[1]
            ix, iy = np.int64(np.floor(x / resolution)), np.int64(np.floor(y / resolution))
            if ix + low >= 0 and iy + low >= 0 and ix + high < width and iy + high < height:
                index[inside] = iy * width + ix
                inside += 1
        for j in range(count):
            for i in range(count):
                shift = cells[j] * width + cells[i]
                total = 0
                for p in range(inside):
                    total += flat[index[p] + shift]
                out[a, j, i] = total / (n * FULL)
    return out
