"""SDF's primitive shapes as surfaces in the shape's own frame (metres, centred as SDF says).

Texture coordinates run from 0 to 1 over each face, as Gazebo's do; `Surface.metres` gives the same in metres.
"""

from __future__ import annotations

import math

import mapbox_earcut
import numpy as np

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray
from taskslam.world.gazebo.surfaces import Surface

_SEGMENTS = 32
_RINGS = 16


def _quad_grid(points: FloatArray, uv: FloatArray, metres: FloatArray, smooth: FloatArray | None) -> Surface:
    """Surface over an (R, C, 3) grid of points with (R, C, 2) coordinates; rows go up, columns turn to the left."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    triangles = np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], 1).reshape(-1, 3)
    normals = None if smooth is None else smooth.reshape(-1, 3)[triangles]
    flat_uv, flat_metres = uv.reshape(-1, 2)[triangles], metres.reshape(-1, 2)[triangles]
    return Surface(points.reshape(-1, 3), triangles, flat_uv, normals, metres=flat_metres)


def rectangle(center: FloatArray, right: FloatArray, up: FloatArray) -> Surface:
    """Flat rectangle; `right` and `up` are half its sides as vectors, and it faces right x up."""
    signs = np.array([[(-1, -1), (1, -1)], [(-1, 1), (1, 1)]], dtype=np.float64)
    points = center + signs[..., :1] * right + signs[..., 1:] * up
    uv = (signs + 1.0) / 2.0
    return _quad_grid(points, uv, uv * 2.0 * np.array([np.linalg.norm(right), np.linalg.norm(up)]), None)


def box(x: float, y: float, z: float) -> list[Surface]:
    """Box of full sides x, y, z about the origin."""
    hx, hy, hz = np.diag([x / 2.0, y / 2.0, z / 2.0])
    faces = [(hx, hy, hz), (-hx, -hy, hz), (hy, -hx, hz), (-hy, hx, hz), (hz, hy, -hx), (-hz, hy, hx)]
    return [rectangle(center, right, up) for center, right, up in faces]


def plane(normal: FloatArray, width: float, height: float) -> list[Surface]:
    """Rectangle of width along x and height along y before z is turned onto the normal."""
    length = float(np.linalg.norm(normal))
    if length == 0.0:
        raise WorldError("A <plane> has the normal 0 0 0; expected a direction.")
    n = normal / length
    helper = np.array([1.0, 0, 0]) if abs(n[0]) < 0.9 else np.array([0, 1.0, 0])
    x_axis = helper - n * (helper @ n)
    x_axis /= np.linalg.norm(x_axis)
    return [rectangle(np.zeros(3), x_axis * width / 2.0, np.cross(n, x_axis) * height / 2.0)]


def terrain(grey: FloatArray, size: list[float], position: FloatArray) -> Surface:
    """Heightmap about a position: (H, W) grey in 0..1, row 0 at +y; black lies at z = 0 and the lightest at size z.

    As Gazebo has it: heights are scaled by size z over the image's own maximum (gz-common's MaxElevation;
    gazebo-classic's HeightmapShape). Raises WorldError for an image of fewer than 2 x 2 pixels.
    """
    rows, columns = grey.shape
    if rows < 2 or columns < 2:
        raise WorldError(f"A <heightmap> of {columns} x {rows} pixels; expected 2 x 2 at least.")
    top = float(grey.max())
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, rows))
    z = grey[::-1] * (abs(size[2]) / top if top > 0.0 else abs(size[2]))
    points = np.stack([(u - 0.5) * size[0], (v - 0.5) * size[1], z], axis=-1) + position
    uv = np.stack([u, v], axis=-1)
    return _quad_grid(points, uv, uv * np.array(size[:2]), None)


def ellipsoid(rx: float, ry: float, rz: float) -> list[Surface]:
    """Ellipsoid (or sphere) of the given half-axes about the origin."""
    return [_lathe(np.linspace(-math.pi / 2, math.pi / 2, _RINGS + 1), (rx, ry, rz), 0.0)]


def capsule(radius: float, length: float) -> list[Surface]:
    """Capsule along z: a cylinder of the given length between two half spheres."""
    half = np.linspace(0.0, math.pi / 2, _RINGS // 2 + 1)
    return [_lathe(np.concatenate([-half[::-1], half]), (radius, radius, radius), length / 2.0)]


def _lathe(latitude: FloatArray, radii: tuple[float, float, float], stretch: float) -> Surface:
    """Ellipsoid by (L,) latitudes, its upper half moved up by `stretch` and its lower half down."""
    longitude = np.linspace(0.0, 2.0 * math.pi, _SEGMENTS + 1)
    la, lo = np.meshgrid(latitude, longitude, indexing="ij")
    unit = np.stack([np.cos(la) * np.cos(lo), np.cos(la) * np.sin(lo), np.sin(la)], axis=-1)
    upper = (np.arange(len(latitude)) >= len(latitude) / 2.0)[:, None, None]
    points = unit * np.array(radii) + np.where(upper, 1.0, -1.0) * np.array([0, 0, stretch])
    normals = unit / np.array(radii)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points[:, 0], axis=0), axis=1))])
    uv = np.stack(np.broadcast_arrays(longitude / (2.0 * math.pi), (along / along[-1])[:, None]), axis=-1)
    metres = uv * np.array([2.0 * math.pi * max(radii[:2]), along[-1]])
    return _quad_grid(points, uv, metres, normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def cylinder(radius: float, length: float, top_radius: float | None = None) -> list[Surface]:
    """Cylinder along z about the origin, or with `top_radius` 0 a cone whose base is at the bottom."""
    top = radius if top_radius is None else top_radius
    angle = np.linspace(0.0, 2.0 * math.pi, _SEGMENTS + 1)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    z = np.array([0, 0, length / 2.0])
    points = np.stack([ring * radius - z, ring * top + z])
    normals = ring * length + np.array([0, 0, radius - top])
    normals = np.stack([normals, normals]) / np.linalg.norm(normals, axis=-1)[None, :, None]
    uv = np.stack(np.broadcast_arrays(angle / (2.0 * math.pi), np.array([[0.0], [1.0]])), axis=-1)
    surfaces = [_quad_grid(points, uv, uv * np.array([2.0 * math.pi * radius, length]), normals)]
    for side, r in ((-1.0, radius), (1.0, top)):
        if r > 0.0:
            disc = np.stack([ring[:-1] * r, np.zeros_like(ring[:-1])])[:, :: int(side)] + side * z
            rim = np.arange(_SEGMENTS)
            triangles = np.stack([rim, np.roll(rim, -1), np.full(_SEGMENTS, _SEGMENTS)], axis=1)
            flat = disc.reshape(-1, 3)
            metres = flat[:, :2][triangles]
            surfaces.append(Surface(flat, triangles, metres / (2.0 * r) + 0.5, metres=metres))
    return surfaces


def extruded_polylines(contours: list[FloatArray], height: float) -> list[Surface]:
    """Prism from z = 0 to `height` over closed (N, 2) contours; a contour inside another is a hole in it (even-odd).

    Raises WorldError for a contour of fewer than three distinct points or without area.
    """
    rings = [_closed_ring(contour) for contour in contours]
    areas = [_signed_area(ring) for ring in rings]
    depth = [sum(_contains(other, ring[0]) for other in rings if other is not ring) for ring in rings]
    surfaces = []
    for outer, level in enumerate(depth):
        if level % 2 == 0:
            holes = [k for k, d in enumerate(depth) if d == level + 1 and _contains(rings[outer], rings[k][0])]
            members = [(outer, 1.0), *((k, -1.0) for k in holes)]
            loops = [rings[k] if areas[k] * sign > 0 else rings[k][::-1] for k, sign in members]
            surfaces += _prism(loops, height)
    return surfaces


def _prism(loops: list[FloatArray], height: float) -> list[Surface]:
    points = np.concatenate(loops)
    ends = np.cumsum([len(loop) for loop in loops]).astype(np.uint32)
    triangles = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3).astype(np.int64)
    corners = points[triangles]
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0] < 0.0
    triangles[clockwise] = triangles[clockwise, ::-1]
    lowest, extent = points.min(axis=0), np.ptp(points, axis=0)
    surfaces = []
    for z, winding in ((height, triangles), (0.0, triangles[:, ::-1])):
        vertices = np.column_stack([points, np.full(len(points), z)])
        metres = (points - lowest)[winding]
        surfaces.append(Surface(vertices, winding, metres / extent, metres=metres))
    for loop in loops:
        ring = np.vstack([loop, loop[:1]])
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))])
        wall = np.stack([np.column_stack([ring, np.full(len(ring), z)]) for z in (0.0, height)])
        uv = np.stack(np.broadcast_arrays(along / along[-1], np.array([[0.0], [1.0]])), axis=-1)
        surfaces.append(_quad_grid(wall, uv, uv * np.array([along[-1], height]), None))
    return surfaces


def _closed_ring(contour: FloatArray) -> FloatArray:
    distinct = np.any(contour != np.roll(contour, 1, axis=0), axis=1)
    ring = contour[distinct]
    if len(ring) < 3 or abs(_signed_area(ring)) == 0.0:
        raise WorldError("A <polyline> encloses no area; expected three or more distinct points.")
    return ring


def _signed_area(ring: FloatArray) -> float:
    following = np.roll(ring, -1, axis=0)
    return float(np.sum(ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]) / 2.0)


def _contains(ring: FloatArray, point: FloatArray) -> bool:
    """Even-odd rule: whether a ray in +x from the point crosses the ring an odd number of times."""
    a, b = ring, np.roll(ring, -1, axis=0)
    crosses = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[crosses], b[crosses]
    x = a[:, 0] + (point[1] - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return bool(np.count_nonzero(x > point[0]) % 2)
