"""`OccupancyGrid`: log-odds of occupation in square cells, filled by scans, growing with what the robot sees."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray

LogOdds = npt.NDArray[np.float32]
Marks = npt.NDArray[np.int32]

LIMIT = 50.0  # log-odds are kept within: beyond, a probability is 0 or 1 in any case
_CHUNK_M = 12.8  # metres by which the map grows: seldom enough that copying it costs nothing


class OccupancyGrid:
    """One level of the map. log_odds: (rows, columns), row along y, 0 where nothing is known.

    origin: (2,) world x, y of the corner of cell (0, 0); always whole cells from the world's origin. max_side: metres.
    """

    def __init__(self, resolution: float, max_side: float) -> None:
        self.resolution = resolution
        self.log_odds: LogOdds = np.zeros((0, 0), np.float32)
        self.origin = np.zeros(2)
        self._max_side = max_side
        self._marks: Marks = np.zeros((0, 0), np.int32)
        self._insertions = 0

    def restore(self, log_odds: LogOdds, origin: FloatArray) -> None:
        """Take a map as it was saved."""
        self.log_odds = np.ascontiguousarray(log_odds, np.float32)
        self.origin = np.array(origin, np.float64)
        self._marks = np.zeros(log_odds.shape, np.int32)
        self._insertions = 0

    def insert(self, points: FloatArray, sensor: FloatArray, pose: FloatArray, free: float, occupied: float) -> None:
        """Mark the cells of (N, 2) hits as more occupied and those between them and the (2,) sensor as more free.

        points, sensor: in the base frame; pose: (3,) of the base. free, occupied: what a scan adds to a cell's
        log-odds, once however many rays meet the cell; a hit outweighs the rays that pass.
        """
        if self._insertions > 1_000_000_000:
            self._marks[:] = 0
            self._insertions = 0
        world = _place(np.vstack([points, sensor]), pose)
        self._cover(world)
        self._insertions += 1
        cells = (world - self.origin) / self.resolution
        _insert(self.log_odds, self._marks, 2 * self._insertions, cells, free, occupied)

    def _cover(self, world: FloatArray) -> None:
        """Grow so that (N, 2) world points lie inside, as far as max_side allows."""
        half = self._max_side / 2
        low = np.maximum(world.min(axis=0), -half)
        high = np.minimum(world.max(axis=0), half)
        rows, columns = self.log_odds.shape
        size = np.array([columns, rows])
        first = np.zeros(2, np.int64) if rows == 0 else np.round(self.origin / self.resolution).astype(np.int64)
        # Whole chunks, so that a map that is seen again and again is not copied for every cell that it grows by.
        chunk = math.ceil(_CHUNK_M / self.resolution)
        begin = np.floor(low / self.resolution / chunk).astype(np.int64) * chunk
        end = np.floor(high / self.resolution / chunk).astype(np.int64) * chunk + chunk
        if rows:
            begin, end = np.minimum(begin, first), np.maximum(end, first + size)
            if (begin == first).all() and (end == first + size).all():
                return
        new = end - begin
        log_odds = np.zeros((int(new[1]), int(new[0])), np.float32)
        marks = np.zeros(log_odds.shape, np.int32)
        if rows:
            x, y = first - begin
            log_odds[y : y + rows, x : x + columns] = self.log_odds
            marks[y : y + rows, x : x + columns] = self._marks
        self.log_odds, self._marks, self.origin = log_odds, marks, begin * self.resolution


def _place(points: FloatArray, pose: FloatArray) -> FloatArray:
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = points[:, 0], points[:, 1]
    return np.stack([c * x - s * y + pose[0], s * x + c * y + pose[1]], axis=1)


@njit(cache=True)
def _insert(log_odds: LogOdds, marks: Marks, mark: int, cells: FloatArray, free: float, occupied: float) -> None:
    """cells: (N + 1, 2) columns and rows of the hits and, last, of the sensor.

    A cell marked `mark` was seen free in this scan, one marked `mark + 1` was hit.
    """
    rows, columns = log_odds.shape
    n = cells.shape[0] - 1
    sx, sy = int(np.floor(cells[n, 0])), int(np.floor(cells[n, 1]))
    if sx < 0 or sy < 0 or sx >= columns or sy >= rows:
        return
    for p in range(n):
        ex, ey = int(np.floor(cells[p, 0])), int(np.floor(cells[p, 1]))
        if ex < 0 or ey < 0 or ex >= columns or ey >= rows:
            continue
        # Bresenham 1965, "Algorithm for computer control of a digital plotter", without the last cell.
        dx, dy = abs(ex - sx), abs(ey - sy)
        step_x, step_y = 1 if ex > sx else -1, 1 if ey > sy else -1
        x, y, error = sx, sy, dx - dy
        while x != ex or y != ey:
            if marks[y, x] < mark:
                marks[y, x] = mark
                log_odds[y, x] = max(log_odds[y, x] + free, -LIMIT)
            twice = 2 * error
            if twice > -dy:
                error -= dy
                x += step_x
            if twice < dx:
                error += dx
                y += step_y
        if marks[ey, ex] <= mark:
            passed = marks[ey, ex] == mark
            marks[ey, ex] = mark + 1
            log_odds[ey, ex] = min(log_odds[ey, ex] + occupied - (free if passed else 0.0), LIMIT)
