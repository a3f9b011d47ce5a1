"""What colour a surface point has: mip-mapped texture, the world's lights by Lambert's law, ambient light.

Arrays in, arrays out; who casts the rays does not matter. Colours are linear light, not sRGB.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.world import Light, Material, World

Columns = npt.NDArray[np.float32]
Texels = npt.NDArray[np.uint8]

_HEADLIGHT = np.float32(0.15)
"""Share of light from the viewer's side: it keeps shapes apart where only ambient light falls."""


def linear_of_srgb(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Linear light of sRGB values in 0..1 (IEC 61966-2-1)."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def srgb_of_linear(values: Columns) -> Columns:
    """Values of sRGB in 0..1 for linear light, clipped to that range (IEC 61966-2-1)."""
    v = np.clip(values, 0.0, 1.0)
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** np.float32(1 / 2.4) - 0.055).astype(np.float32)


LINEAR_OF_BYTE = linear_of_srgb(np.arange(256) / 255.0).astype(np.float32)
_SRGB = (srgb_of_linear(np.linspace(0.0, 1.0, 4096, dtype=np.float32)) * 255.0 + 0.5).astype(np.uint8)


@dataclass(frozen=True)
class SurfacePoints:
    """N visible points. triangle: (N,) index into `World.visual`; barycentric: (N, 2) u, v; position: (N, 3) m.

    view: (N, 3) unit direction of the ray that sees it; footprint: (N,) width in metres of what one ray stands for.
    """

    triangle: npt.NDArray[np.int32]
    barycentric: Columns
    position: Columns
    view: Columns
    footprint: Columns

    def at(self, rows: npt.NDArray[np.int64]) -> SurfacePoints:
        """The points of some rows."""
        return SurfacePoints(
            self.triangle[rows], self.barycentric[rows], self.position[rows], self.view[rows], self.footprint[rows]
        )


class Shader:
    """Colours of points on one world's visual surfaces."""

    def __init__(self, world: World) -> None:
        self._world = world
        mesh = world.visual
        corners = mesh.corners()
        self._face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._area = np.linalg.norm(self._face, axis=1) / 2.0
        uv = mesh.uv
        first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        self._uv_area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2.0
        self._pyramids: dict[int, list[Texels]] = {}
        self._may_be_clear = np.array(
            [m.diffuse[3] < 0.5 or (m.texture is not None and m.texture.shape[2] == 4) for m in world.materials], bool
        )

    def see_through(self, points: SurfacePoints) -> npt.NDArray[np.bool_]:
        """(N,) whether a point is transparent rather than opaque, so that a ray should go on."""
        candidates = np.flatnonzero(self._may_be_clear[self._world.visual.material[points.triangle]])
        out = np.zeros(len(points.triangle), bool)
        if len(candidates):
            out[candidates] = self._albedo(points.at(candidates))[:, 3] < 0.5
        return out

    def facing_normals(self, points: SurfacePoints) -> Columns:
        """(N, 3) unit shading normals, turned towards the viewer where a surface is seen from behind."""
        weights = _weights(points.barycentric)
        normal = np.einsum("nk,nkd->nd", weights, self._world.visual.normals[points.triangle])
        face = self._face[points.triangle]
        flat = np.abs(normal).max(axis=1) < 1e-6  # a mesh may come without shading normals
        normal[flat] = face[flat]
        behind = np.einsum("nd,nd->n", face, points.view) > 0.0
        # a shading normal counts as lying on its triangle's front, whichever way the exporter wound it
        agrees = np.einsum("nd,nd->n", face, normal) >= 0.0
        normal[behind == agrees] *= -1.0
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return np.asarray(normal / np.maximum(length, 1e-12), dtype=np.float32)

    def radiance(self, points: SurfacePoints, normal: Columns, openness: Columns) -> Columns:
        """(N, 3) linear colour of the points.

        normal: (N, 3) from `facing_normals`; openness: (N,) share of the ambient light that reaches each point.
        """
        light = np.zeros((len(normal), 3), np.float32)
        light += np.asarray(self._world.ambient, np.float32) * np.float32(0.8)
        light += _HEADLIGHT * np.abs(np.einsum("nd,nd->n", normal, points.view))[:, None]
        light *= openness[:, None]
        for source in self._world.lights:
            light += lambert(source, points.position, normal)
        albedo = self._albedo(points)[:, :3]
        glow = np.array([m.emissive for m in self._world.materials], np.float32).reshape(-1, 3)
        material = self._world.visual.material[points.triangle]
        return np.asarray(albedo * (light + np.float32(0.5) * glow[material]), dtype=np.float32)

    def _albedo(self, points: SurfacePoints) -> Columns:
        """(N, 4) linear diffuse colour and opacity."""
        mesh = self._world.visual
        material = mesh.material[points.triangle]
        out = np.ones((len(material), 4), np.float32)
        for index in np.unique(material):
            look = self._world.materials[index]
            rows = np.flatnonzero(material == index)
            r, g, b, a = look.diffuse
            tint = np.append(linear_of_srgb(np.array([r, g, b])), a).astype(np.float32)
            if look.texture is None:
                out[rows] = tint
            else:
                out[rows] = self._sample(look, points, rows) * tint
        return out

    def _sample(self, look: Material, points: SurfacePoints, rows: npt.NDArray[np.int64]) -> Columns:
        assert look.texture is not None
        if id(look.texture) not in self._pyramids:
            self._pyramids[id(look.texture)] = _pyramid(look.texture)
        pyramid = self._pyramids[id(look.texture)]
        triangle = points.triangle[rows]
        scale = np.asarray(look.texture_scale, np.float32)
        uv = np.einsum("nk,nkd->nd", _weights(points.barycentric[rows]), self._world.visual.uv[triangle]) * scale
        height, width = look.texture.shape[:2]
        texels = self._uv_area[triangle] * abs(float(scale[0] * scale[1])) * (height * width)
        density = np.sqrt(texels / np.maximum(self._area[triangle], 1e-12))
        slant = np.abs(np.einsum("nd,nd->n", self._face[triangle], points.view[rows]))
        slant = np.clip(slant / np.maximum(2.0 * self._area[triangle], 1e-12), 0.05, 1.0)
        # A slanted footprint is long and narrow; the geometric mean of its sides trades blur for shimmer.
        spread = points.footprint[rows] / np.sqrt(slant) * density
        level = np.clip(np.rint(np.log2(np.maximum(spread, 1e-6))), 0, len(pyramid) - 1).astype(int)
        out = np.empty((len(rows), 4), np.float32)
        for k in np.unique(level):
            chosen = level == k
            out[chosen] = _bilinear(pyramid[k], uv[chosen])
        return out


def _weights(barycentric: Columns) -> Columns:
    u, v = barycentric[:, 0], barycentric[:, 1]
    return np.stack([1.0 - u - v, u, v], axis=1)


def _pyramid(texture: Texels) -> list[Texels]:
    """Mip levels (h, w, 3 or 4) uint8 sRGB, down to one texel on the shorter side; averaged in linear light."""
    levels = [texture]
    while min(levels[-1].shape[:2]) > 1:
        above = levels[-1]
        rows, columns = above.shape[0] // 2, above.shape[1] // 2
        quads = [above[i : rows * 2 : 2, j : columns * 2 : 2] for i in (0, 1) for j in (0, 1)]
        level = np.empty((rows, columns, above.shape[2]), np.uint8)
        mean = sum(LINEAR_OF_BYTE[quad[..., :3]] for quad in quads) / np.float32(4.0)
        level[..., :3] = _SRGB[(mean * (len(_SRGB) - 1) + 0.5).astype(np.int32)]
        level[..., 3:] = sum(quad[..., 3:].astype(np.uint16) for quad in quads) // 4
        levels.append(level)
    return levels


def _bilinear(level: Texels, uv: Columns) -> Columns:
    """(N, 4) linear colour and opacity of a repeating texture at (N, 2) coordinates; v runs up, rows run down."""
    height, width = level.shape[:2]
    x = (uv[:, 0] % 1.0) * width - 0.5
    y = (1.0 - uv[:, 1] % 1.0) * height - 0.5
    x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = (x - x0).astype(np.float32)[:, None], (y - y0).astype(np.float32)[:, None]
    left, right, top, bottom = x0 % width, (x0 + 1) % width, y0 % height, (y0 + 1) % height
    upper = _texels(level, top, left) * (1 - fx) + _texels(level, top, right) * fx
    lower = _texels(level, bottom, left) * (1 - fx) + _texels(level, bottom, right) * fx
    return np.asarray(upper * (1 - fy) + lower * fy)


def _texels(level: Texels, row: npt.NDArray[np.int64], column: npt.NDArray[np.int64]) -> Columns:
    values = level[row, column]
    out = np.ones((len(values), 4), np.float32)
    out[:, :3] = LINEAR_OF_BYTE[values[:, :3]]
    if values.shape[1] == 4:
        out[:, 3] = values[:, 3] / np.float32(255.0)
    return out


def lambert(light: Light, position: Columns, normal: Columns) -> Columns:
    """(N, 3) light that falls on each point: cosine law, SDF's attenuation, no shadows."""
    direction = (light.pose[:3, :3] @ np.asarray(light.direction)).astype(np.float32)
    direction /= max(float(np.linalg.norm(direction)), 1e-12)
    colour = linear_of_srgb(np.clip(light.diffuse, 0.0, 1.0)).astype(np.float32) * np.float32(max(*light.diffuse, 1.0))
    place = light.pose[:3, 3].astype(np.float32)
    fade = np.array([*light.attenuation, light.attenuation_range], np.float32)
    kind = ("directional", "point", "spot").index(light.type)
    falling: Columns = _lambert(kind, position, normal, place, direction, fade, np.float32(math.cos(0.6)), colour)
    return falling


@njit(cache=True)
def _lambert(kind, position, normal, place, direction, fade, edge, colour):  # type: ignore[no-untyped-def]
    """Of a directional light (0), a point (1) or a spot (2)."""
    out = np.zeros((len(position), 3), np.float32)
    zero, one = np.float32(0.0), np.float32(1.0)
    for i in range(len(position)):
        n = normal[i]
        if kind == 0:
            strength = -(n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2])
        else:
            x, y, z = place[0] - position[i, 0], place[1] - position[i, 1], place[2] - position[i, 2]
            distance = np.sqrt(x * x + y * y + z * z)
            if distance > fade[3]:
                continue
            nearest = max(distance, np.float32(1e-6))
            x, y, z = x / nearest, y / nearest, z / nearest
            strength = x * n[0] + y * n[1] + z * n[2]
            strength /= max(fade[0] + fade[1] * distance + fade[2] * distance * distance, np.float32(0.25))
            if kind == 2:
                within = (-(x * direction[0] + y * direction[1] + z * direction[2]) - edge) * np.float32(8.0)
                strength *= min(max(within, zero), one)
        for channel in range(3):
            out[i, channel] = max(strength, zero) * colour[channel]
    return out
