"""`Builder`: a world put together from flat panels, boxes, soft boxes, cylinders and leaves.

Texture coordinates are metres divided by the size that a material's texture covers; materials without a size
(pictures, rugs) fill their face once. Everything is placed in the frame of the current model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.world.builtin.noise import Dice
from taskslam.world.world import Light, Material, TriangleMesh, World

Point = tuple[float, float, float]
_CORNERS_UV = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
_SIDES = {"-x": (0, -1), "+x": (0, 1), "-y": (1, -1), "+y": (1, 1), "-z": (2, -1), "+z": (2, 1)}


@dataclass(frozen=True)
class Surface:
    """A material and how it lies: metres that its texture covers (None: once over the face), fibres along the face."""

    index: int
    extent: tuple[float, float] | None
    fibrous: bool = False


def unit_circle(sides: int) -> list[tuple[float, float]]:
    """Corners of a regular polygon, rounded so that libm's last bit does not matter."""
    angles = [2.0 * math.pi * k / sides for k in range(sides)]
    return [(round(math.cos(a), 9), round(math.sin(a), 9)) for a in angles]


class Builder:
    """Collects quads; `world` turns them into meshes. Solid quads are visual and collision geometry, others visual."""

    def __init__(self, seed: int) -> None:
        self.dice = Dice(seed)
        self._materials: list[Material] = []
        self._models: list[str] = []
        self._frame = (0.0, 0.0, 0.0, 1.0, 0.0)  # x, y, z, cos(yaw), sin(yaw)
        self._points: list[Point] = []
        self._uvs: list[tuple[float, float]] = []
        self._normals: list[Point] = []
        self._faces: list[tuple[int, int, int]] = []  # material, owner, solid

    def material(self, material: Material, extent: tuple[float, float] | None = None, fibrous: bool = False) -> Surface:
        """Register a material."""
        self._materials.append(material)
        return Surface(len(self._materials) - 1, extent, fibrous)

    @contextmanager
    def model(self, name: str, x: float = 0.0, y: float = 0.0, degrees: float = 0.0, z: float = 0.0) -> Iterator[None]:
        """Place what follows as one model at x, y, z, turned about z."""
        self._models.append(name)
        yaw = math.radians(degrees)
        self._frame = (x, y, z, round(math.cos(yaw), 9), round(math.sin(yaw), 9))
        yield
        self._frame = (0.0, 0.0, 0.0, 1.0, 0.0)

    def quad(
        self,
        corners: Sequence[Point],
        uv: Sequence[tuple[float, float]],
        surface: Surface,
        normals: Sequence[Point] | None = None,
        solid: bool = True,
    ) -> None:
        """Add four corners, counter-clockwise seen from outside; flat unless four normals are given."""
        if normals is None:
            normals = [_flat_normal(corners)] * 4
        x, y, z, c, s = self._frame
        for (px, py, pz), (nx, ny, nz) in zip(corners, normals, strict=True):
            self._points.append((x + c * px - s * py, y + s * px + c * py, z + pz))
            self._normals.append((c * nx - s * ny, s * nx + c * ny, nz))
        self._uvs.extend(uv)
        self._faces.append((surface.index, len(self._models) - 1, int(solid)))

    def panel(
        self,
        origin: Point,
        u: Point,
        v: Point,
        surface: Surface,
        solid: bool = True,
        offset: tuple[float, float] | None = None,
    ) -> None:
        """Add a rectangle from `origin` along the edges u and v (normal u x v), m; `offset` shifts the texture."""
        corners = [
            origin,
            _plus(origin, u),
            _plus(_plus(origin, u), v),
            _plus(origin, v),
        ]
        if surface.extent is None:
            self.quad(corners, _CORNERS_UV, surface, solid=solid)
            return
        du, dv = offset or (self.dice.uniform(), self.dice.uniform())
        turn = surface.fibrous and _length(v) > _length(u)
        a, b = (_length(v), _length(u)) if turn else (_length(u), _length(v))
        a, b = a / surface.extent[0], b / surface.extent[1]
        uv = [(du, dv), (du + a, dv), (du + a, dv + b), (du, dv + b)]
        if turn:
            uv = [uv[0], uv[3], uv[2], uv[1]]
        self.quad(corners, uv, surface, solid=solid)

    def box(
        self,
        low: Point,
        high: Point,
        surface: Surface,
        solid: bool = True,
        faces: dict[str, Surface] | None = None,
        skip: str = "",
    ) -> None:
        """Add a box; `faces` gives single sides (`+x`, `-y`, ...) another surface, `skip` lists sides to leave out."""
        for side, (axis, sign) in _SIDES.items():
            if side in skip.split():
                continue
            chosen = (faces or {}).get(side, surface)
            self.panel(*_side(low, high, axis, sign), chosen, solid=solid)

    def soft_box(self, low: Point, high: Point, surface: Surface, radius: float = 0.04, solid: bool = True) -> None:
        """Add a box with rounded edges (one chamfer, shaded smooth), as for cushions."""
        r = min(radius, *((h - b) / 2 * 0.98 for b, h in zip(low, high, strict=True)))
        extent = surface.extent or (1.0, 1.0)
        du, dv = self.dice.uniform(), self.dice.uniform()
        bounds = (low, high)

        def corner(signs: Point, axis: int) -> Point:
            """Corner of the face across `axis`, next to the box corner given by its signs."""
            p = [bounds[int(sign > 0)][i] - (0.0 if i == axis else sign * r) for i, sign in enumerate(signs)]
            return (p[0], p[1], p[2])

        def add(keys: list[tuple[Point, int]]) -> None:
            corners = [corner(signs, axis) for signs, axis in keys]
            normals = [_axis_normal(axis, signs[axis]) for signs, axis in keys]
            outward = _sum(normals)
            if _dot(_cross_of(corners), outward) < 0:
                corners, normals = corners[::-1], normals[::-1]
            major = max(range(3), key=lambda i: abs(outward[i]))
            a, b = [(1, 2), (0, 2), (0, 1)][major]
            uv = [(du + p[a] / extent[0], dv + p[b] / extent[1]) for p in corners]
            self.quad(corners, uv, surface, normals, solid)

        signs_of = [(-1.0, 1.0)] * 3
        for axis in range(3):
            a, b = [i for i in range(3) if i != axis]
            for s in signs_of[axis]:
                add([(_signs({axis: s, a: p, b: q}), axis) for p, q in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
            # the edges along this axis join the faces across a and b
            for sa in (-1.0, 1.0):
                for sb in (-1.0, 1.0):
                    ends = [_signs({axis: s, a: sa, b: sb}) for s in (-1.0, 1.0)]
                    add([(ends[0], a), (ends[1], a), (ends[1], b), (ends[0], b)])
        for sx in (-1.0, 1.0):
            for sy in (-1.0, 1.0):
                for sz in (-1.0, 1.0):
                    signs = (sx, sy, sz)
                    add([(signs, 0), (signs, 1), (signs, 2), (signs, 2)])

    def cylinder(
        self,
        centre: tuple[float, float],
        radius: float,
        bottom: float,
        top: float,
        surface: Surface,
        top_radius: float | None = None,
        sides: int = 16,
        solid: bool = True,
        closed: bool = True,
    ) -> None:
        """Add an upright cylinder or cone; `closed` adds both ends."""
        upper = radius if top_radius is None else top_radius
        circle = unit_circle(sides)
        extent = surface.extent or (2.0 * math.pi * radius, top - bottom)
        around = 2.0 * math.pi * max(radius, upper) / sides / extent[0]
        height = (top - bottom) / extent[1]
        slope = (radius - upper) / (top - bottom)
        scale = math.sqrt(1.0 + slope * slope)
        x, y = centre
        for k in range(sides):
            (c0, s0), (c1, s1) = circle[k], circle[(k + 1) % sides]
            n0, n1 = (c0 / scale, s0 / scale, slope / scale), (c1 / scale, s1 / scale, slope / scale)
            corners = [
                (x + radius * c0, y + radius * s0, bottom),
                (x + radius * c1, y + radius * s1, bottom),
                (x + upper * c1, y + upper * s1, top),
                (x + upper * c0, y + upper * s0, top),
            ]
            uv = [(k * around, 0.0), ((k + 1) * around, 0.0), ((k + 1) * around, height), (k * around, height)]
            self.quad(corners, uv, surface, [n0, n1, n1, n0], solid)
        if closed:
            self.disc(centre, upper, top, surface, sides=sides, solid=solid)
            self.disc(centre, radius, bottom, surface, sides=sides, solid=solid, up=False)

    def disc(
        self,
        centre: tuple[float, float],
        radius: float,
        z: float,
        surface: Surface,
        sides: int = 16,
        solid: bool = True,
        up: bool = True,
    ) -> None:
        """Add a horizontal disc."""
        extent = surface.extent or (2.0 * radius, 2.0 * radius)
        circle = unit_circle(sides)
        x, y = centre
        for k in range(0, sides, 2):
            rim = [circle[k], circle[(k + 1) % sides], circle[(k + 2) % sides]]
            flat = [(0.0, 0.0), *rim] if up else [(0.0, 0.0), *rim[::-1]]
            corners = [(x + radius * c, y + radius * s, z) for c, s in flat]
            uv = [(0.5 + radius * c / extent[0], 0.5 + radius * s / extent[1]) for c, s in flat]
            self.quad(corners, uv, surface, [(0.0, 0.0, 1.0 if up else -1.0)] * 4, solid)

    def world(self, name: str, lights: tuple[Light, ...], ambient: Point, background: Point) -> World:
        """Return everything collected so far, without the materials that nothing is made of."""
        points = np.array(self._points, np.float64).reshape(-1, 4, 3).astype(np.float32)
        uvs = np.array(self._uvs, np.float64).reshape(-1, 4, 2).astype(np.float32)
        normals = np.array(self._normals, np.float64).reshape(-1, 4, 3).astype(np.float32)
        faces = np.array(self._faces, np.int32).reshape(-1, 3)
        used, faces[:, 0] = np.unique(faces[:, 0], return_inverse=True)
        solid = faces[:, 2] == 1
        return World(
            name=name,
            visual=_mesh(points, uvs, normals, faces),
            collision=_mesh(points[solid], uvs[solid], normals[solid], faces[solid]),
            materials=tuple(self._materials[k] for k in used),
            models=tuple(self._models),
            lights=lights,
            ambient=ambient,
            background=background,
        )


def _mesh(
    points: npt.NDArray[np.float32],
    uvs: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    faces: npt.NDArray[np.int32],
) -> TriangleMesh:
    """Split quads into two triangles each and drop those without area."""
    count = len(points)
    order = np.array([0, 1, 2, 0, 2, 3])
    triangles = (np.arange(count)[:, None] * 4 + order).reshape(-1, 3).astype(np.int32)
    corners = points.reshape(-1, 3)[triangles]
    keep = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) > 1e-9
    return TriangleMesh(
        vertices=points.reshape(-1, 3),
        triangles=triangles[keep],
        material=np.repeat(faces[:, 0], 2)[keep],
        uv=uvs[:, order].reshape(-1, 3, 2)[keep],
        normals=normals[:, order].reshape(-1, 3, 3)[keep],
        owner=np.repeat(faces[:, 1], 2)[keep],
    )


def _side(low: Point, high: Point, axis: int, sign: int) -> tuple[Point, Point, Point]:
    """Origin and edge vectors of one side of a box, v upwards (or along y), u x v outwards."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    if axis == 0:
        return ((x1, y0, z0), (0, dy, 0), (0, 0, dz)) if sign > 0 else ((x0, y1, z0), (0, -dy, 0), (0, 0, dz))
    if axis == 1:
        return ((x1, y1, z0), (-dx, 0, 0), (0, 0, dz)) if sign > 0 else ((x0, y0, z0), (dx, 0, 0), (0, 0, dz))
    return ((x0, y0, z1), (dx, 0, 0), (0, dy, 0)) if sign > 0 else ((x0, y1, z0), (dx, 0, 0), (0, -dy, 0))


def _plus(p: Point, q: Point) -> Point:
    return (p[0] + q[0], p[1] + q[1], p[2] + q[2])


def _minus(p: Point, q: Point) -> Point:
    return (p[0] - q[0], p[1] - q[1], p[2] - q[2])


def _sum(points: Sequence[Point]) -> Point:
    return (sum(p[0] for p in points), sum(p[1] for p in points), sum(p[2] for p in points))


def _dot(p: Point, q: Point) -> float:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _cross(p: Point, q: Point) -> Point:
    return (p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])


def _cross_of(corners: Sequence[Point]) -> Point:
    return _cross(_minus(corners[1], corners[0]), _minus(corners[2], corners[0]))


def _length(p: Point) -> float:
    return math.sqrt(_dot(p, p))


def _flat_normal(corners: Sequence[Point]) -> Point:
    """Return the normal across both diagonals: of the plane, or the mean of both halves of a folded quad."""
    n = _cross(_minus(corners[2], corners[0]), _minus(corners[3], corners[1]))
    length = _length(n)
    return (n[0] / length, n[1] / length, n[2] / length)


def _axis_normal(axis: int, sign: float) -> Point:
    return (sign if axis == 0 else 0.0, sign if axis == 1 else 0.0, sign if axis == 2 else 0.0)


def _signs(by_axis: dict[int, float]) -> Point:
    return (float(by_axis[0]), float(by_axis[1]), float(by_axis[2]))
