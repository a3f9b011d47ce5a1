from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from taskslam.errors import WorldError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.simulation.rendering.rasterizer import Pinhole
from taskslam.simulation.rendering.scene import Scene, depth_image, render
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import Light, Material, TriangleMesh, World
from taskslam.world.loading import load_world

PINHOLE = Pinhole(752, 480, 360.065, (376.0, 240.0))
SMALL = Pinhole(188, 120, 90.0, (94.0, 60.0))


def standing(x: float, y: float, yaw: float, height: float = 0.31, pitch: float = 0.0) -> FloatArray:
    """The optical frame of a camera that looks along yaw, pitched down."""
    c, s, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    T = np.eye(4)
    T[:3, :3] = np.array([[c * cp, -s, c * sp], [s * cp, c, s * sp], [-sp, 0, cp]])
    T[:3, 3] = x, y, height
    return T @ OPTICAL_IN_BODY


def mesh_of(corners: npt.ArrayLike, uv: npt.ArrayLike | None = None) -> TriangleMesh:
    points = np.asarray(corners, np.float32)
    count = len(points)
    coordinates = np.zeros((count, 3, 2), np.float32) if uv is None else np.asarray(uv, np.float32)
    return TriangleMesh(
        points.reshape(-1, 3),
        np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        np.zeros(count, np.int32),
        coordinates,
        np.zeros((count, 3, 3), np.float32),
        np.zeros(count, np.int32),
    )


def world_of(mesh: TriangleMesh, *materials: Material) -> World:
    return World("few", mesh, mesh, materials or (Material("plain"),), ("few",))


def floor_plane(half: float, repeats: float) -> TriangleMesh:
    a, b, c, d = (-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]) * repeats
    return mesh_of([[a, b, c], [a, c, d]], uv)


def opaque(world: World) -> World:
    """Embree knows of no holes."""
    solid = tuple(
        replace(m, diffuse=(*m.diffuse[:3], 1.0), texture=None if m.texture is None else m.texture[..., :3])
        for m in world.materials
    )
    return replace(world, materials=solid)


def embree(world: World, T: FloatArray, pinhole: Pinhole) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float32]]:
    """Triangle and depth of each pixel by primary rays, within near and far."""
    column, row = np.meshgrid(np.arange(pinhole.width), np.arange(pinhole.height))
    ahead = np.stack(
        [(column - pinhole.center[0]) / pinhole.focal, (row - pinhole.center[1]) / pinhole.focal, np.ones_like(column)],
        axis=-1,
    ).reshape(-1, 3)
    direction = np.ascontiguousarray(ahead @ T[:3, :3].T, np.float32)
    start = T[:3, 3] + pinhole.near * direction  # depth along the optical axis is what near means
    triangle, distance, _ = RayCaster(world.visual).hits(np.ascontiguousarray(start, np.float32), direction)
    depth = distance + np.float32(pinhole.near)
    triangle[depth > pinhole.far] = -1
    shape = pinhole.height, pinhole.width
    return triangle.reshape(shape), depth.reshape(shape)


@pytest.mark.parametrize(
    ("name", "places"),
    [
        ("house", [(-5.1, 2.0, 0.3), (3.0, -0.5, 2.5)]),
        ("aws_small_house/worlds/small_house.world", [(0.0, -1.0, 0.5), (-4.0, 0.0, -0.4)]),
        ("aws_hospital/worlds/hospital.world", [(0.0, 8.0, -1.2), (5.0, -5.0, 1.0)]),
    ],
)
def test_the_rasterizer_and_embree_see_the_same_triangle(
    name: str, places: list[tuple[float, float, float]], request: pytest.FixtureRequest
) -> None:
    path: str | Path = name
    if name != "house":
        path = request.getfixturevalue("data") / "worlds" / name
    world = opaque(load_world(path))
    scene = Scene(world)
    for place in places:
        T = standing(*place)
        view = scene.view(T, PINHOLE)
        triangle, depth = embree(world, T, PINHOLE)
        same = view.triangle() == triangle
        near_enough = np.isclose(view.depth(), depth, rtol=1e-4, atol=0.0)
        assert (same | near_enough).mean() >= 0.9999


def test_no_pixel_falls_between_the_triangles_of_a_closed_surface() -> None:
    rng = np.random.default_rng(3)
    longitude, latitude = 160, 80
    lon = np.linspace(0, 2 * np.pi, longitude, endpoint=False)
    lat = np.linspace(-np.pi / 2 + 0.02, np.pi / 2 - 0.02, latitude)
    radius = rng.uniform(0.8, 1.2, (latitude, longitude, 1))
    ball = radius * np.stack(
        [
            np.cos(lat)[:, None] * np.cos(lon),
            np.cos(lat)[:, None] * np.sin(lon),
            np.broadcast_to(np.sin(lat)[:, None], (latitude, longitude)),
        ],
        axis=-1,
    )
    a, b = ball[:-1], np.roll(ball[:-1], -1, axis=1)
    c, d = np.roll(ball[1:], -1, axis=1), ball[1:]
    corners = np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]
    )
    scene = Scene(world_of(mesh_of(corners)))
    for yaw in np.linspace(0, 6, 5):
        assert (scene.view(standing(0, 0, yaw, 0.0), PINHOLE).drawn >= 0).all()


def test_neighbouring_triangles_never_draw_the_same_pixel_twice_whatever_their_order() -> None:
    mesh = floor_plane(3.0, 1.0)
    swapped = replace(mesh, triangles=mesh.triangles[::-1].copy(), uv=mesh.uv[::-1].copy())
    T = standing(-1.0, 0.2, 0.7, 1.0, 0.8)
    first = Scene(world_of(mesh)).view(T, SMALL).triangle()
    second = Scene(world_of(swapped)).view(T, SMALL).triangle()
    assert (np.where(second >= 0, 1 - second, -1) == first).all()


def test_a_plane_that_passes_under_the_camera_has_the_depth_of_geometry() -> None:
    T = standing(0.3, -0.2, 0.4, 0.31)
    depth = render(world_of(floor_plane(100.0, 1.0)), T, PINHOLE).depth()
    rows = np.arange(260, 480)
    expected = 0.31 * PINHOLE.focal / (rows - 240.0)
    assert np.allclose(depth[rows], expected[:, None], rtol=1e-5)
    assert np.isinf(depth[:240]).all()
    beyond = 0.31 * PINHOLE.focal / np.arange(1, 10) > PINHOLE.far
    assert np.isinf(depth[241:250][beyond]).all()


def test_nothing_nearer_than_the_near_plane_is_seen() -> None:
    wall = mesh_of([[(0.04, -5, -5), (0.04, 5, -5), (0.04, 0, 5)], [(2.0, -9, -9), (2.0, 9, -9), (2.0, 0, 12)]])
    depth = render(world_of(wall), standing(0, 0, 0, 0.0), SMALL).depth()
    assert depth[60, 94] == pytest.approx(2.0)


def test_a_far_checkerboard_fades_to_its_mean_instead_of_shimmering() -> None:
    board = np.zeros((64, 64, 3), np.uint8)
    board[(np.arange(64)[:, None] // 8 + np.arange(64) // 8) % 2 == 0] = 255
    scene = Scene(world_of(floor_plane(50.0, 100.0), Material("board", (1, 1, 1, 1), board)))
    views = [scene.view(standing(0.02 * step, 0.0, 0.0), PINHOLE).radiance_root for step in range(6)]
    lit = views[0][300:].max()
    near, far = views[0][400:470], views[0][243:250, 100:650]
    assert near.std() > 0.3 * lit
    assert far.std() < 0.06 * lit
    assert far.mean() == pytest.approx(math.sqrt(0.5) * lit, rel=0.05)
    flicker = np.abs(np.diff([view[243:250, 100:650] for view in views], axis=0)).mean()
    assert flicker < 0.03 * lit


def test_texture_coordinates_run_up_and_repeat() -> None:
    quarters = np.zeros((64, 64, 3), np.uint8)
    quarters[:32] = 255  # row 0 is v = 1: the upper half is white
    a, b, c, d = (2, 1, -1), (2, -1, -1), (2, -1, 1), (2, 1, 1)
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    wall = mesh_of([[a, b, c], [a, c, d]], uv)
    look = Material("half", (1, 1, 1, 1), quarters)
    image = render(world_of(wall, look), standing(0, 0, 0, 0.0), SMALL).radiance_root
    assert image[40, 94] > 0.3
    assert image[80, 94] < 0.01
    shifted = replace(wall, uv=wall.uv + np.float32(7.0))
    again = render(world_of(shifted, look), standing(0, 0, 0, 0.0), SMALL)
    assert np.allclose(again.radiance_root, image, atol=1e-4)


def test_transparent_texels_and_clear_materials_let_the_wall_behind_be_seen() -> None:
    leaf = np.full((64, 64, 4), 255, np.uint8)
    leaf[:, :32, 3] = 0
    front = [[(1, 1, -1), (1, -1, -1), (1, -1, 1)], [(1, 1, -1), (1, -1, 1), (1, 1, 1)]]
    back = [[(2, 9, -9), (2, -9, -9), (2, 0, 9)]]
    uv = [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]], [[0, 0]] * 3]
    mesh = replace(mesh_of(front + back, uv), material=np.array([0, 0, 1], np.int32))
    for materials, left, right in (
        ((Material("leaf", (1, 1, 1, 1), leaf), Material("wall")), 2.0, 1.0),
        ((Material("glass", (1, 1, 1, 0.2)), Material("wall")), 2.0, 2.0),
    ):
        depth = render(world_of(mesh, *materials), standing(0, 0, 0, 0.0), SMALL).depth()
        assert depth[60, 60] == pytest.approx(left)
        assert depth[60, 130] == pytest.approx(right)


def test_colour_keeps_red_red_and_grey_is_its_luminance() -> None:
    wall = mesh_of([[(2, 9, -9), (2, -9, -9), (2, 0, 9)]])
    world = replace(world_of(wall, Material("red", (0.8, 0.1, 0.1, 1.0))), ambient=(0.5, 0.5, 0.5))
    T = standing(0, 0, 0, 0.0)
    red, green, blue = render(world, T, SMALL, color=True).radiance_root[60, 94]
    grey = render(world, T, SMALL).radiance_root[60, 94]
    assert red > 2 * green
    assert green == pytest.approx(blue)
    assert grey**2 == pytest.approx(0.2126 * red**2 + 0.7152 * green**2 + 0.0722 * blue**2, rel=0.03)


def test_a_lamp_makes_a_pool_of_light_on_a_floor_of_two_triangles() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 3.0, 0.0, 1.0
    lamp = Light("lamp", "point", pose, attenuation_range=8.0, attenuation=(1.0, 0.0, 0.5))
    world = replace(world_of(floor_plane(10.0, 1.0)), lights=(lamp,), ambient=(0.05, 0.05, 0.05))
    view = render(world, standing(0, 0, 0, 1.0, 0.3), PINHOLE)
    row = view.radiance_root[np.argmin(np.abs(view.depth()[:, 376] * math.cos(0.3) - 3.0)), :]
    assert row[376] > 1.3 * row[20]


def test_the_number_of_threads_does_not_change_a_byte(room: World) -> None:
    scene = Scene(room)
    T = standing(-3.0, 0.5, 0.2)
    views = [scene.view(T, PINHOLE, threads) for threads in (1, 2, 3, 7)]
    for view in views[1:]:
        assert view.radiance_root.tobytes() == views[0].radiance_root.tobytes()
        assert view.drawn.tobytes() == views[0].drawn.tobytes()
        assert view.inverse_depth.tobytes() == views[0].inverse_depth.tobytes()


def test_hidden_blocks_change_nothing_but_the_time(room: World) -> None:
    """The many triangles behind a wall are left out; with the wall gone they are seen."""
    rng = np.random.default_rng(0)
    crowd = rng.uniform((5, -3, 0), (8, 3, 1), (4000, 1, 3)) + rng.uniform(-0.1, 0.1, (4000, 3, 3))
    wall = [[(4.0, -50, -50), (4.0, 50, -50), (4.0, 0, 90)]]
    T = standing(0, 0, 0)
    hidden = render(world_of(mesh_of(np.concatenate([crowd, wall]))), T, SMALL)
    assert (hidden.triangle()[:100] == 4000).all()
    bare = world_of(mesh_of(crowd))
    triangle, _ = embree(bare, T, SMALL)
    assert (render(bare, T, SMALL).triangle() == triangle).mean() > 0.999


def test_a_camera_inside_a_wall_sees_its_inside(make_world: Callable[..., World]) -> None:
    view = render(make_world([(-1.0, -1.0, 0.0, 1.0, 1.0, 1.0)]), standing(0.1, 0.2, 0.3, 0.4), SMALL)
    assert (view.drawn >= 0).all()
    assert view.depth().max() < 2.3


def test_triangles_without_area_or_sense_change_nothing() -> None:
    good = mesh_of([[(2, 9, -9), (2, -9, -9), (2, 0, 9)]])
    needle = [(1, 0, 0), (1, 1, 0), (1, 2, 0)]
    point = [(1, 0, 0)] * 3
    edge_on = [(0.5, 0, 0), (1, 0, 0), (1.5, 0, 0.0)]
    broken = [(np.nan, 0, 0), (1, 0, 0), (np.inf, 1, 0)]
    bad = mesh_of(np.concatenate([good.corners(), np.array([needle, point, edge_on, broken])]))
    T = standing(0, 0, 0, 0.0)
    assert (render(world_of(bad), T, SMALL).radiance_root == render(world_of(good), T, SMALL).radiance_root).all()


def test_an_empty_world_shows_its_background() -> None:
    world = replace(world_of(mesh_of(np.zeros((0, 3, 3)))), background=(1.0, 1.0, 1.0))
    view = render(world, standing(0, 0, 0), SMALL)
    assert np.allclose(view.radiance_root, 1.0)
    assert (depth_image(view) == 0.0).all()


def test_a_pose_that_is_not_rigid_is_refused(room: World) -> None:
    with pytest.raises(WorldError, match="rigid"):
        render(room, np.diag([2.0, 1.0, 1.0, 1.0]), SMALL)
