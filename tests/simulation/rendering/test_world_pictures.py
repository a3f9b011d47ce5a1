import dataclasses
import math

import numpy as np
import pytest

from taskslam.geometry import SE2, pose_from_xyz_rpy
from taskslam.simulation.rendering.world_pictures import Extent, content_extent, perspective, top_down
from taskslam.world import Light, Material, TriangleMesh, World

RED, BLUE, GREEN, WHITE = (220, 30, 30), (30, 30, 220), (30, 200, 30), (255, 255, 255)


def world_of(quads, lights=(), ambient=(0.4, 0.4, 0.4)):
    """Quads of (four corners counterclockwise from the lower left of the picture, material); one model each."""
    vertices = np.array([corner for corners, _ in quads for corner in corners], np.float32)
    triangles, uv, normals = [], [], []
    for index, (corners, _) in enumerate(quads):
        a, b, _, d = (np.array(corner, float) for corner in corners)
        normal = np.cross(b - a, d - a) / np.linalg.norm(np.cross(b - a, d - a))
        triangles += [[4 * index, 4 * index + 1, 4 * index + 2], [4 * index, 4 * index + 2, 4 * index + 3]]
        uv += [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]
        normals += [[normal] * 3] * 2
    owner = np.repeat(np.arange(len(quads)), 2).astype(np.int32)
    mesh = TriangleMesh(
        vertices,
        np.array(triangles, np.int32),
        owner,
        np.array(uv, np.float32),
        np.array(normals, np.float32),
        owner,
    )
    materials = tuple(material for _, material in quads)
    models = tuple(f"quad{i}" for i in range(len(quads)))
    return World("quads", mesh, mesh, materials, models, tuple(lights), ambient, (0.0, 0.0, 0.0))


def floor(x0, y0, x1, y1, material, z=0.0):
    return ([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)], material)


def wall(x, material, half=2.0, height=2.4):
    """A wall across x that faces a viewer at the origin: its picture's left is at +y."""
    return ([(x, half, 0), (x, -half, 0), (x, -half, height), (x, half, height)], material)


def plain(colour, alpha=1.0):
    return Material("plain", (*(c / 255 for c in colour), alpha))


def picture(rows):
    return Material("picture", (1, 1, 1, 1), np.array(rows, np.uint8))


def strongest(pixel):
    return int(np.argmax(pixel))


FOUR = picture([[RED, BLUE], [GREEN, (250, 250, 250)]])


def test_top_down_has_x_to_the_right_and_y_up():
    world = world_of([floor(-2, -1, 0, 0, plain(RED)), floor(0, 0, 2, 1, plain(BLUE))])
    image = top_down(world, 64, extent=Extent(-2, 2, -1, 1))
    assert image.shape == (32, 64, 3)
    assert image.dtype == np.uint8
    assert strongest(image[24, 16]) == 0  # lower left
    assert strongest(image[8, 48]) == 2  # upper right
    assert image[8, 16].min() > 225  # paper where there is nothing


def test_ceiling_is_cut_away():
    room = [floor(-2, -2, 2, 2, plain(GREEN)), floor(-2, -2, 2, 2, plain(RED), z=2.5)]
    assert strongest(top_down(world_of(room), 16)[8, 8]) == 1
    assert strongest(top_down(world_of(room), 16, cut_height=3.0)[8, 8]) == 0


def test_solid_that_is_cut_through_is_dark(make_world):
    world = make_world([(-3, -3, -0.1, 3, 3, 0.0), (-0.5, -0.5, 0.0, 0.5, 0.5, 2.4), (1.5, 1.5, 0, 2.5, 2.5, 1.0)])
    image = top_down(world, 60, extent=Extent(-3, 3, -3, 3))
    assert image[30, 30].max() < 60  # the column reaches above the cut
    assert image[10, 50].min() > 90  # the table does not
    assert image[50, 10].min() > 90


def test_extent_ignores_flat_ground(make_world):
    world = make_world([(-1, -2, 0, 3, 4, 2.0)])
    assert dataclasses.astuple(content_extent(world, margin=0.5)) == (-1.5, 3.5, -2.5, 4.5)
    ground = world_of([floor(-50, -50, 50, 50, plain(GREEN)), wall(3, plain(RED))])
    assert dataclasses.astuple(content_extent(ground, margin=0)) == (3, 3, -2, 2)


def test_perspective_is_not_mirrored_and_textures_stand_upright():
    image = perspective(world_of([wall(2, FOUR)]), SE2(), height=1.2, hfov=math.radians(80), size=(64, 48))
    assert strongest(image[14, 22]) == 0
    assert strongest(image[14, 42]) == 2
    assert strongest(image[34, 22]) == 1
    assert image[34, 42].min() > 100


def test_perspective_has_the_field_of_view_that_was_asked_for():
    # a wall of half width 2 m at 2 m fills 90 degrees
    image = perspective(world_of([wall(2, plain(WHITE))]), SE2(), hfov=math.radians(90.001), size=(40, 10))
    assert (image[5] > 50).all()
    wider = perspective(world_of([wall(2, plain(WHITE))]), SE2(), hfov=2 * math.atan(2.0), size=(40, 10))
    assert (wider[5] > 50).all(axis=1).nonzero()[0].tolist() == list(range(10, 30))


def test_pitch_looks_down():
    world = world_of([floor(-5, -5, 5, 5, plain(GREEN))])
    up, down = (perspective(world, SE2(), pitch=p, size=(8, 8)) for p in (-1.0, 1.0))
    assert up.max() == 0
    assert down[..., 1].min() > 50


def test_bright_lights_do_not_saturate_the_picture():
    sun = Light("sun", "directional", np.eye(4), diffuse=(5.0, 5.0, 5.0))
    lamp = Light("lamp", "point", pose_from_xyz_rpy((0, 0, 1), (0, 0, 0)), attenuation=(0.05, 0, 0))
    image = top_down(world_of([floor(-2, -2, 2, 2, FOUR)], [sun, lamp]), 40, extent=Extent(-2, 2, -2, 2))
    assert (image.max(axis=2) == 255).mean() < 0.01
    assert image.mean() > 50


def test_point_light_falls_off():
    lamp = Light("lamp", "point", pose_from_xyz_rpy((-2, 0, 1), (0, 0, 0)), attenuation=(0.5, 0, 1.0))
    image = top_down(world_of([floor(-3, -1, 3, 1, plain(WHITE))], [lamp]), 60, extent=Extent(-3, 3, -1, 1))
    assert image[10, 10].mean() > image[10, 30].mean() + 10


def test_world_without_light_is_still_visible():
    image = perspective(world_of([wall(2, FOUR)], ambient=(0, 0, 0)), SE2(), size=(32, 24))
    assert image[12, 16].max() > 60


def test_transparent_texels_let_the_view_through():
    hole = np.full((2, 2, 4), 255, np.uint8)
    hole[..., 1:3] = 0
    hole[:, 0, 3] = 0  # the left half is cut out
    world = world_of([wall(2, Material("leaf", (1, 1, 1, 1), hole)), wall(3, plain(BLUE), half=4)])
    image = perspective(world, SE2(), hfov=math.radians(60), size=(64, 32))
    assert strongest(image[16, 12]) == 2
    assert strongest(image[16, 52]) == 0


def test_background_fills_what_is_empty():
    world = dataclasses.replace(world_of([wall(2, FOUR)]), background=(0.2, 0.4, 0.6))
    image = perspective(world, SE2(theta=math.pi), size=(8, 8))
    assert image.reshape(-1, 3).tolist() == [[51, 102, 153]] * 64


def test_distant_texture_is_smooth_and_near_texture_is_sharp():
    board = np.indices((256, 256)).sum(axis=0) % 2 * 255
    checkers = picture(np.repeat(board[..., None], 3, axis=2))
    far = top_down(world_of([floor(-2, -2, 2, 2, checkers)]), 16, extent=Extent(-2, 2, -2, 2))
    assert np.ptp(far.astype(int)) < 12
    near = top_down(world_of([floor(-2, -2, 2, 2, checkers)]), 64, extent=Extent(0, 0.125, 0, 0.125))
    assert np.ptp(near.astype(int)) > 100


@pytest.mark.parametrize("scale", [(1.0, 1.0), (2.0, 2.0)])
def test_texture_scale_repeats_the_texture(scale):
    stripes = dataclasses.replace(picture([[RED, RED, BLUE, BLUE]] * 4), texture_scale=scale)
    image = top_down(world_of([floor(-2, -2, 2, 2, stripes)]), 64, extent=Extent(-2, 2, -2, 2))
    row = np.argmax(image[32], axis=1)
    assert np.count_nonzero(np.diff(row)) == 2 * scale[0] - 1


def test_same_world_gives_the_same_bytes(room):
    assert top_down(room, 48).tobytes() == top_down(room, 48).tobytes()
    one, two = (perspective(room, SE2(-3, 0, 0.3), size=(48, 32)).tobytes() for _ in range(2))
    assert one == two
