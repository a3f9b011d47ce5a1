"""Triangles in blocks of neighbours, so that a renderer can leave out a whole block that it cannot see.

A block has its own vertices in one run of memory: they are projected once, and only if the block is in view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float32]

TRIANGLES_PER_BLOCK = 64
_LARGE = 2.0  # metres: a triangle with a longer edge goes into a block of large ones, drawn first as they hide most


@dataclass(frozen=True)
class TriangleBlocks:
    """B blocks over T triangles and V vertices.

    vertices: (V, 3) float32 m, world frame; triangles: (T, 3) int32 vertex indices; source: (T,) int32 which triangle
    of the mesh each one is; first_triangle, first_vertex: (B + 1,) int32 where each block begins; low, high: (B, 3)
    float32 corners of its bounding box. The first `large` blocks hold the large triangles.
    """

    vertices: Floats
    triangles: Ints
    source: Ints
    first_triangle: Ints
    first_vertex: Ints
    low: Floats
    high: Floats
    large: int

    @property
    def most_vertices(self) -> int:
        """The largest number of vertices in a block."""
        return int(np.diff(self.first_vertex).max(initial=0))


def triangle_blocks(corners: Floats, chosen: npt.NDArray[np.int64]) -> TriangleBlocks:
    """Blocks of the `chosen` triangles among (N, 3, 3) corners, neighbours together."""
    picked = corners[chosen]
    longest = np.sqrt(((picked - np.roll(picked, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)) if len(chosen) else chosen
    is_large = longest > _LARGE
    order = np.lexsort((_morton(picked), ~is_large))
    chosen, picked = chosen[order], picked[order]
    # Large and small triangles never share a block, so the first small one begins a new block.
    many = int(is_large.sum())
    starts = np.concatenate(
        [np.arange(0, many, TRIANGLES_PER_BLOCK), np.arange(many, len(chosen), TRIANGLES_PER_BLOCK)]
    )
    first_triangle = np.append(starts, len(chosen)).astype(np.int32)
    if not len(chosen):
        empty = np.zeros((0, 3), np.float32)
        none = np.zeros(1, np.int32)
        return TriangleBlocks(empty, np.zeros((0, 3), np.int32), none[:0], none, none, empty, empty, 0)
    block = np.repeat(np.arange(len(starts)), np.diff(first_triangle))
    vertices, triangles, first_vertex = _own_vertices(picked, block, len(starts))
    return TriangleBlocks(
        vertices,
        triangles,
        chosen.astype(np.int32),
        first_triangle,
        first_vertex,
        np.minimum.reduceat(picked.min(axis=1), starts, axis=0),
        np.maximum.reduceat(picked.max(axis=1), starts, axis=0),
        -(-many // TRIANGLES_PER_BLOCK),
    )


def _own_vertices(corners: Floats, block: npt.NDArray[np.int64], blocks: int) -> tuple[Floats, Ints, Ints]:
    """Vertices (V, 3) sorted by block and welded within it, triangles (T, 3), first vertex of each block (B + 1,).

    Welding by equal coordinates keeps neighbours free of cracks: what is equal in the mesh is equal on the screen.
    """
    points = np.ascontiguousarray(corners.reshape(-1, 3)) + np.float32(0.0)  # -0.0 becomes 0.0: same place, same bytes
    places, place = np.unique(points.view(np.dtype((np.void, 12))).ravel(), return_inverse=True)
    keys, index = np.unique(np.repeat(block, 3) * len(places) + place.ravel(), return_inverse=True)
    vertices = places.view(np.float32).reshape(-1, 3)[keys % len(places)]
    first = np.searchsorted(keys // len(places), np.arange(blocks + 1))
    return np.ascontiguousarray(vertices), index.reshape(-1, 3).astype(np.int32), first.astype(np.int32)


def _morton(corners: Floats) -> npt.NDArray[np.uint64]:
    """(N,) place of each triangle's centre along a space-filling curve."""
    centre = corners.mean(axis=1, dtype=np.float64)
    if not len(centre):
        return np.zeros(0, np.uint64)
    low, high = centre.min(axis=0), centre.max(axis=0)
    cell = ((centre - low) / max(float((high - low).max()), 1e-9) * 1023.0).astype(np.uint64)
    code = np.zeros(len(cell), np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= (cell[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return code
