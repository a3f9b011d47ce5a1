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

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.simulation.rendering.drawing_lanes import draw_lanes, span_lanes
from taskslam.simulation.rendering.lanes import LANES
from taskslam.simulation.rendering.projecting_lanes import CUT, UNSEEN, box_lanes, project_lanes, sort_out_lanes
from taskslam.simulation.rendering.triangle_blocks import TRIANGLES_PER_BLOCK, TriangleBlocks

_TILE = 16  # pixels
_REFRESH = 20  # blocks drawn before the first look at what has become hidden; later looks are rarer


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
        blocks.low,
        blocks.high,
        (cut_outs.entry, cut_outs.texel_uv, cut_outs.opacity, cut_outs.offset, cut_outs.width, cut_outs.height),
        R_camera_world,
        position,
        pinhole.numbers(),
        pinhole.width,
        rows[0],
        rows[1],
        inverse_depth.reshape(-1),
        triangle.reshape(-1),
    )


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def _box_depth(low, high, rotation, position, numbers, width, height):  # type: ignore[no-untyped-def]
    """(B,) depth of the nearest corner of each box, not below 0; -1 for a box wholly outside one side of the view."""
    depth = np.empty(len(low) + LANES)
    window = np.array([width - 1.0, 0.0, height - 1.0])
    for first in range(0, len(low), LANES):
        box_lanes(low, high, first, rotation, position, numbers, window, depth)
    return depth[: len(low)]


@njit(cache=True, nogil=True, error_model="numpy")
def _draw_blocks(  # type: ignore[no-untyped-def]
    order, first_triangle, first_vertex, vertices, triangles, most, low, high, holes, rotation, position, numbers,
    width, top, bottom, inverse_depth, seen,
):  # fmt: skip
    room = most + LANES
    camera, screen, codes = np.empty((3, room)), np.empty((3, room)), np.empty(room, np.int32)
    kind = np.empty(TRIANGLES_PER_BLOCK + LANES, np.int32)
    window = np.array([width - 1.0, float(top), bottom - 1.0])
    p = np.empty((3, 3))
    planes = np.zeros((3, 3))
    corner = np.empty((4, 3))
    spans = np.empty((2, bottom + LANES), np.int32)
    hole_entry = holes[0]
    farthest = np.zeros((-(-(bottom - top) // _TILE), -(-width // _TILE)), np.float32)
    drawn, refresh = 0, _REFRESH
    for b in order:
        if drawn >= refresh:
            _refresh(inverse_depth, width, top, bottom, farthest)
            refresh += drawn // 2 + _REFRESH
        if _is_hidden(low[b], high[b], rotation, position, numbers, width, top, bottom, farthest):
            continue
        drawn += 1
        base, begin, count = first_vertex[b], first_triangle[b], first_triangle[b + 1] - first_triangle[b]
        vertex_count = first_vertex[b + 1] - base
        project_lanes(vertices, base, vertex_count, rotation, position, numbers, window, camera, screen, codes)
        sort_out_lanes(triangles, begin, count, base, screen, codes, kind)
        for t in range(begin, begin + count):
            if kind[t - begin] == UNSEEN:
                continue
            holed = hole_entry[t] >= 0
            if holed or kind[t - begin] == CUT:
                for k in range(3):
                    p[k] = camera[:, triangles[t, k] - base]
            if kind[t - begin] == CUT:
                corners = _clip_near(p[0], p[1], p[2], numbers, corner)
            else:
                corners = 3
                for k in range(3):
                    corner[k] = screen[:, triangles[t, k] - base]
            if holed and screen_planes(p[0], p[1], p[2], numbers, planes) == 0.0:
                continue
            for last in range(2, corners):
                first_row, end_row, left_side, inverse, along, down = _spans(corner, last, width, top, bottom, spans)
                if first_row >= end_row:
                    continue
                step = np.float32(along)
                for row in range(first_row, end_row):
                    left, right = np.int64(spans[left_side, row]), np.int64(spans[1 - left_side, row])
                    start = np.float32(inverse + along * left + down * row)
                    line = row * width + left
                    if not holed:
                        if left < right:
                            draw_lanes(inverse_depth, seen, line, right - left, start, step, np.int32(t))
                        continue
                    for i in range(right - left):
                        w = start + step * np.float32(i)
                        pixel = np.uint64(line + i)  # unsigned: nothing to wrap round from the end
                        if w > inverse_depth[pixel] and _is_opaque(left + i, row, t, planes, holes):
                            inverse_depth[pixel] = w
                            seen[pixel] = t


@njit(cache=True, nogil=True, error_model="numpy")
def _spans(corner, last, width, top, bottom, spans):  # type: ignore[no-untyped-def]
    """Where each row enters and leaves the triangle of corners 0, last - 1 and last: see `span_lanes`.

    corner: (4, 3) column, row, inverse depth. Returns the first row and the one after the last, which of the two
    `spans` is on the left, and inverse depth as an affine function of the pixel: its value at (0, 0), and its change
    along a row and down a column.
    """
    x0, y0, w0 = corner[0, 0], corner[0, 1], corner[0, 2]
    x1, y1, w1 = corner[last - 1, 0], corner[last - 1, 1], corner[last - 1, 2]
    x2, y2, w2 = corner[last, 0], corner[last, 1], corner[last, 2]
    if y1 < y0:
        x0, y0, w0, x1, y1, w1 = x1, y1, w1, x0, y0, w0
    if y2 < y1:
        x1, y1, w1, x2, y2, w2 = x2, y2, w2, x1, y1, w1
        if y1 < y0:
            x0, y0, w0, x1, y1, w1 = x1, y1, w1, x0, y0, w0
    first = math.ceil(min(max(y0, top), bottom))
    end = math.ceil(min(max(y2, top), bottom))
    double_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if first >= end or double_area == 0.0:
        return 0, 0, 0, 0.0, 0.0, 0.0
    along = ((w1 - w0) * (y2 - y0) - (w2 - w0) * (y1 - y0)) / double_area
    down = ((x1 - x0) * (w2 - w0) - (x2 - x0) * (w1 - w0)) / double_area
    long_slope = (x2 - x0) / (y2 - y0)
    upper_slope = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
    lower_slope = (x2 - x1) / (y2 - y1) if y2 > y1 else 0.0
    span_lanes(spans, first, end, (y0, x0), long_slope, upper_slope, (y1, x1), lower_slope, float(width))
    return first, end, 0 if double_area > 0.0 else 1, w0 - along * x0 - down * y0, along, down


@njit(cache=True, nogil=True, error_model="numpy")
def _refresh(inverse_depth, width, top, bottom, farthest):  # type: ignore[no-untyped-def]
    """The smallest inverse depth in each tile of the band."""
    column_least = np.empty(width, np.float32)
    for tile_row in range(len(farthest)):
        column_least[:] = np.inf
        for row in range(top + tile_row * _TILE, min(top + (tile_row + 1) * _TILE, bottom)):
            line = inverse_depth[row * width : (row + 1) * width]
            for column in range(width):
                d = line[column]
                column_least[column] = d if d < column_least[column] else column_least[column]
        farthest[tile_row] = np.inf
        for column in range(width):
            farthest[tile_row, column // _TILE] = min(farthest[tile_row, column // _TILE], column_least[column])


@njit(cache=True, nogil=True, error_model="numpy")
def _is_hidden(low, high, rotation, position, numbers, width, top, bottom, farthest):  # type: ignore[no-untyped-def]
    """Whether a box lies behind what was drawn, in every tile that it may touch."""
    focal, cx, cy, near = numbers[0], numbers[1], numbers[2], numbers[3]
    left, right, above, below = np.inf, -np.inf, np.inf, -np.inf
    nearest = np.inf
    for corner in range(8):
        x = (high[0] if corner & 1 else low[0]) - position[0]
        y = (high[1] if corner & 2 else low[1]) - position[1]
        z = (high[2] if corner & 4 else low[2]) - position[2]
        ahead = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
        if ahead < near:
            return False
        nearest = min(nearest, ahead)
        column = focal * (rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z) / ahead + cx
        row = focal * (rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z) / ahead + cy
        left, right = min(left, column), max(right, column)
        above, below = min(above, row), max(below, row)
    first_column, last_column = math.floor(max(left - 1.0, 0.0)), math.floor(min(right + 1.0, width - 1.0))
    first_row, last_row = math.floor(max(above - 1.0, top)), math.floor(min(below + 1.0, bottom - 1.0))
    if first_column > last_column or first_row > last_row:
        return True
    limit = 1.00001 / nearest  # rounding of the drawn depths must not hide what lies on them
    for tile_row in range((first_row - top) // _TILE, (last_row - top) // _TILE + 1):
        for tile in range(first_column // _TILE, last_column // _TILE + 1):
            if farthest[tile_row, tile] < limit:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def _is_opaque(column, row, name, planes, holes):  # type: ignore[no-untyped-def]
    """Whether a cut-out's texture is opaque where the pixel's ray meets it, at the detail that the pixel resolves."""
    entries, texel_uv, opacity, offset, width_log2, height_log2 = holes
    entry = entries[name]
    denominator = planes[0, 0] * column + planes[0, 1] * row + planes[0, 2]
    u = (planes[1, 0] * column + planes[1, 1] * row + planes[1, 2]) / denominator
    v = (planes[2, 0] * column + planes[2, 1] * row + planes[2, 2]) / denominator
    u_across, u_down = (planes[1, 0] - u * planes[0, 0]) / denominator, (planes[1, 1] - u * planes[0, 1]) / denominator
    v_across, v_down = (planes[2, 0] - v * planes[0, 0]) / denominator, (planes[2, 1] - v * planes[0, 1]) / denominator
    x0, y0 = texel_uv[name, 0, 0], texel_uv[name, 0, 1]
    x1, y1 = texel_uv[name, 1, 0] - x0, texel_uv[name, 1, 1] - y0
    x2, y2 = texel_uv[name, 2, 0] - x0, texel_uv[name, 2, 1] - y0
    x, y = x0 + u * x1 + v * x2, y0 + u * y1 + v * y2
    area = abs(
        (x1 * u_across + x2 * v_across) * (y1 * u_down + y2 * v_down)
        - (y1 * u_across + y2 * v_across) * (x1 * u_down + x2 * v_down)
    )
    level = 0
    smallest = max(width_log2[entry], height_log2[entry])
    while area > 2.0 and level < smallest:
        area *= 0.25
        level += 1
    width = max(width_log2[entry] - level, 0)
    height = max(height_log2[entry] - level, 0)
    column_texel = math.floor(x / (1 << (width_log2[entry] - width))) & ((1 << width) - 1)
    row_texel = math.floor(y / (1 << (height_log2[entry] - height))) & ((1 << height) - 1)
    return opacity[offset[entry, level] + (row_texel << width) + row_texel + column_texel] >= 128
