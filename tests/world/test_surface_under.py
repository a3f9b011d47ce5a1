import numpy as np
import pytest

from taskslam.world import TriangleMesh, World
from taskslam.world.surface_under import surface_under


def world_of(*triangles) -> World:
    corners = np.array([corners for _, corners in triangles], np.float32)
    owners = np.array([owner for owner, _ in triangles], np.int32)
    count = len(corners)
    zeros = np.zeros((count, 3), np.float32)
    faces = np.arange(3 * count, dtype=np.int32).reshape(count, 3)
    uv, normals = np.zeros((count, 3, 2), np.float32), np.zeros((count, 3, 3), np.float32)
    mesh = TriangleMesh(corners.reshape(-1, 3), faces, zeros[:, 0].astype(np.int32), uv, normals, owners)
    return World("w", mesh, mesh, (), ("ground", "slab", "wall", "roof"))


FLAT = ([-5, -5], [5, -5], [0, 9])


def flat(z, turned=False):
    corners = [[x, y, z] for x, y in FLAT]
    return corners[::-1] if turned else corners


@pytest.mark.parametrize("turned", [False, True])
def test_the_highest_level_surface_below_a_height_is_found(turned):
    wall = [[0, -5, 0], [0, 5, 0], [0, 0, 3]]
    world = world_of((0, flat(0.0)), (1, flat(0.05, turned)), (2, wall), (3, flat(2.5)))
    found = surface_under(world, 0.1, 0.1, below=0.45)
    assert (found.model, found.height) == ("slab", pytest.approx(0.05))
    assert surface_under(world, 0.1, 0.1, below=0.04) is None
    assert surface_under(world, 40.0, 0.1, below=0.45) is None


def test_the_height_of_a_slope_is_that_at_the_point():
    slope = [[-1, -1, 0.1], [1, -1, 0.3], [0, 2, 0.2]]
    found = surface_under(world_of((1, slope)), 0.25, -0.25, below=1.0)
    assert found.height == pytest.approx(0.2 + 0.1 * 0.25)
