"""A world made ready for rendering: its triangles in blocks, its textures in one atlas, its light baked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.simulation.rendering.baked_light import BakedLight, background_root, baked_light
from taskslam.simulation.rendering.texture_atlas import TextureAtlas, texture_atlas
from taskslam.simulation.rendering.triangle_blocks import TriangleBlocks, triangle_blocks
from taskslam.world import TriangleMesh, World


@dataclass(frozen=True)
class PreparedWorld:
    """T triangles in the order of `blocks`.

    entry: (T,) int32 texture of each; texel_uv: (T, 3, 2) float32 corner coordinates in texels, y down; background:
    (1 or 3,) float32 root of linear light where nothing is seen.
    """

    blocks: TriangleBlocks
    atlas: TextureAtlas
    light: BakedLight
    entry: npt.NDArray[np.int32]
    texel_uv: npt.NDArray[np.float32]
    background: npt.NDArray[np.float32]


def prepare(world: World, color: bool) -> PreparedWorld:
    """All that does not depend on where a camera stands, grey or in colour."""
    mesh = world.visual
    corners = mesh.corners()
    finite = np.isfinite(corners).all(axis=(1, 2))
    used = np.zeros(len(world.materials), bool)
    used[np.unique(mesh.material[finite])] = True
    atlas = texture_atlas(world.materials, used, color)
    entry = atlas.entry[mesh.material]
    blocks = triangle_blocks(corners, np.flatnonzero(finite & (entry >= 0)))
    entry = entry[blocks.source]
    texel_uv = _texel_uv(world, mesh, blocks.source, atlas, entry)
    return PreparedWorld(
        blocks, atlas, baked_light(world, blocks.source, color), entry, texel_uv, background_root(world, color)
    )


def _texel_uv(
    world: World, mesh: TriangleMesh, source: npt.NDArray[np.int32], atlas: TextureAtlas, entry: npt.NDArray[np.int32]
) -> npt.NDArray[np.float32]:
    """Whole repeats are taken off to keep them precise."""
    scale = np.array([m.texture_scale for m in world.materials], np.float64).reshape(-1, 2)[mesh.material[source]]
    uv = mesh.uv[source].astype(np.float64) * scale[:, None, :]
    uv[~np.isfinite(uv).all(axis=(1, 2))] = 0.0
    uv[..., 1] = 1.0 - uv[..., 1]
    uv -= np.floor(uv.min(axis=1, keepdims=True))
    size = np.stack([atlas.width[entry], atlas.height[entry]], axis=1)
    return (uv * 2.0 ** size[:, None, :]).astype(np.float32)
