"""What light each pixel receives: texture times light, once for every pixel that the rasterizer found a triangle for.

A row's pixels on one triangle are shaded in segments of sixteen, made ready sixteen segments at a time
(`shading_lanes.py`). Texture coordinates are exact for each pixel; the level of detail and the direction in which a
slanted surface stretches the pixel are worked out once for a segment.
"""

from __future__ import annotations

import numpy as np

from taskslam.compiled import njit
from taskslam.simulation.rendering.lanes import LANES
from taskslam.simulation.rendering.rasterizer import screen_planes
from taskslam.simulation.rendering.shading_lanes import (
    AFFINE,
    BEGINNINGS,
    INTEGERS,
    REALS,
    SEGMENT,
    WHOLE,
    segment_lanes,
    shade_lanes,
)
from taskslam.simulation.rendering.texture_atlas import LEVELS

_ROOM = 4096  # triangles in view at first; doubled when there are more


@njit(cache=True, nogil=True, error_model="numpy")
def shade(  # type: ignore[no-untyped-def]
    seen, vertices, triangles, entry, texel_uv, cells, light_offset, light, texels, offset, width_log2, height_log2,
    rotation, position, numbers, background, top, bottom, out,
):  # fmt: skip
    """Root of linear radiance of one colour plane for rows top..bottom of `out` (H, W) float32.

    seen: (H, W) int32 triangle of each pixel or -1; vertices, triangles as in `TriangleBlocks`; entry: (T,) texture
    and texel_uv (T, 3, 2) texel coordinates of triangles; cells, light_offset and light (2, S) as in `BakedLight`;
    texels, offset, width_log2, height_log2 as in `TextureAtlas`; rotation, position: of the camera; numbers: of the
    pinhole; background: value where nothing is seen.
    """
    columns = seen.shape[1]
    place = np.full(len(triangles), -1, np.int32)  # of a triangle among those met so far
    affine, whole, met = np.empty((_ROOM, AFFINE)), np.empty((_ROOM, WHOLE), np.int64), 0
    length = columns + LANES
    segments = np.zeros((SEGMENT, length), np.int32)
    reals, integers = np.empty((REALS, length), np.float32), np.empty((INTEGERS, length), np.int32)
    beginnings = np.empty((BEGINNINGS, length), np.int64)
    samples = light.reshape(-1)
    for row in range(top, bottom):
        many, column = 0, 0
        while column < columns:
            name = seen[row, column]
            end = column + 1
            while end < columns and seen[row, end] == name:
                end += 1
            if name < 0:
                out[row, column:end] = background
                column = end
                continue
            if place[name] < 0:
                if met == len(affine):
                    affine, whole = np.concatenate((affine, affine)), np.concatenate((whole, whole))
                place[name] = met
                side = _measure(vertices, triangles, name, texel_uv, rotation, position, numbers, affine, met)
                whole[met, 0], whole[met, 1] = side * light.shape[1] + light_offset[name], cells[name]
                whole[met, 2] = entry[name] * LEVELS
                whole[met, 3], whole[met, 4] = width_log2[entry[name]], height_log2[entry[name]]
                met += 1
            for begin in range(column, end, LANES):
                segments[0, many], segments[1, many] = place[name], begin
                segments[2, many], segments[3, many] = min(end - begin, LANES), begin > column
                many += 1
            column = end
        for first in range(0, many, LANES):
            segment_lanes(affine, whole, offset, samples, segments, first, float(row), reals, integers, beginnings)
        for segment in range(many):
            shade_lanes(out, row, segments, segment, reals, integers, beginnings, texels)


@njit(cache=True, nogil=True, error_model="numpy")
def _measure(  # type: ignore[no-untyped-def]
    vertices, triangles, name, texel_uv, rotation, position, numbers, affine, met
):  # fmt: skip
    """Fill line `met` of `affine` for the triangle `name`; returns 0 if its front is seen, else 1."""
    p = np.empty((3, 3))
    planes = np.empty((3, 3))
    for k in range(3):
        vertex = triangles[name, k]
        for axis in range(3):
            p[k, axis] = (
                rotation[axis, 0] * (vertices[vertex, 0] - position[0])
                + rotation[axis, 1] * (vertices[vertex, 1] - position[1])
                + rotation[axis, 2] * (vertices[vertex, 2] - position[2])
            )
    front = screen_planes(p[0], p[1], p[2], numbers, planes) < 0.0
    for k in range(3):
        for plane in range(3):
            affine[met, 3 * plane + k] = planes[plane, k]
    for axis in range(2):
        corner = float(texel_uv[name, 0, axis])
        one, two = texel_uv[name, 1, axis] - corner, texel_uv[name, 2, axis] - corner
        for k in range(3):
            affine[met, 9 + 3 * axis + k] = one * planes[1, k] + two * planes[2, k]
        affine[met, 15 + axis] = corner
    return 0 if front else 1
