from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.world import TriangleMesh
from taskslam.world.slicing import slab_polygons


def mesh_of(corners) -> TriangleMesh:
    corners = np.asarray(corners, np.float32).reshape(-1, 3, 3)
    count = len(corners)
    return TriangleMesh(
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(count, 3),
        material=np.zeros(count, np.int32),
        uv=np.zeros((count, 3, 2), np.float32),
        normals=np.zeros((count, 3, 3), np.float32),
        owner=np.zeros(count, np.int32),
    )


def area(polygon) -> float:
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def polygons_of(mesh, low, high):
    points, offsets = slab_polygons(mesh, low, high)
    assert points.dtype == np.float64
    assert offsets.dtype == np.int64
    return [points[a:b] for a, b in pairwise(offsets)]


def test_a_horizontal_triangle_inside_the_slab_is_kept_whole():
    (polygon,) = polygons_of(mesh_of([[0, 0, 0.2], [0, 1, 0.2], [1, 0, 0.2]]), 0.0, 0.4)
    assert area(polygon) == pytest.approx(0.5)


def test_floor_and_ceiling_outside_the_slab_give_nothing():
    mesh = mesh_of([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0.42], [1, 0, 0.42], [0, 1, 0.42]]])
    assert polygons_of(mesh, 0.015, float(np.float32(0.42))) == []


def test_a_vertical_wall_gives_segments_that_span_it():
    mesh = mesh_of([[[1, 0, 0], [1, 2, 0], [1, 2, 2]], [[1, 0, 0], [1, 2, 2], [1, 0, 2]]])
    pieces = polygons_of(mesh, 0.5, 1.0)
    assert [len(p) for p in pieces] == [2, 2]
    assert np.concatenate(pieces)[:, 1].min() == 0.0
    assert np.concatenate(pieces)[:, 1].max() == 2.0
    # the lower triangle reaches z = 0.5 only from y = 0.5 on, the upper one z <= 1 only up to y = 1
    assert sorted(pieces[0][:, 1]) == [0.5, 2.0]
    assert sorted(pieces[1][:, 1]) == [0.0, 1.0]


def test_a_slope_cut_on_both_sides_has_the_area_of_its_middle():
    # z = x over the unit square: the part with 0.25 < z < 0.75 covers half of the floor
    mesh = mesh_of([[[0, 0, 0], [1, 0, 1], [1, 1, 1]], [[0, 0, 0], [1, 1, 1], [0, 1, 0]]])
    pieces = polygons_of(mesh, 0.25, 0.75)
    assert sum(area(p) for p in pieces) == pytest.approx(0.5)


def test_a_slab_needs_a_height():
    with pytest.raises(ValueError, match="low < high"):
        slab_polygons(mesh_of([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), 0.4, 0.4)


coordinate = st.floats(-3, 3, width=32).map(lambda v: round(v, 3))
triangle = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=3, max_size=3)


@given(st.lists(triangle, min_size=1, max_size=5), coordinate, st.floats(0.05, 2.0), st.randoms(use_true_random=False))
def test_a_point_of_a_triangle_is_covered_exactly_when_it_lies_in_the_slab(triangles, low, height, random):
    high = low + height
    for corners in triangles:
        mesh = mesh_of([corners])
        pieces = [p for p in polygons_of(mesh, low, high) if len(p) > 2]
        for polygon in pieces:
            assert 3 <= len(polygon) <= 5
            assert area(polygon) > 0
        if not pieces:
            continue
        exact = mesh.corners()[0].astype(np.float64)
        for _ in range(20):
            u, v = sorted((random.random(), random.random()))
            x, y, z = np.array([u, v - u, 1 - v]) @ exact
            edge = np.roll(pieces[0], -1, axis=0) - pieces[0]
            across = edge[:, 0] * (y - pieces[0][:, 1]) - edge[:, 1] * (x - pieces[0][:, 0])
            margin = across / np.maximum(np.linalg.norm(edge, axis=1), 1e-9)
            if low + 1e-3 < z < high - 1e-3:
                assert margin.min() > -1e-6
            elif z < low - 1e-3 or z > high + 1e-3:
                assert margin.min() < 1e-6
