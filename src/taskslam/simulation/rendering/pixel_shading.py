"""What light each pixel receives: texture times light, once for every pixel that the rasterizer found a triangle for.

A row's pixels on one triangle are shaded in short segments. Texture coordinates are exact for each pixel; the level of
detail and the direction in which a slanted surface stretches the pixel are worked out once for a segment.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.simulation.rendering.rasterizer import screen_planes

_SEGMENT = 16
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
                row, column, planes, texel_uv[name], cells[name], light_offset[name], light[side],
                texels, offset[entry[name]], width_log2[entry[name]], height_log2[entry[name]],
                out[row, column:end],
            )  # fmt: skip
            column = end


@njit(cache=True, nogil=True, error_model="numpy")
def _shade_run(  # type: ignore[no-untyped-def]
    row, begin, planes, uv, cells, light_offset, light, texels, offset, width_log2, height_log2, out
):  # fmt: skip
    """Shade `out`, the columns of a row from `begin` on, all on one triangle."""
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
    # The light at a segment's end is the next one's beginning.
    next_lit = _light(light, light_offset, cells, s_start / n_start, t_start / n_start)
    for left in range(0, len(out), _SEGMENT):
        right = min(left + _SEGMENT, len(out))
        last = float(right - 1)
        inverse = 1.0 / (n_start + na * last)
        lit = next_lit
        u, v = (s_start + planes[1, 0] * last) * inverse, (t_start + planes[2, 0] * last) * inverse
        next_lit = _light(light, light_offset, cells, u, v)
        middle = 0.5 * (left + last)
        inverse = 1.0 / (n_start + na * middle)
        x, y = (x_start + xa * middle) * inverse, (y_start + ya * middle) * inverse
        across_x, across_y = (xa - x * na) * inverse, (ya - y * na) * inverse
        down_x, down_y = (xb - x * nb) * inverse, (yb - y * nb) * inverse
        long, short = across_x * across_x + across_y * across_y, down_x * down_x + down_y * down_y
        step_x, step_y = across_x, across_y
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
        w, h = max(width_log2 - level, 0), max(height_log2 - level, 0)
        next_w, next_h = max(w - 1, 0), max(h - 1, 0)
        scale_x, scale_y = 1.0 / (1 << (width_log2 - w)), 1.0 / (1 << (height_log2 - h))
        next_x, next_y = 1.0 / (1 << (width_log2 - next_w)), 1.0 / (1 << (height_log2 - next_h))
        fine_begin, coarse_begin = offset[level], offset[min(level + 1, _COARSEST)]
        step_x, step_y = step_x / probes, step_y / probes
        x_first = x0 - step_x * 0.5 * (probes - 1)
        y_first = y0 - step_y * 0.5 * (probes - 1)
        share = np.float32(1.0 / (255.0 * probes))
        known_at = max(left - 1, 0)
        brighter = (next_lit - lit) * share / np.float32(max(right - 1 - known_at, 1))
        lit *= share
        for i in range(left, right):
            along = float(i)
            inverse = 1.0 / (n_start + na * along)
            x = (x_start + xa * along) * inverse + x_first
            y = (y_start + ya * along) * inverse + y_first
            value = np.float32(0.0)
            for _ in range(probes):
                fine = _texel(texels, fine_begin, x * scale_x, y * scale_y, w, h)
                if blend > np.float32(0.0):
                    coarse = _texel(texels, coarse_begin, x * next_x, y * next_y, next_w, next_h)
                    fine += blend * (coarse - fine)
                value += fine
                x += step_x
                y += step_y
            out[i] = value * (lit + brighter * np.float32(i - known_at))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _texel(texels, begin, x, y, width_log2, height_log2):  # type: ignore[no-untyped-def]
    """Bilinear value 0..255 of a repeating texture's level at coordinates x, y in its own texels."""
    x -= 0.5
    y -= 0.5
    column, row = math.floor(x), math.floor(y)
    fx, fy = np.float32(x - column), np.float32(y - row)
    across, down = (1 << width_log2) - 1, (1 << height_log2) - 1
    left, right = column & across, (column + 1) & across
    upper, lower = begin + ((row & down) << width_log2), begin + (((row + 1) & down) << width_log2)
    # Unsigned indices, since numba would look for negative ones that count from the end.
    a, b = np.float32(texels[np.uint64(upper + left)]), np.float32(texels[np.uint64(upper + right)])
    c, d = np.float32(texels[np.uint64(lower + left)]), np.float32(texels[np.uint64(lower + right)])
    a += fx * (b - a)
    c += fx * (d - c)
    return a + fy * (c - a)


@njit(cache=True, nogil=True, error_model="numpy")
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
