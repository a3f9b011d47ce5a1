"""What light each pixel receives: texture times light, once for every pixel that the rasterizer found a triangle for.

A row's pixels on one triangle are shaded in segments of sixteen (`pixel_lanes.py`). Texture coordinates are exact for
each pixel; the level of detail and the direction in which a slanted surface stretches the pixel are worked out once for
a segment.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.simulation.rendering.pixel_lanes import LANES, shade_lanes
from taskslam.simulation.rendering.rasterizer import screen_planes

_PROBES = 4  # texture samples along the direction in which a slanted surface stretches a pixel, at most
_PROBES_PER_STRETCH = 0.7
_COARSEST = 11  # the last level of every texture in the atlas


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
    planes = np.empty((len(triangles), 3, 3))  # of the triangles met so far
    side = np.full(len(triangles), -1, np.int8)  # which one is seen, -1 of those not met yet
    p = np.empty((3, 3))
    for row in range(top, bottom):
        column = 0
        while column < columns:
            name = seen[row, column]
            end = column + 1
            while end < columns and seen[row, end] == name:
                end += 1
            if name < 0:
                out[row, column:end] = background
                column = end
                continue
            if side[name] < 0:
                for k in range(3):
                    vertex = triangles[name, k]
                    for axis in range(3):
                        p[k, axis] = (
                            rotation[axis, 0] * (vertices[vertex, 0] - position[0])
                            + rotation[axis, 1] * (vertices[vertex, 1] - position[1])
                            + rotation[axis, 2] * (vertices[vertex, 2] - position[2])
                        )
                side[name] = 0 if screen_planes(p[0], p[1], p[2], numbers, planes[name]) < 0.0 else 1
            _shade_run(
                row, column, end, name, planes, side[name], texel_uv, cells, light_offset, light,
                texels, offset, entry[name], width_log2[entry[name]], height_log2[entry[name]], out,
            )  # fmt: skip
            column = end


@njit(cache=True, nogil=True, error_model="numpy")
def _shade_run(  # type: ignore[no-untyped-def]
    row, begin, end, name, planes, side, texel_uv, all_cells, light_offset, light, texels, offset, entry, width_log2,
    height_log2, out,
):  # fmt: skip
    """Shade columns begin..end of a row, all on the triangle `name`. Arrays come whole: views of them cost time."""
    cells, light_begin = all_cells[name], light_offset[name]
    x0, y0 = float(texel_uv[name, 0, 0]), float(texel_uv[name, 0, 1])
    x1, y1 = texel_uv[name, 1, 0] - x0, texel_uv[name, 1, 1] - y0
    x2, y2 = texel_uv[name, 2, 0] - x0, texel_uv[name, 2, 1] - y0
    # Affine numerators of the texel coordinates: x = X / N, y = Y / N.
    na, nb = planes[name, 0, 0], planes[name, 0, 1]
    sa, sb = planes[name, 1, 0], planes[name, 1, 1]
    ta, tb = planes[name, 2, 0], planes[name, 2, 1]
    n_start = na * begin + nb * row + planes[name, 0, 2]
    s_start = sa * begin + sb * row + planes[name, 1, 2]
    t_start = ta * begin + tb * row + planes[name, 2, 2]
    xa, xb = x1 * sa + x2 * ta, x1 * sb + x2 * tb
    ya, yb = y1 * sa + y2 * ta, y1 * sb + y2 * tb
    x_start, y_start = x1 * s_start + x2 * t_start, y1 * s_start + y2 * t_start
    wide, high = float(1 << width_log2), float(1 << height_log2)
    # The light at a segment's end is the next one's beginning.
    next_lit = _light(light, side, light_begin, cells, s_start / n_start, t_start / n_start)
    for left in range(0, end - begin, LANES):
        right = min(left + LANES, end - begin)
        last = float(right - 1)
        inverse = 1.0 / (n_start + na * last)
        lit = next_lit
        next_lit = _light(
            light, side, light_begin, cells, (s_start + sa * last) * inverse, (t_start + ta * last) * inverse
        )
        middle = 0.5 * (left + last)
        inverse = 1.0 / (n_start + na * middle)
        x, y = (x_start + xa * middle) * inverse, (y_start + ya * middle) * inverse
        step_x, step_y = (xa - x * na) * inverse, (ya - y * na) * inverse
        down_x, down_y = (xb - x * nb) * inverse, (yb - y * nb) * inverse
        long, short = step_x * step_x + step_y * step_y, down_x * down_x + down_y * down_y
        if short > long:
            long, short = short, long
            step_x, step_y = down_x, down_y
        # Several samples along the stretched direction let the level suit the other one, so that a floor seen at a
        # grazing angle is neither blurred nor aliased.
        probes = 1
        if long > 1.0:
            probes = min(max(int(math.sqrt(long / max(short, 1.0)) * _PROBES_PER_STRETCH + 0.5), 1), _PROBES)
        detail = 0.5 * math.log2(max(long / (probes * probes), 1.0))
        if not detail < _COARSEST:  # nor a number at all, on a needle of a triangle
            detail = float(_COARSEST)
        level = min(int(detail), _COARSEST - 1)
        # Blending two levels costs double: near to a level, that level alone will do.
        blend = np.float32(min(max((detail - level - 0.25) * 2.0, 0.0), 1.0))
        if blend == np.float32(1.0):
            level, blend = level + 1, np.float32(0.0)
        step_x, step_y = step_x / probes, step_y / probes
        back = -0.5 * (probes - 1)
        # Whole repeats are taken off, so that float32 tells places within a texel.
        base_x = x0 - math.floor((x + x0) / wide) * wide
        base_y = y0 - math.floor((y + y0) / high) * high
        share = np.float32(1.0 / (255.0 * probes))
        known_at = max(left - 1, 0)
        brighter = (next_lit - lit) * share / np.float32(max(right - 1 - known_at, 1))
        shade_lanes(
            out, row, begin + left, right - left, left,
            (n_start, na, x_start, xa, y_start, ya, base_x, base_y),
            probes,
            (np.float32(back * step_x), np.float32(back * step_y), np.float32(step_x), np.float32(step_y)),
            texels,
            _level(offset, entry, level, width_log2, height_log2),
            _level(offset, entry, min(level + 1, _COARSEST), width_log2, height_log2),
            blend,
            (lit * share + brighter * np.float32(left - known_at), brighter),
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _level(offset, entry, level, width_log2, height_log2):  # type: ignore[no-untyped-def]
    """A texture's level as `shade_lanes` takes it."""
    width, height = max(width_log2 - level, 0), max(height_log2 - level, 0)
    scale_x, scale_y = 1.0 / (1 << (width_log2 - width)), 1.0 / (1 << (height_log2 - height))
    return offset[entry, level], np.int32(width), np.int32(height), np.float32(scale_x), np.float32(scale_y)


@njit(cache=True, nogil=True, error_model="numpy")
def _light(light, side, begin, cells, u, v):  # type: ignore[no-untyped-def]
    """Linear interpolation in a triangle's grid of light samples."""
    u, v = min(max(u, 0.0), 1.0) * cells, min(max(v, 0.0), 1.0) * cells
    j = min(int(v), cells - 1)
    i = min(int(u), cells - 1 - j)
    fu, fv = np.float32(u - i), np.float32(v - j)
    here = begin + j * (cells + 1) - j * (j - 1) // 2 + i
    above = here + cells + 1 - j
    right, higher = light[side, here + 1], light[side, above]
    if fu + fv <= np.float32(1.0) or i + j == cells - 1:
        return light[side, here] + fu * (right - light[side, here]) + fv * (higher - light[side, here])
    far = light[side, above + 1]
    return far + (np.float32(1.0) - fu) * (higher - far) + (np.float32(1.0) - fv) * (right - far)
