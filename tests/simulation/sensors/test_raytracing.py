"""Packets of rays against embreex's single ones, an independent way into the same library."""

from __future__ import annotations

import dataclasses
import resource

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore_scene import EmbreeScene

from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import World
from taskslam.world.loading import load_world


@pytest.fixture(scope="module")
def house() -> World:
    return load_world("house")


def rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    """From anywhere in the house and above it, in any direction, not of unit length."""
    draws = np.random.default_rng(count)
    origins = draws.uniform((-8, -5, 0.01), (8, 5, 3.5), (count, 3)).astype(np.float32)
    return origins, draws.standard_normal((count, 3)).astype(np.float32)


@pytest.mark.parametrize("count", [1, 7, 8, 9, 20_000])
def test_distances_are_those_of_single_rays_but_where_two_surfaces_coincide(house: World, count: int) -> None:
    origins, directions = rays(count)
    scene = EmbreeScene()
    mesh = EmbreeMesh(scene, np.ascontiguousarray(house.visual.corners(), np.float32))
    found = scene.run(origins, directions, output=1)
    single = np.where(found["primID"] < 0, np.inf, found["tfar"]).astype(np.float32)
    assert mesh is not None
    triangle, distance, uv = RayCaster(house.visual).hits(origins, directions)
    same = triangle == found["primID"]
    assert np.array_equal(single[same], distance[same])
    assert same.mean() > 0.98
    assert np.allclose(single, distance, rtol=3e-7)
    assert np.array_equal(triangle < 0, np.isinf(distance))
    met = triangle >= 0
    # The barycentric coordinates name the point that the distance does.
    corners = house.visual.corners()[triangle[met]].astype(float)
    u, v = uv[met, :1].astype(float), uv[met, 1:].astype(float)
    there = corners[:, 0] + u * (corners[:, 1] - corners[:, 0]) + v * (corners[:, 2] - corners[:, 0])
    along = origins[met] + distance[met, None].astype(float) * directions[met]
    assert np.abs(there - along).max(initial=0.0) < 1e-4


def test_no_rays_and_no_triangles(house: World) -> None:
    nothing = np.empty((0, 3), np.float32)
    assert len(RayCaster(house.visual).distances(nothing, nothing)) == 0
    visual = house.visual
    fields = {field.name: getattr(visual, field.name) for field in dataclasses.fields(visual)}
    per_triangle = {name: values[:0] for name, values in fields.items() if len(values) == len(visual)}
    empty = dataclasses.replace(visual, **per_triangle)
    assert len(empty) == 0
    assert np.isinf(RayCaster(empty).distances(*rays(9))).all()


def test_a_cast_scene_is_given_back(house: World) -> None:
    """Scenes are made and forgotten; memory is that of one."""

    def peak() -> int:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    RayCaster(house.visual)
    before = peak()
    for _ in range(40):
        RayCaster(house.visual)
    assert peak() - before < 100_000  # KiB; forty scenes kept would be ten times that
