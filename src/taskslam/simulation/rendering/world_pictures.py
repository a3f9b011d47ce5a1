"""Pictures of a world for people: from above with the ceiling cut away, and in perspective.

Not a sensor: the exposure suits the picture, edges are smoothed, and no camera's noise is modelled. Rays by Embree,
colours by `shading`, nine rays per pixel averaged.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.geometry import SE2
from taskslam.simulation.rendering.shading import Columns, Shader, SurfacePoints, linear_of_srgb, srgb_of_linear
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import World

Image = npt.NDArray[np.uint8]

_SAMPLES = 3
_RAYS_AT_ONCE = 1_000_000
_LAYERS = 6
_OCCLUSION_REACH = 0.8
_THICKEST_SOLID = 2.0
_PAPER, _CUT = (0.93, 0.93, 0.92), (0.16, 0.17, 0.19)

Rays = Callable[[Columns, Columns], tuple[Columns, Columns]]


@dataclass(frozen=True)
class Extent:
    """A rectangle in the world's x and y, metres."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float


def content_extent(world: World, margin: float = 0.3) -> Extent:
    """The rectangle around what stands up in a world; ground planes and carpets do not widen it."""
    mesh = world.visual
    corners = mesh.corners()
    low, high = corners.min(axis=1), corners.max(axis=1)
    lowest = np.full((len(world.models), 3), np.inf, np.float32)
    highest = np.full((len(world.models), 3), -np.inf, np.float32)
    np.minimum.at(lowest, mesh.owner, low)
    np.maximum.at(highest, mesh.owner, high)
    stands = highest[:, 2] - lowest[:, 2] > 0.3
    if not stands.any():
        stands = np.isfinite(lowest[:, 0])
    x_min, y_min = lowest[stands, :2].min(axis=0) - margin
    x_max, y_max = highest[stands, :2].max(axis=0) + margin
    return Extent(float(x_min), float(x_max), float(y_min), float(y_max))


def top_down(world: World, size_px: int = 1200, cut_height: float = 2.0, extent: Extent | None = None) -> Image:
    """(H, W, 3) uint8 sRGB picture from straight above, x to the right and y up; the longer side has `size_px` pixels.

    Everything above `cut_height` (m) is cut away, and what is cut through is painted dark. extent: by default what
    stands in the world (`content_extent`).
    """
    area = extent if extent is not None else content_extent(world)
    step = max(area.x_max - area.x_min, area.y_max - area.y_min) / size_px
    width = max(1, round((area.x_max - area.x_min) / step))
    height = max(1, round((area.y_max - area.y_min) / step))

    def rays(column: Columns, row: Columns) -> tuple[Columns, Columns]:
        origin = np.stack(
            [area.x_min + column * step, area.y_max - row * step, np.full_like(column, cut_height)], axis=1
        )
        return origin.astype(np.float32), np.tile(np.array([0, 0, -1], np.float32), (len(column), 1))

    return _Painter(world, _PAPER, cut=True).paint(rays, width, height, lambda distance: np.full_like(distance, step))


def perspective(
    world: World,
    pose: SE2,
    height: float = 1.2,
    hfov: float = math.radians(75.0),
    size: tuple[int, int] = (1280, 720),
    pitch: float = 0.0,
) -> Image:
    """(H, W, 3) uint8 sRGB picture by a pinhole at (x, y, height) looking along theta.

    hfov: horizontal field of view, rad; size: width and height, px; pitch: rad, positive looks down.
    """
    width, rows = size
    focal = width / 2.0 / math.tan(hfov / 2.0)
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    cp, sp = math.cos(pitch), math.sin(pitch)
    forward = np.array([c * cp, s * cp, -sp])
    right = np.array([s, -c, 0.0])
    down = np.array([-c * sp, -s * sp, -cp])

    def rays(column: Columns, row: Columns) -> tuple[Columns, Columns]:
        x = (column.astype(np.float64) - width / 2.0) / focal
        y = (row.astype(np.float64) - rows / 2.0) / focal
        direction = forward + x[:, None] * right + y[:, None] * down
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        origin = np.tile(np.array([pose.x, pose.y, height], np.float32), (len(column), 1))
        return origin, direction.astype(np.float32)

    background = (world.background[0], world.background[1], world.background[2])
    return _Painter(world, background).paint(rays, width, rows, lambda distance: distance / focal)


class _Painter:
    """Casts rays, several per pixel, and averages what they see."""

    def __init__(self, world: World, background: tuple[float, float, float], cut: bool = False) -> None:
        self._caster = RayCaster(world.visual)
        self._shader = Shader(world)
        self._normals = np.cross(*np.moveaxis(np.diff(world.visual.corners(), axis=1), 1, 0))
        self._background = background
        self._cut = cut

    def paint(self, rays: Rays, width: int, height: int, footprint: Callable[[Columns], Columns]) -> Image:
        linear = np.zeros((height, width, 3), np.float32)
        seen = np.zeros((height, width), np.float32)
        cut = np.zeros((height, width), np.float32)
        rows_at_once = max(1, _RAYS_AT_ONCE // (width * _SAMPLES**2))
        columns = np.arange(width, dtype=np.float32)
        offsets = (np.arange(_SAMPLES, dtype=np.float32) + 0.5) / _SAMPLES
        for top in range(0, height, rows_at_once):
            rows = np.arange(top, min(top + rows_at_once, height), dtype=np.float32)
            grid = np.meshgrid(rows, columns, offsets, offsets, indexing="ij")
            row, column, dy, dx = (axis.ravel().astype(np.float32) for axis in grid)
            origin, direction = rays(column + dx, row + dy)
            colour, hit, solid = self._trace(origin, direction, footprint)
            band = slice(top, top + len(rows))
            shape = (len(rows), width, _SAMPLES**2)
            linear[band] = colour.reshape(*shape, 3).mean(axis=2)
            seen[band] = hit.reshape(shape).mean(axis=2)
            cut[band] = solid.reshape(shape).mean(axis=2)
        return self._develop(linear, seen, cut)

    def _trace(
        self, origin: Columns, direction: Columns, footprint: Callable[[Columns], Columns]
    ) -> tuple[Columns, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        """Linear colour (N, 3) that each ray sees, whether it sees anything, and whether it starts in a solid."""
        count = len(origin)
        colour, hit = np.zeros((count, 3), np.float32), np.zeros(count, bool)
        solid = self._inside_solid(origin) if self._cut else np.zeros(count, bool)
        going = np.flatnonzero(~solid)
        travelled = np.zeros(count, np.float32)
        for _ in range(_LAYERS):
            if len(going) == 0:
                break
            start = np.ascontiguousarray(origin[going] + travelled[going, None] * direction[going])
            triangle, distance, barycentric = self._caster.hits(start, np.ascontiguousarray(direction[going]))
            found = triangle >= 0
            going, distance = going[found], distance[found] + travelled[going[found]]
            position = origin[going] + distance[:, None] * direction[going]
            width = (footprint(distance) / _SAMPLES).astype(np.float32)
            points = SurfacePoints(triangle[found], barycentric[found], position, direction[going], width)
            through = self._shader.see_through(points)
            opaque = ~through
            kept = points.at(np.flatnonzero(opaque))
            normal = self._shader.facing_normals(kept)
            openness = self._openness(kept.position, normal, going[opaque] % _SAMPLES**2)
            colour[going[opaque]] = self._shader.radiance(kept, normal, openness)
            hit[going[opaque]] = True
            travelled[going] = distance + np.float32(1e-3)
            going = going[through]
        return colour, hit, solid

    def _openness(self, position: Columns, normal: Columns, sample: npt.NDArray[np.int64]) -> Columns:
        """(N,) share of ambient light that reaches a point (ambient occlusion).

        One ray a point, in a direction that depends on which of its pixel's samples the point is: the average over the
        pixel is then one over nine directions spread by the cosine law.
        """
        number = np.arange(_SAMPLES**2)
        lift = np.sqrt((number + 0.5) / _SAMPLES**2).astype(np.float32)
        angle = number * (math.pi * (3.0 - math.sqrt(5.0)))  # the golden angle spreads few directions evenly
        around = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.sqrt(1.0 - lift**2)[:, None]
        along_x, along_y = _tangents(normal)
        turn = around.astype(np.float32)[sample]
        direction = lift[sample, None] * normal + turn[:, :1] * along_x + turn[:, 1:] * along_y
        start = np.ascontiguousarray(position + np.float32(2e-3) * normal)
        distance = self._caster.distances(start, np.ascontiguousarray(direction))
        return np.asarray(0.3 + 0.7 * np.minimum(distance / _OCCLUSION_REACH, 1.0), dtype=np.float32)

    def _inside_solid(self, origin: Columns) -> npt.NDArray[np.bool_]:
        """(N,) whether a point lies inside something solid that the cut passes through.

        Above it and to two opposite sides it must see surfaces from behind, the two sides within the thickness of
        furniture; one pair of sides is enough because walls reach into one another at corners.
        """
        inside = np.zeros(len(origin), bool)
        below_something = np.flatnonzero(np.isfinite(self._exit(origin, (0, 0, 1))))
        start = np.ascontiguousarray(origin[below_something])
        for axis in ((1, 0, 0), (0, 1, 0)):
            opposite = (-axis[0], -axis[1], 0)
            thickness = self._exit(start, axis) + self._exit(start, opposite)
            inside[below_something[thickness < _THICKEST_SOLID]] = True
        return inside

    def _exit(self, origin: Columns, direction: tuple[int, int, int]) -> Columns:
        """(N,) distance to the first surface in a direction if it is seen from behind, else infinity."""
        d = np.array(direction, np.float32)
        triangle, distance, _ = self._caster.hits(origin, np.tile(d, (len(origin), 1)))
        return np.where((triangle >= 0) & (self._normals[triangle] @ d > 0.0), distance, np.inf).astype(np.float32)

    def _develop(self, linear: Columns, seen: Columns, cut: Columns) -> Image:
        """Expose so that the brightest hundredth of the picture stays below white; add background and cut."""
        strongest = linear.max(axis=2)[seen > 0.99]  # of the three channels: a red wall must not turn orange
        bright = float(np.percentile(strongest, 99.0)) if len(strongest) else 1.0
        middle = float(np.median(strongest)) if len(strongest) else 1.0
        exposure = min(0.9 / max(bright, 1e-6), 0.4 / max(middle, 1e-6))
        out = _shoulder(linear * np.float32(exposure))
        paper = linear_of_srgb(np.array(self._background)).astype(np.float32)
        ink = linear_of_srgb(np.array(_CUT)).astype(np.float32)
        out += np.clip(1.0 - seen - cut, 0.0, 1.0)[..., None] * paper + cut[..., None] * ink
        return (srgb_of_linear(out) * 255.0 + 0.5).astype(np.uint8)


def _tangents(normal: Columns) -> tuple[Columns, Columns]:
    """Two (N, 3) unit vectors across each unit normal and across one another."""
    x, y, z = normal.T
    zero = np.zeros_like(x)
    steep = np.abs(x) < 0.9
    first = np.where(steep[:, None], np.stack([zero, z, -y], axis=1), np.stack([-z, zero, x], axis=1))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    a, b, c = first.T
    return first, np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=1)


def _shoulder(linear: Columns) -> Columns:
    """Linear up to 0.7 and then bending towards 1, so that highlights keep their drawing."""
    knee = np.float32(0.7)
    over = np.maximum(linear - knee, 0.0) / (1.0 - knee)
    return np.where(linear > knee, knee + (1.0 - knee) * (1.0 - np.exp(-over)), linear).astype(np.float32)
