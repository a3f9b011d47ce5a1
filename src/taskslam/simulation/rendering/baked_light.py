"""The light that falls on every triangle, worked out once: lights and surfaces of a world stand still.

Each side of a triangle has a grid of samples over its barycentric coordinates: its three corners, or more where the
triangle is large, so that a lamp makes its pool of light on a floor of two triangles. Lambert's law, no shadows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.simulation.rendering.shading import lambert, linear_of_srgb
from taskslam.simulation.rendering.texture_atlas import LUMINANCE
from taskslam.world import World

Floats = npt.NDArray[np.float32]

_STEP = 0.6  # metres between samples of large triangles
_FINEST = 64
_SAMPLES_AT_ONCE = 200_000
_SKY = np.array([0.36, 0.24, 0.9], np.float32) / np.float32(np.sqrt(0.36**2 + 0.24**2 + 0.9**2))


@dataclass(frozen=True)
class BakedLight:
    """Roots of linear light at samples of T triangles.

    cells: (T,) int32 n of each triangle's grid, whose (n + 1) (n + 2) / 2 samples begin at offset (T,) int64, v by v
    and within it u by u; values: (1 or 3, 2, S) float32 for grey or red, green and blue, for the side that the
    winding calls the front and for the back.
    """

    cells: npt.NDArray[np.int32]
    offset: npt.NDArray[np.int64]
    values: Floats


def baked_light(world: World, source: npt.NDArray[np.int32], color: bool) -> BakedLight:
    """Light on the triangles `source` (T,) of `world.visual`."""
    mesh = world.visual
    corners = mesh.corners()[source]
    cells = np.ones(len(source), np.int32)
    if any(light.type != "directional" for light in world.lights):
        longest = np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1, initial=0.0))
        cells = np.where(longest > 2 * _STEP, np.clip(np.ceil(longest / _STEP), 1, _FINEST), 1).astype(np.int32)
    counts = (cells + 1) * (cells + 2) // 2
    offset = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
    values = np.zeros((3 if color else 1, 2, int(offset[-1])), np.float32)
    normals = mesh.normals[source]
    glow = np.array([m.emissive for m in world.materials], np.float32).reshape(-1, 3)
    for n in np.unique(cells):
        rows = np.flatnonzero(cells == n)
        weights = _grid(int(n))
        at_once = max(1, _SAMPLES_AT_ONCE // len(weights))
        for begin in range(0, len(rows), at_once):
            some = rows[begin : begin + at_once]
            position = np.einsum("sk,tkd->tsd", weights, corners[some]).astype(np.float32)
            normal = _front_normals(corners[some], normals[some], weights)
            where = (offset[some][:, None] + np.arange(len(weights))).ravel()
            own = np.float32(0.5) * glow[mesh.material[source[some]]]
            for side, sign in enumerate((np.float32(1.0), np.float32(-1.0))):
                light = _falling(world, position.reshape(-1, 3), sign * normal.reshape(-1, 3))
                light += np.repeat(own, len(weights), axis=0)
                roots = np.sqrt(light if color else (light @ LUMINANCE)[:, None])
                values[:, side, where] = roots.T
    return BakedLight(cells, offset[:-1].copy(), values)


def _grid(n: int) -> Floats:
    """(S, 3) barycentric weights of a grid's samples."""
    j, i = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    inside = i + j <= n
    u, v = i[inside] / n, j[inside] / n
    return np.stack([1.0 - u - v, u, v], axis=1).astype(np.float32)


def _front_normals(corners: Floats, normals: Floats, weights: Floats) -> Floats:
    """(T, S, 3) unit shading normals on the side that the winding calls the front."""
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.einsum("sk,tkd->tsd", weights, normals)
    flat = np.abs(normal).max(axis=2) < 1e-6  # a mesh may come without shading normals
    normal[flat] = np.broadcast_to(face[:, None, :], normal.shape)[flat]
    normal[np.einsum("tsd,td->ts", normal, face) < 0.0] *= np.float32(-1.0)
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    return np.asarray(normal / np.maximum(length, 1e-12), dtype=np.float32)


def _falling(world: World, position: Floats, normal: Floats) -> Floats:
    """(N, 3) linear light at points with unit normals: ambient, a little more of it from above, and the lights."""
    ambient = np.asarray(world.ambient, np.float32) * np.float32(0.9)
    light = np.asarray(ambient * (np.float32(0.8) + np.float32(0.2) * (normal @ _SKY))[:, None], np.float32)
    for source in world.lights:
        light += lambert(source, position, normal)
    return light


def background_root(world: World, color: bool) -> Floats:
    """(1 or 3,) root of the linear light of the world's background."""
    linear = linear_of_srgb(np.array(world.background)).astype(np.float32)
    return np.sqrt(linear if color else (linear @ LUMINANCE)[None]).astype(np.float32)
