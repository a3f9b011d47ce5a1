"""A suspended ceiling for worlds that have none, so that a camera looking up does not see the sky."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taskslam.world import Material, TriangleMesh, World
from taskslam.world.builtin.noise import Dice, NoiseBank
from taskslam.world.builtin.textures import tiles

_TILES = 2.4  # m that the texture covers: four tiles of 0.6 m


def with_ceiling(world: World, height: float) -> World:
    """The same world with a visual ceiling of white tiles at `height`, m, over all of it."""
    (x0, y0, _), (x1, y1, _) = world.bounds()
    picture = tiles(NoiseBank(5), Dice(5), [(238, 238, 234)], (120, 122, 122), count=4, spread=0.05, wear=0.08)
    look = Material("ceiling tiles", (1.0, 1.0, 1.0, 1.0), picture, emissive=(0.26, 0.26, 0.26))
    mesh = world.visual
    corners = np.array([[x0, y1, height], [x1, y1, height], [x1, y0, height], [x0, y0, height]], np.float32)
    uv = ((corners[:, :2] - corners[0, :2]) / _TILES).astype(np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    lid = TriangleMesh(
        np.concatenate([mesh.vertices, corners]),
        np.concatenate([mesh.triangles, faces + len(mesh.vertices)]),
        np.concatenate([mesh.material, np.full(2, len(world.materials), np.int32)]),
        np.concatenate([mesh.uv, uv[faces]]),
        np.concatenate([mesh.normals, np.tile(np.array([0, 0, -1], np.float32), (2, 3, 1))]),
        np.concatenate([mesh.owner, np.full(2, len(world.models), np.int32)]),
    )
    return replace(world, visual=lid, materials=(*world.materials, look), models=(*world.models, "ceiling"))
