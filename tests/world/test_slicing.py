from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.errors import FloorPlanError
from taskslam.world import TriangleMesh, World
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN
from taskslam.world.slicing import slab_polygons, slice_floor_plan


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


@given(st.lists(triangle, min_size=1, max_size=5), coordinate, st.floats(0.05, 2.0), st.integers(0, 1000))
def test_a_point_of_a_triangle_is_covered_exactly_when_it_lies_in_the_slab(triangles, low, height, seed):
    high = low + height
    rng = np.random.default_rng(seed)
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
            u, v = np.sort(rng.random(2))
            x, y, z = np.array([u, v - u, 1 - v]) @ exact
            edge = np.roll(pieces[0], -1, axis=0) - pieces[0]
            across = edge[:, 0] * (y - pieces[0][:, 1]) - edge[:, 1] * (x - pieces[0][:, 0])
            margin = across / np.maximum(np.linalg.norm(edge, axis=1), 1e-9)
            if low + 1e-3 < z < high - 1e-3:
                assert margin.min() > -1e-6
            elif z < low - 1e-3 or z > high + 1e-3:
                assert margin.min() < 1e-6


def box(x0, y0, z0, x1, y1, z1):
    """(12, 3, 3) corners of a closed box."""
    v = np.array([[x, y, z] for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return np.array([v[[a, b, c]] for q in quads for a, b, c in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def room(*furniture) -> World:
    """A 4 m x 3 m room between walls 0.2 m thick, on a floor that reaches beyond it, with its south-west at (0, 0)."""
    walls = [
        box(-0.2, -0.2, 0, 4.2, 0, 2.5),
        box(-0.2, 3, 0, 4.2, 3.2, 2.5),
        box(-0.2, 0, 0, 0, 3, 2.5),
        box(4, 0, 0, 4.2, 3, 2.5),
        box(-9, -9, -0.1, 9, 9, 0),
    ]
    mesh = mesh_of(np.concatenate([*walls, *furniture]))
    return World("room", visual=mesh, collision=mesh, materials=(), models=("room",))


def test_a_room_is_free_inside_occupied_at_its_walls_and_unknown_outside():
    plan = slice_floor_plan(room(), 0.02, 0.42, seed_point=(2.0, 1.5))
    assert plan.at(2.0, 1.5) == FREE
    assert plan.at(3.97, 1.5) == FREE
    assert plan.at(4.0 + 1e-6, 1.5) == OCCUPIED
    assert plan.at(4.1, 1.5) == UNKNOWN, "the inside of a wall"
    assert plan.at(4.27, 1.5) == UNKNOWN, "outside the house"
    assert np.count_nonzero(plan.cells == FREE) * 0.05**2 == pytest.approx(12.0, rel=0.04)


def test_without_a_seed_point_everything_empty_is_free():
    plan = slice_floor_plan(room(), 0.02, 0.42)
    assert UNKNOWN not in plan.cells
    assert plan.at(4.27, 1.5) == FREE


def test_only_what_lies_in_the_slab_is_drawn():
    table = box(1, 1, 0.70, 2, 2, 0.74)
    rug = box(2.5, 1, 0.0, 3.5, 2, 0.01)
    plan = slice_floor_plan(room(table, rug), 0.02, 0.42, seed_point=(2.2, 2.5))
    assert plan.at(1.5, 1.5) == FREE
    assert plan.at(3.0, 1.5) == FREE
    assert slice_floor_plan(room(table), 0.02, 0.8, seed_point=(2.2, 2.5)).at(1.5, 1.5) == OCCUPIED


def test_visual_and_collision_geometry_are_told_apart():
    bare, full = room(), room(box(1, 1, 0, 2, 2, 1))
    world = World("room", visual=full.visual, collision=bare.collision, materials=(), models=("room",))
    assert slice_floor_plan(world, 0.02, 0.42).at(1.0 + 1e-6, 1.5) == FREE
    assert slice_floor_plan(world, 0.02, 0.42, geometry="visual").at(1.0 + 1e-6, 1.5) == OCCUPIED


def test_plans_of_one_world_share_cell_borders():
    plans = [slice_floor_plan(room(*extra), 0.02, 0.42) for extra in ([], [box(5.03, 0, 0, 5.2, 1, 1)])]
    for plan in plans:
        assert plan.origin.x / 0.05 == pytest.approx(round(plan.origin.x / 0.05))
        assert plan.origin.y / 0.05 == pytest.approx(round(plan.origin.y / 0.05))


@pytest.mark.parametrize("seed", [(4.0 + 1e-6, 1.5), (50.0, 0.0)])
def test_a_seed_point_that_is_no_free_floor_is_refused(seed):
    with pytest.raises(FloorPlanError, match="seed point"):
        slice_floor_plan(room(), 0.02, 0.42, seed_point=seed)


def test_an_empty_slab_is_refused():
    with pytest.raises(FloorPlanError, match=r"no collision geometry between 3\.0 m and 4\.0 m"):
        slice_floor_plan(room(), 3.0, 4.0)


def test_a_plan_of_absurd_size_is_refused():
    with pytest.raises(FloorPlanError, match="too large"):
        slice_floor_plan(room(box(0, 0, 0, 1e5, 1e5, 1)), 0.02, 0.42)


@given(st.lists(triangle, min_size=1, max_size=4), st.integers(0, 1000))
def test_occupied_cells_are_exactly_those_that_a_triangle_touches(triangles, seed):
    # one more triangle, so that there is always something in the slab
    corners = np.array([*triangles, [(0, 0, 0), (1, 0, 0.5), (0, 1, -0.5)]], np.float32)
    corners[:, :, 2] *= 1e-3
    corners = corners[np.ptp(corners[:, :, :2], axis=1).max(axis=1) > 0]  # a point has no surface
    mesh = mesh_of(corners)
    plan = slice_floor_plan(World("w", mesh, mesh, (), ("w",)), -0.1, 0.1, resolution=0.2)
    weights = np.sort(np.random.default_rng(seed).random((300, 2)), axis=1)
    weights = np.stack([weights[:, 0], weights[:, 1] - weights[:, 0], 1 - weights[:, 1]], axis=1)
    samples = (weights @ corners.astype(np.float64)).reshape(-1, 3)[:, :2]
    rows, columns = plan.cells_of(samples).T
    assert (plan.cells[rows, columns] == OCCUPIED).all()
    for cell in plan.points_of(np.argwhere(plan.cells == OCCUPIED)):
        assert min(separation(cell, t[:, :2].astype(np.float64)) for t in corners) < 1e-6


def separation(centre, corners, half=0.1) -> float:
    """How far a square cell and a triangle lie apart along the best of their separating axes; <= 0 if they touch."""
    square = centre + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    edges = np.concatenate([np.roll(corners, -1, axis=0) - corners, [[1, 0], [0, 1]]])
    axes = np.stack([-edges[:, 1], edges[:, 0]], axis=1)
    axes = np.concatenate([axes, edges])
    axes = axes[np.linalg.norm(axes, axis=1) > 1e-9]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    a, b = square @ axes.T, corners @ axes.T
    return float(np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)).max())


@pytest.mark.parametrize(("size", "resolution"), [(9e18, 0.05), (1.0, 1e-300), (1e9, 1e-9), (1e6, 1e-4)])
def test_a_plan_of_more_cells_than_memory_is_refused(size, resolution):
    mesh = mesh_of([[0, 0, 0.2], [0, size, 0.2], [size, 0, 0.2]])
    with pytest.raises(FloorPlanError, match="is too large; choose a coarser resolution"):
        slice_floor_plan(World("huge", mesh, mesh, (), ()), 0.0, 0.4, resolution)


def test_a_plan_farther_away_than_cells_can_be_counted_is_refused():
    mesh = mesh_of(np.array([[0, 0, 0.2], [0, 9e17, 0.2], [9e17, 0, 0.2]]) * [1, 1, 1] + [9e18, 9e18, 0])
    with pytest.raises(FloorPlanError, match="is too large"):
        slice_floor_plan(World("far", mesh, mesh, (), ()), 0.0, 0.4, 1e12)
