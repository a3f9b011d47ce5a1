"""The map: one point a voxel, in a hash table, and the exact nearest neighbours in it.

FAST-LIO2 keeps its points in an incremental k-d tree that thins them on insertion (Sec. V-C: in a cube, the point
nearest to its centre stays). A table of voxels gives the same map and the same neighbours: the rings of voxels around
a query are searched outwards until nothing nearer can follow.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray

Keys = npt.NDArray[np.int64]
FREE = np.int64(-1)
_SMALLEST = 1 << 12
_FARTHEST = 1 << 20  # voxels from the origin, along each axis


class VoxelMap:
    """Points of a map. size: side of a voxel, m.

    keep_nearest: whether a voxel's point gives way to one that is nearer to the centre.
    """

    def __init__(self, size: float, keep_nearest: bool) -> None:
        self.size = size
        self._keep_nearest = keep_nearest
        self.keys: Keys = np.full(_SMALLEST, FREE)
        self.points = np.zeros((_SMALLEST, 3))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def insert(self, points: FloatArray) -> None:
        """Take (N, 3) points in the world. Those a million voxels away, or not finite, are passed over."""
        while 2 * (self._count + len(points)) > len(self.keys):
            self.keys, self.points = _grown(self.keys, self.points)
        self._count += int(_insert(self.keys, self.points, points, self.size, self._keep_nearest))

    def all_points(self) -> FloatArray:
        """(len, 3) points, in the order of the table."""
        points: FloatArray = self.points[self.keys != FREE]
        return points


@njit(cache=True)
def key_of(x: float, y: float, z: float, size: float) -> int:
    """The voxel of a point as one number; -1 for one too far away."""
    if not (abs(x) + abs(y) + abs(z) < (_FARTHEST - 1) * size):  # or not finite
        return -1
    key: int = cell_key(math.floor(x / size), math.floor(y / size), math.floor(z / size))
    return key


@njit(cache=True)
def cell_key(i: int, j: int, k: int) -> int:
    """Three whole coordinates in 21 bits each."""
    return ((i + _FARTHEST) << 42) | ((j + _FARTHEST) << 21) | (k + _FARTHEST)


@njit(cache=True)
def slot_of(keys: Keys, key: int) -> int:
    """Where a key stands in the table, or the free place where it would (linear probing)."""
    mask = len(keys) - 1
    mixed = (key ^ (key >> 29)) * 0x2545F4914F6CDD1D
    slot = (mixed ^ (mixed >> 32)) & mask
    while keys[slot] != FREE and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@njit(cache=True)
def _grown(keys: Keys, points: FloatArray) -> tuple[Keys, FloatArray]:
    more, moved = np.full(2 * len(keys), FREE), np.zeros((2 * len(keys), 3))
    for old in range(len(keys)):
        if keys[old] != FREE:
            slot = slot_of(more, keys[old])
            more[slot] = keys[old]
            moved[slot] = points[old]
    return more, moved


@njit(cache=True)
def _off_centre(point: FloatArray, size: float) -> float:
    """Squared distance from the centre of the point's voxel, in voxels."""
    total = 0.0
    for axis in range(3):
        across = point[axis] / size
        total += (across - math.floor(across) - 0.5) ** 2
    return total


@njit(cache=True)
def _insert(keys: Keys, table: FloatArray, points: FloatArray, size: float, keep_nearest: bool) -> int:
    added = 0
    for n in range(len(points)):
        key = key_of(points[n, 0], points[n, 1], points[n, 2], size)
        if key < 0:
            continue
        slot = slot_of(keys, key)
        if keys[slot] == FREE:
            keys[slot] = key
            table[slot] = points[n]
            added += 1
        elif keep_nearest and _off_centre(points[n], size) < _off_centre(table[slot], size):
            table[slot] = points[n]
    return added


@njit(cache=True)
def nearest(  # type: ignore[no-untyped-def]
    keys: Keys, table: FloatArray, size: float, x: float, y: float, z: float, farthest: float, slots, squares
) -> int:
    """The nearest points to (x, y, z), at most len(slots) and none beyond `farthest`; returns how many.

    slots: filled with their places in the table; squares: with their squared distances, ascending.
    """
    wanted, found = len(slots), 0
    if not (abs(x) + abs(y) + abs(z) + farthest < (_FARTHEST - 2) * size):
        return 0
    i0, j0, k0 = math.floor(x / size), math.floor(y / size), math.floor(z / size)
    fx, fy, fz = x / size - i0, y / size - j0, z / size - k0
    edge = min(fx, 1.0 - fx, fy, 1.0 - fy, fz, 1.0 - fz)
    limit = farthest * farthest
    ring = 0
    while True:
        if ring > 0:
            seen = (ring - 1 + edge) * size  # all within this distance has been looked at
            if seen * seen >= limit:
                return found
        for i in range(-ring, ring + 1):
            gap = (i - fx if i > 0 else fx - i - 1.0 if i < 0 else 0.0) * size
            along_x = gap * gap
            if along_x > limit:
                continue
            for j in range(-ring, ring + 1):
                gap = (j - fy if j > 0 else fy - j - 1.0 if j < 0 else 0.0) * size
                along_xy = along_x + gap * gap
                if along_xy > limit:
                    continue
                step = 1 if abs(i) == ring or abs(j) == ring else max(1, 2 * ring)
                for k in range(-ring, ring + 1, step):
                    gap = (k - fz if k > 0 else fz - k - 1.0 if k < 0 else 0.0) * size
                    if along_xy + gap * gap > limit:
                        continue
                    slot = slot_of(keys, cell_key(i0 + i, j0 + j, k0 + k))
                    if keys[slot] == FREE:
                        continue
                    square = (table[slot, 0] - x) ** 2 + (table[slot, 1] - y) ** 2 + (table[slot, 2] - z) ** 2
                    if square > limit:
                        continue
                    place = found if found < wanted else wanted - 1
                    while place > 0 and squares[place - 1] > square:
                        squares[place], slots[place] = squares[place - 1], slots[place - 1]
                        place -= 1
                    squares[place], slots[place] = square, slot
                    if found < wanted:
                        found += 1
                    if found == wanted:
                        limit = min(limit, squares[wanted - 1])
        ring += 1
