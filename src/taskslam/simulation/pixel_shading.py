"""What light each pixel receives: texture times light, once for every pixel that the rasterizer found a triangle for.

A row's pixels on one triangle are shaded in short segments. Texture coordinates are exact for each pixel; the level of
detail and the direction in which a slanted surface stretches the pixel are worked out once for a segment.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from taskslam.simulation.rasterizer import screen_planes

_SEGMENT = 16
_PROBES = 4  # texture samples along the stretched direction, at most
_FINEST_LEVEL = 11


@njit(cache=True, nogil=True)
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
    planes = np.zeros((3, 3))
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
            for k in range(3):
                vertex = triangles[name, k]
                for axis in range(3):
                    p[k, axis] = (
                        rotation[axis, 0] * (vertices[vertex, 0] - position[0])
                        + rotation[axis, 1] * (vertices[vertex, 1] - position[1])
                        + rotation[axis, 2] * (vertices[vertex, 2] - position[2])
                    )
            scale = screen_planes(p[0], p[1], p[2], numbers, planes)
            side = 0 if scale < 0.0 else 1
            _shade_run(
                row, column, end, planes, texel_uv[name], cells[name], light_offset[name], light[side],
                texels, offset[entry[name]], width_log2[entry[name]], height_log2[entry[name]], out,
            )  # fmt: skip
            column = end


@njit(cache=True, nogil=True)
def _shade_run(  # type: ignore[no-untyped-def]
    row, begin, end, planes, uv, cells, light_offset, light, texels, offset, width_log2, height_log2, out
):  # fmt: skip
    """Shade columns begin..end of a row, all on one triangle."""
    x0, y0 = float(uv[0, 0]), float(uv[0, 1])
    x1, y1 = uv[1, 0] - x0, uv[1, 1] - y0
    x2, y2 = uv[2, 0] - x0, uv[2, 1] - y0
    # Affine numerators of the texel coordinates: x = X / N, y = Y / N.
    na, nb = planes[0, 0], planes[0, 1]
    n_start = planes[0, 0] * begin + planes[0, 1] * row + planes[0, 2]
    s_start = planes[1, 0] * begin + planes[1, 1] * row + planes[1, 2]
    t_start = planes[2, 0] * begin + planes[2, 1] * row + planes[2, 2]
    xa, xb = x1 * planes[1, 0] + x2 * planes[2, 0], x1 * planes[1, 1] + x2 * planes[2, 1]
    ya, yb = y1 * planes[1, 0] + y2 * planes[2, 0], y1 * planes[1, 1] + y2 * planes[2, 1]
    x_start, y_start = x1 * s_start + x2 * t_start, y1 * s_start + y2 * t_start
    l0 = light[light_offset]
    l1, l2 = light[light_offset + 1] - l0, light[light_offset + 2] - l0
    for left in range(begin, end, _SEGMENT):
        right = min(left + _SEGMENT, end)
        middle = 0.5 * (left + right - 1) - begin
        inverse = 1.0 / (n_start + na * middle)
        x, y = (x_start + xa * middle) * inverse, (y_start + ya * middle) * inverse
        across_x, across_y = (xa - x * na) * inverse, (ya - y * na) * inverse
        down_x, down_y = (xb - x * nb) * inverse, (yb - y * nb) * inverse
        long, short = across_x * across_x + across_y * across_y, down_x * down_x + down_y * down_y
        step_x, step_y = across_x, across_y
        if short > long:
            long, short = short, long
            step_x, step_y = down_x, down_y
        # A pixel is as wide as the shorter of its two sides, but no narrower than its area allows.
        probes = 1
        if long > 1.0:
            stretch = math.sqrt(long / max(short, 1.0))
            probes = min(max(int(stretch + 0.5), 1), _PROBES)
        detail = 0.5 * math.log2(max(long, 1e-12)) - math.log2(float(probes))
        detail = min(max(detail, 0.0), float(_FINEST_LEVEL))
        level = min(int(detail), _FINEST_LEVEL - 1)
        blend = np.float32(detail - level)
        step_x /= probes
        step_y /= probes
        x_first = x0 - step_x * 0.5 * (probes - 1)
        y_first = y0 - step_y * 0.5 * (probes - 1)
        share = np.float32(1.0 / (255.0 * probes))
        two = blend > np.float32(0.02)
        for column in range(left, right):
            along = float(column - begin)
            inverse = 1.0 / (n_start + na * along)
            x = (x_start + xa * along) * inverse + x_first
            y = (y_start + ya * along) * inverse + y_first
            value = np.float32(0.0)
            for probe in range(probes):
                px, py = x + step_x * probe, y + step_y * probe
                fine = _texel(texels, offset[level], px, py, width_log2, height_log2, level)
                if two:
                    coarse = _texel(texels, offset[level + 1], px, py, width_log2, height_log2, level + 1)
                    fine += blend * (coarse - fine)
                value += fine
            u = (s_start + planes[1, 0] * along) * inverse
            v = (t_start + planes[2, 0] * along) * inverse
            if cells == 1:
                lit = l0 + np.float32(u) * l1 + np.float32(v) * l2
            else:
                lit = _light(light, light_offset, cells, u, v)
            out[row, column] = value * share * lit


@njit(cache=True, nogil=True, inline="always")
def _texel(texels, begin, x, y, width_log2, height_log2, level):  # type: ignore[no-untyped-def]
    """Bilinear value 0..255 of a repeating texture's level at texel coordinates x, y of its first level."""
    w, h = max(width_log2 - level, 0), max(height_log2 - level, 0)
    x = x * (1.0 / (1 << (width_log2 - w))) - 0.5
    y = y * (1.0 / (1 << (height_log2 - h))) - 0.5
    column, row = math.floor(x), math.floor(y)
    fx, fy = np.float32(x - column), np.float32(y - row)
    left, right = column & ((1 << w) - 1), (column + 1) & ((1 << w) - 1)
    upper, lower = begin + ((row & ((1 << h) - 1)) << w), begin + (((row + 1) & ((1 << h) - 1)) << w)
    a, b = np.float32(texels[upper + left]), np.float32(texels[upper + right])
    c, d = np.float32(texels[lower + left]), np.float32(texels[lower + right])
    a += fx * (b - a)
    c += fx * (d - c)
    return a + fy * (c - a)


@njit(cache=True, nogil=True)
def _light(light, begin, cells, u, v):  # type: ignore[no-untyped-def]
    """Linear interpolation in a triangle's grid of light samples."""
    u, v = min(max(u, 0.0), 1.0) * cells, min(max(v, 0.0), 1.0) * cells
    j = min(int(v), cells - 1)
    i = min(int(u), cells - 1 - j)
    fu, fv = np.float32(u - i), np.float32(v - j)
    here = begin + j * (cells + 1) - j * (j - 1) // 2 + i
    above = here + cells + 1 - j
    if fu + fv <= np.float32(1.0) or i + j == cells - 1:
        return light[here] + fu * (light[here + 1] - light[here]) + fv * (light[above] - light[here])
    far = light[above + 1]
    return far + (np.float32(1.0) - fu) * (light[above] - far) + (np.float32(1.0) - fv) * (light[here + 1] - far)
