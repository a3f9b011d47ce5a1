"""Polygons of meshes as triangles: a fan where one is convex, ear clipping where a fan would close what is open.

A wall with a doorway is one concave polygon in many OBJ and COLLADA files.
"""

from __future__ import annotations

import mapbox_earcut
import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray

Corners = npt.NDArray[np.int64]


def polygon_corners(points: FloatArray, counts: Corners) -> Corners:
    """(T, 3) corners of the triangles that fill polygons, as rows of `points`, wound as the polygons are.

    points: (C, 3) the corners of all polygons, one polygon after the other; counts: (P,) how many each has. One of
    fewer than three corners gives none.
    """
    starts, concave = np.cumsum(counts) - counts, is_concave(points, counts)
    triangles = [_fans(starts[~concave], counts[~concave])]
    for polygon in np.flatnonzero(concave):
        start, count = int(starts[polygon]), int(counts[polygon])
        triangles.append(start + _clipped_ears(points[start : start + count]))
    return np.concatenate(triangles)


def is_concave(points: FloatArray, counts: Corners) -> npt.NDArray[np.bool_]:
    """(P,) whether a polygon has a corner that turns against the others; see `polygon_corners`."""
    concave = np.zeros(len(counts), dtype=np.bool_)
    candidates = np.flatnonzero(counts > 3)
    for count in np.unique(counts[candidates]):
        chosen = candidates[counts[candidates] == count]
        rings = points[(np.cumsum(counts) - counts)[chosen][:, None] + np.arange(count)]
        along = np.roll(rings, -1, axis=1) - rings
        turns = np.cross(np.roll(along, 1, axis=1), along)
        normals = _normals(rings)[:, None]
        sizes = np.linalg.norm(normals, axis=2)
        concave[chosen] = (np.einsum("pcd,pcd->pc", turns, normals) < -1e-9 * sizes * sizes).any(axis=1)
    return concave


def _normals(rings: FloatArray) -> FloatArray:
    """(P, 3) twice the area as a vector (Newell's method), of (P, C, 3) rings of corners."""
    beside = rings - rings[:, :1]
    normals: FloatArray = np.cross(beside, np.roll(beside, -1, axis=1)).sum(axis=1)
    return normals


def _fans(starts: Corners, counts: Corners) -> Corners:
    number = np.maximum(counts - 2, 0)
    first = np.repeat(starts, number)
    step = np.arange(len(first)) - np.repeat(np.cumsum(number) - number, number)
    return np.stack([first, first + step + 1, first + step + 2], axis=1).astype(np.int64)


def _clipped_ears(ring: FloatArray) -> Corners:
    normal = _normals(ring[None])[0]
    drop = int(np.argmax(np.abs(normal)))
    flat = np.ascontiguousarray(np.delete(ring, drop, axis=1))
    cut = mapbox_earcut.triangulate_float64(flat, np.array([len(ring)], np.uint32)).reshape(-1, 3)
    triangles: Corners = cut.astype(np.int64)
    corners = ring[triangles]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ normal < 0.0
    triangles[turned] = triangles[turned, ::-1]
    return triangles
