"""Which triangle each pixel sees: a z-buffer rasterizer over blocks of triangles.

A pixel is seen at its centre. A row's span on an edge is computed from the edge's upper end alone, and spans are
half-open (the top-left rule), so that two triangles that share an edge leave no pixel out and draw none twice. All
edges are in float64: no snapping to a grid, no guard band. The buffer holds 1 / depth, which is affine on the screen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from taskslam.geometry import FloatArray
from taskslam.simulation.triangle_blocks import TriangleBlocks

_LEFT, _RIGHT, _ABOVE, _BELOW, _NEAR, _FAR = 1, 2, 4, 8, 16, 32


@dataclass(frozen=True)
class Pinhole:
    """A pinhole's pixels: a pixel's centre has whole coordinates; focal and center in pixels, near and far in m."""

    width: int
    height: int
    focal: float
    center: tuple[float, float]
    near: float = 0.05
    far: float = 50.0

    def numbers(self) -> FloatArray:
        """focal, center x, center y, near, far for the kernels."""
        return np.array([self.focal, *self.center, self.near, self.far])


@dataclass(frozen=True)
class CutOuts:
    """Where triangles have holes: the opacity of textures such as leaves.

    entry: (T,) int32 texture of each triangle, -1 for a triangle without holes; texel_uv: (T, 3, 2) float32 corner
    coordinates in texels of the texture's first level, y down; opacity: (N,) uint8 texels of all levels of all
    textures; offset: (E, L) int64 where each level begins; width, height: (E,) int64 base-2 logarithms of the size.
    """

    entry: npt.NDArray[np.int32]
    texel_uv: npt.NDArray[np.float32]
    opacity: npt.NDArray[np.uint8]
    offset: npt.NDArray[np.int64]
    width: npt.NDArray[np.int64]
    height: npt.NDArray[np.int64]


def visible_blocks(
    blocks: TriangleBlocks, R_camera_world: FloatArray, position: FloatArray, pinhole: Pinhole
) -> npt.NDArray[np.int64]:
    """Indices of the blocks whose boxes reach into the view: large triangles first, then from near to far."""
    depth = _box_depth(
        blocks.low, blocks.high, R_camera_world, position, pinhole.numbers(), pinhole.width, pinhole.height
    )
    seen = np.flatnonzero(depth >= 0.0)
    return seen[np.lexsort((depth[seen], seen >= blocks.large))]


def rasterize(
    blocks: TriangleBlocks,
    order: npt.NDArray[np.int64],
    cut_outs: CutOuts,
    R_camera_world: FloatArray,
    position: FloatArray,
    pinhole: Pinhole,
    rows: tuple[int, int],
    inverse_depth: npt.NDArray[np.float32],
    triangle: npt.NDArray[np.int32],
) -> None:
    """Draw blocks in `order` into a band of rows of two (height, width) buffers.

    R_camera_world: (3, 3) from world to camera's optical frame; position: (3,) of the camera in the world, m.
    inverse_depth: 1 / m along the optical axis, 0 where nothing is nearer than `far`; triangle: index into
    `blocks.triangles`, -1 where nothing is seen. The band is overwritten.
    """
    inverse_depth[rows[0] : rows[1]] = np.float32(1.0 / pinhole.far)
    triangle[rows[0] : rows[1]] = -1
    _draw_blocks(
        order,
        blocks.first_triangle,
        blocks.first_vertex,
        blocks.vertices,
        blocks.triangles,
        blocks.most_vertices,
        (cut_outs.entry, cut_outs.texel_uv, cut_outs.opacity, cut_outs.offset, cut_outs.width, cut_outs.height),
        R_camera_world,
        position,
        pinhole.numbers(),
        pinhole.width,
        rows[0],
        rows[1],
        inverse_depth,
        triangle,
    )


@njit(cache=True, nogil=True)
def screen_planes(p0, p1, p2, numbers, out):  # type: ignore[no-untyped-def]
    """Three affine functions of the pixel, (3, 3) rows A, B, C of A * column + B * row + C, for one triangle.

    Their values N, S, T at a pixel give the barycentric u = S / N and v = T / N of its ray's hit (Moeller and Trumbore
    1997, with the camera as the origin), for vertices (3,) in the camera frame that may even lie behind it. Returns
    n . p0: depth = n . p0 / N; negative where the camera sees the front by the winding.
    """
    focal, cx, cy = numbers[0], numbers[1], numbers[2]
    ax, ay, az = p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]
    bx, by, bz = p2[0] - p0[0], p2[1] - p0[1], p2[2] - p0[2]
    out[0, 0], out[0, 1], out[0, 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    out[1, 0] = by * p0[2] - bz * p0[1]
    out[1, 1] = bz * p0[0] - bx * p0[2]
    out[1, 2] = bx * p0[1] - by * p0[0]
    out[2, 0] = p0[1] * az - p0[2] * ay
    out[2, 1] = p0[2] * ax - p0[0] * az
    out[2, 2] = p0[0] * ay - p0[1] * ax
    scale = out[0, 0] * p0[0] + out[0, 1] * p0[1] + out[0, 2] * p0[2]
    for k in range(3):
        out[k, 0] /= focal
        out[k, 1] /= focal
        out[k, 2] -= out[k, 0] * cx + out[k, 1] * cy
    return scale


@njit(cache=True, nogil=True)
def _box_depth(low, high, rotation, position, numbers, width, height):  # type: ignore[no-untyped-def]
    """(B,) depth of the nearest corner of each box, not below 0; -1 for a box wholly outside one side of the view."""
    focal, cx, cy, near, far = numbers
    depth = np.empty(len(low))
    for b in range(len(low)):
        outside = 63
        nearest = np.inf
        for corner in range(8):
            x = (high[b, 0] if corner & 1 else low[b, 0]) - position[0]
            y = (high[b, 1] if corner & 2 else low[b, 1]) - position[1]
            z = (high[b, 2] if corner & 4 else low[b, 2]) - position[2]
            across = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z
            down = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z
            ahead = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
            outside &= _outside(
                focal * across + cx * ahead, focal * down + cy * ahead, ahead, width, 0, height, near, far
            )
            nearest = min(nearest, ahead)
        depth[b] = -1.0 if outside else max(nearest, 0.0)
    return depth


@njit(cache=True, nogil=True, inline="always")
def _outside(column, row, depth, width, top, bottom, near, far):  # type: ignore[no-untyped-def]
    """Bits of the sides of the view that a point lies beyond; column and row are multiplied by depth."""
    code = 0
    if column < 0.0:
        code |= _LEFT
    if column > (width - 1) * depth:
        code |= _RIGHT
    if row < top * depth:
        code |= _ABOVE
    if row > (bottom - 1) * depth:
        code |= _BELOW
    if depth < near:
        code |= _NEAR
    if depth > far:
        code |= _FAR
    return code


@njit(cache=True, nogil=True)
def _draw_blocks(  # type: ignore[no-untyped-def]
    order, first_triangle, first_vertex, vertices, triangles, most, holes, rotation, position, numbers,
    width, top, bottom, inverse_depth, seen,
):  # fmt: skip
    focal, cx, cy, near, far = numbers
    camera = np.empty((most, 3))
    screen = np.empty((most, 3))
    codes = np.empty(most, np.int32)
    planes = np.zeros((3, 3))
    clipped = np.empty((4, 3))
    hole_entry = holes[0]
    for b in order:
        base = first_vertex[b]
        count = first_vertex[b + 1] - base
        for i in range(count):
            x = vertices[base + i, 0] - position[0]
            y = vertices[base + i, 1] - position[1]
            z = vertices[base + i, 2] - position[2]
            across = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z
            down = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z
            ahead = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
            codes[i] = _outside(
                focal * across + cx * ahead, focal * down + cy * ahead, ahead, width, top, bottom, near, far
            )
            camera[i, 0], camera[i, 1], camera[i, 2] = across, down, ahead
            if ahead >= near:
                inverse = 1.0 / ahead
                screen[i, 0] = focal * across * inverse + cx
                screen[i, 1] = focal * down * inverse + cy
                screen[i, 2] = inverse
        for t in range(first_triangle[b], first_triangle[b + 1]):
            i, j, k = triangles[t, 0] - base, triangles[t, 1] - base, triangles[t, 2] - base
            if codes[i] & codes[j] & codes[k]:
                continue
            entry = hole_entry[t]
            if entry >= 0:
                scale = screen_planes(camera[i], camera[j], camera[k], numbers, planes)
                if scale == 0.0:
                    continue
            if not (codes[i] | codes[j] | codes[k]) & _NEAR:
                _draw_triangle(
                    screen[i, 0], screen[i, 1], screen[i, 2], screen[j, 0], screen[j, 1], screen[j, 2],
                    screen[k, 0], screen[k, 1], screen[k, 2], t, entry, planes, holes,
                    width, top, bottom, inverse_depth, seen,
                )  # fmt: skip
                continue
            corners = _clip_near(camera[i], camera[j], camera[k], numbers, clipped)
            for corner in range(2, corners):
                _draw_triangle(
                    clipped[0, 0], clipped[0, 1], clipped[0, 2],
                    clipped[corner - 1, 0], clipped[corner - 1, 1], clipped[corner - 1, 2],
                    clipped[corner, 0], clipped[corner, 1], clipped[corner, 2], t, entry, planes, holes,
                    width, top, bottom, inverse_depth, seen,
                )  # fmt: skip


@njit(cache=True, nogil=True)
def _clip_near(p0, p1, p2, numbers, out):  # type: ignore[no-untyped-def]
    """Screen corners (up to 4, 3) of the part of a triangle beyond the near plane; returns how many.

    A cut edge is walked from its end beyond the plane, whichever triangle asks: neighbours get the same point.
    """
    focal, cx, cy, near = numbers[0], numbers[1], numbers[2], numbers[3]
    count = 0
    for edge in range(3):
        a = p0 if edge == 0 else (p1 if edge == 1 else p2)
        b = p1 if edge == 0 else (p2 if edge == 1 else p0)
        if a[2] >= near:
            out[count, 0] = focal * a[0] * (1.0 / a[2]) + cx
            out[count, 1] = focal * a[1] * (1.0 / a[2]) + cy
            out[count, 2] = 1.0 / a[2]
            count += 1
        if (a[2] >= near) != (b[2] >= near):
            beyond, before = (a, b) if a[2] >= near else (b, a)
            share = (near - beyond[2]) / (before[2] - beyond[2])
            out[count, 0] = focal * (beyond[0] + share * (before[0] - beyond[0])) * (1.0 / near) + cx
            out[count, 1] = focal * (beyond[1] + share * (before[1] - beyond[1])) * (1.0 / near) + cy
            out[count, 2] = 1.0 / near
            count += 1
    return count


@njit(cache=True, nogil=True)
def _draw_triangle(  # type: ignore[no-untyped-def]
    x0, y0, w0, x1, y1, w1, x2, y2, w2, name, entry, planes, holes, width, top, bottom, inverse_depth, seen
):  # fmt: skip
    """One triangle at columns x, rows y with inverse depths w: where it is nearest, its inverse depth and its name."""
    if y1 < y0:
        x0, y0, w0, x1, y1, w1 = x1, y1, w1, x0, y0, w0
    if y2 < y1:
        x1, y1, w1, x2, y2, w2 = x2, y2, w2, x1, y1, w1
        if y1 < y0:
            x0, y0, w0, x1, y1, w1 = x1, y1, w1, x0, y0, w0
    if not (y0 < bottom and y2 > top - 1 and min(x0, x1, x2) < width and max(x0, x1, x2) > -1):
        return
    first = max(math.ceil(y0), top)
    last = min(math.ceil(y2), bottom)
    if first >= last or math.ceil(min(x0, x1, x2)) >= math.ceil(max(x0, x1, x2)):
        return
    double_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if double_area == 0.0:
        return
    along = ((w1 - w0) * (y2 - y0) - (w2 - w0) * (y1 - y0)) / double_area
    down = ((x1 - x0) * (w2 - w0) - (x2 - x0) * (w1 - w0)) / double_area
    long_slope = (x2 - x0) / (y2 - y0)
    upper_slope = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
    lower_slope = (x2 - x1) / (y2 - y1) if y2 > y1 else 0.0
    bends_right = double_area > 0.0
    for row in range(first, last):
        on_long = x0 + (row - y0) * long_slope
        on_short = x0 + (row - y0) * upper_slope if row < y1 else x1 + (row - y1) * lower_slope
        begin, end = (on_long, on_short) if bends_right else (on_short, on_long)
        left = math.ceil(min(max(begin, 0.0), width))
        right = math.ceil(min(max(end, 0.0), width))
        if left >= right:
            continue
        depths, names = inverse_depth[row], seen[row]
        start = np.float32(w0 + along * (left - x0) + down * (row - y0))
        step = np.float32(along)
        if entry < 0:
            for column in range(left, right):
                w = start + step * np.float32(column - left)
                if w > depths[column]:
                    depths[column] = w
                    names[column] = name
        else:
            for column in range(left, right):
                w = start + step * np.float32(column - left)
                if w > depths[column] and _is_opaque(column, row, name, entry, planes, holes):
                    depths[column] = w
                    names[column] = name


@njit(cache=True, nogil=True)
def _is_opaque(column, row, name, entry, planes, holes):  # type: ignore[no-untyped-def]
    """Whether a cut-out's texture is opaque where the pixel's ray meets it, at the detail that the pixel resolves."""
    _, texel_uv, opacity, offset, width_log2, height_log2 = holes
    denominator = planes[0, 0] * column + planes[0, 1] * row + planes[0, 2]
    u = (planes[1, 0] * column + planes[1, 1] * row + planes[1, 2]) / denominator
    v = (planes[2, 0] * column + planes[2, 1] * row + planes[2, 2]) / denominator
    first, second = np.empty(2), np.empty(2)
    s_u = (planes[1, 0] - u * planes[0, 0]) / denominator, (planes[1, 1] - u * planes[0, 1]) / denominator
    s_v = (planes[2, 0] - v * planes[0, 0]) / denominator, (planes[2, 1] - v * planes[0, 1]) / denominator
    uv = texel_uv[name]
    for axis in range(2):
        one, two = uv[1, axis] - uv[0, axis], uv[2, axis] - uv[0, axis]
        first[axis] = one * s_u[0] + two * s_v[0]
        second[axis] = one * s_u[1] + two * s_v[1]
    x = uv[0, 0] + u * (uv[1, 0] - uv[0, 0]) + v * (uv[2, 0] - uv[0, 0])
    y = uv[0, 1] + u * (uv[1, 1] - uv[0, 1]) + v * (uv[2, 1] - uv[0, 1])
    area = abs(first[0] * second[1] - first[1] * second[0])
    level = 0
    smallest = max(width_log2[entry], height_log2[entry])
    while area > 2.0 and level < smallest:
        area *= 0.25
        level += 1
    width = max(width_log2[entry] - level, 0)
    height = max(height_log2[entry] - level, 0)
    column_texel = math.floor(x * 2.0 ** (width - width_log2[entry])) & ((1 << width) - 1)
    row_texel = math.floor(y * 2.0 ** (height - height_log2[entry])) & ((1 << height) - 1)
    return opacity[offset[entry, level] + (row_texel << width) + column_texel] >= 128
