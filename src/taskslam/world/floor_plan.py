"""`FloorPlan`: the occupancy grid that planners use, in the frame `map`.

Row 0 is the lowest y and column 0 the lowest x of the grid's own frame (the order of ROS's OccupancyGrid, so an
image file is flipped when read). `origin` is the pose of the outer corner of cell (0, 0) in `map`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.geometry import SE2, FloatArray, transform_points

FREE, OCCUPIED, UNKNOWN = 0, 100, 255


@dataclass(frozen=True)
class FloorPlan:
    """cells: (rows, columns) uint8 of FREE, OCCUPIED or UNKNOWN; resolution: m per cell; origin: T_map_grid."""

    cells: npt.NDArray[np.uint8]
    resolution: float
    origin: SE2

    def cells_of(self, points: FloatArray) -> npt.NDArray[np.int64]:
        """(N, 2) row and column of (N, 2) points x, y in `map`; may lie outside the grid."""
        local = transform_points(self.origin.inverse(), np.asarray(points, dtype=np.float64))
        return np.floor(local / self.resolution).astype(np.int64)[:, ::-1]

    def points_of(self, cells: npt.NDArray[np.int64]) -> FloatArray:
        """(N, 2) centres x, y in `map` of (N, 2) cells row, column."""
        local = (np.asarray(cells, dtype=np.float64)[:, ::-1] + 0.5) * self.resolution
        return transform_points(self.origin, local)

    def at(self, x: float, y: float) -> int:
        """FREE, OCCUPIED or UNKNOWN at a point in `map`; UNKNOWN outside the grid."""
        row, column = self.cells_of(np.array([[x, y]]))[0]
        inside = 0 <= row < self.cells.shape[0] and 0 <= column < self.cells.shape[1]
        return int(self.cells[row, column]) if inside else UNKNOWN
