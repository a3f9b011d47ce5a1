"""The virtual lab's pictures, piece by piece: geometry to hundredths of a pixel, blur, shadow, noise, sway, ceiling."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image

from taskslam.errors import WorldError
from taskslam.geometry import OPTICAL_IN_BODY, invert_se3, pose_from_xyz_rpy
from taskslam.lab.ceiling import with_ceiling
from taskslam.lab.image import INK, PAPER, SAMPLES, Body, Cards, draw, sheet
from taskslam.lab.lens import Backdrop, backdrop, covering_pinhole, natural_vignetting, pixel_corners
from taskslam.lab.robot import Floor, Sway, robot_cylinders, travelled
from taskslam.lab.shot import Development, develop_photo, gain_for, jpeg, soften
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.simulation.rendering.scene import Scene
from taskslam.world import World

WIDTH, HEIGHT = 320, 240
LOOK_DOWN = np.array([[0.0, -1, 0, 0], [-1, 0, 0, 0], [0, 0, -1, 3.0], [0, 0, 0, 1]])  # 3 m up, picture's top along x


@pytest.fixture(scope="module")
def camera() -> Camera:
    """A lens that bends as strongly as the published upward camera."""
    K = np.array([[300.0, 0, 161.3], [0, 301.5, 118.2], [0, 0, 1]])
    return Camera("bent", WIDTH, HEIGHT, K, np.array([-0.42, 0.22, 0.0008, 0.0025, 0.0]))


@pytest.fixture(scope="module")
def rays(camera: Camera) -> np.ndarray:
    corners = pixel_corners(camera.width, camera.height)
    return camera.undistort(corners.reshape(-1, 2)).reshape(corners.shape)


def black() -> Backdrop:
    return Backdrop(np.zeros((HEIGHT, WIDTH), np.float32), np.full((HEIGHT, WIDTH), np.inf, np.float32))


def still(T: np.ndarray) -> np.ndarray:
    """One pose for all instants."""
    return np.repeat(T[None], SAMPLES, axis=0)


def facing(x: float, y: float, z: float, turn: float, tilt: float) -> np.ndarray:
    """T_camera_card of a card that faces the camera, turned about its normal and tilted about the picture's x."""
    face = pose_from_xyz_rpy((x, y, z), (np.pi, 0, 0))
    return face @ pose_from_xyz_rpy((0, 0, 0), (tilt, 0, 0)) @ pose_from_xyz_rpy((0, 0, 0), (0, 0, turn))


def polygon(camera: Camera, T: np.ndarray, side: float) -> np.ndarray:
    """The card's rim, finely, in pixels: lens and all."""
    s = np.linspace(-0.5, 0.5, 400, endpoint=False) * side
    h = np.full_like(s, side / 2)
    rim = np.concatenate([np.stack(p, axis=1) for p in ((s, -h), (h, s), (-s, h), (-h, -s))])
    return camera.project(rim @ T[:3, :2].T + T[:3, 3])


def area_and_middle(points: np.ndarray) -> tuple[float, np.ndarray]:
    """Of a polygon (shoelace formula)."""
    after = np.roll(points, -1, axis=0)
    cross = points[:, 0] * after[:, 1] - after[:, 0] * points[:, 1]
    return abs(cross.sum()) / 2, ((points + after) * cross[:, None]).sum(axis=0) / (3 * cross.sum())


@pytest.mark.parametrize(
    ("x", "y", "z", "turn", "tilt"),
    [(0.0, 0.0, 2.0, 0.0, 0.0), (0.55, -0.4, 2.0, 0.4, 0.3), (-0.6, 0.45, 1.7, 1.2, -0.5), (0.2, 0.5, 2.3, 2.8, 0.6)],
)
def test_a_card_covers_the_pixels_that_the_lens_model_says(
    camera: Camera, rays: np.ndarray, x: float, y: float, z: float, turn: float, tilt: float
) -> None:
    T, side = facing(x, y, z, turn, tilt), 0.3
    white = np.full((1, 1, 1), 0.5, np.float32)
    image, box = draw(black(), rays, 2.0, Cards(white, side, still(T)[:, None]), None)
    area, middle = area_and_middle(polygon(camera, T, side))
    assert image.max() == pytest.approx(1.0)
    assert image.sum() == pytest.approx(area, rel=2e-3)
    v, u = np.indices(image.shape)
    np.testing.assert_allclose([(u * image).sum() / image.sum(), (v * image).sum() / image.sum()], middle, atol=0.02)
    outside = image.copy()
    outside[box] = 0
    assert not outside.any()


def test_an_artwork_lies_with_its_top_along_x(rays: np.ndarray, camera: Camera) -> None:
    cells = np.zeros((4, 4), bool)
    cells[0, 0] = True  # the white cell is at the top left
    look = sheet(cells, quiet=0)
    assert look[0, 0] == pytest.approx(PAPER)
    assert look[3, 3] == pytest.approx(INK)
    T = facing(0, 0, 2.0, 0.0, 0.0)
    image, _ = draw(black(), rays, 1.0, Cards(look[None], 0.4, still(T)[:, None]), None)
    top_left = camera.project((T @ [0.15, 0.15, 0, 1])[None, :3])[0]  # x to the top, y to the left
    assert image[round(top_left[1]), round(top_left[0])] == pytest.approx(PAPER)
    other = camera.project((T @ [-0.15, -0.15, 0, 1])[None, :3])[0]
    assert image[round(other[1]), round(other[0])] == pytest.approx(INK)


def test_the_back_of_a_card_and_a_card_behind_the_camera_are_not_seen(rays: np.ndarray) -> None:
    white = np.ones((1, 1, 1), np.float32)
    away = pose_from_xyz_rpy((0, 0, 2.0), (0, 0, 0))
    behind = facing(0, 0, -2.0, 0, 0)
    for T in (away, behind):
        image, _ = draw(black(), rays, 1.0, Cards(white, 0.3, still(T)[:, None]), None)
        assert not image.any()


def test_what_stands_nearer_hides_a_card(rays: np.ndarray) -> None:
    wall = np.full((HEIGHT, WIDTH), np.inf, np.float32)
    wall[:, : WIDTH // 2] = 1.0
    white = np.ones((1, 1, 1), np.float32)
    behind = Backdrop(np.zeros((HEIGHT, WIDTH), np.float32), wall)
    image, _ = draw(behind, rays, 1.0, Cards(white, 0.3, still(facing(0, 0, 2.0, 0, 0))[:, None]), None)
    assert not image[:, : WIDTH // 2].any()
    assert image[:, WIDTH // 2 :].any()


def test_a_card_that_moves_while_the_shutter_is_open_is_smeared_along_its_way(camera: Camera, rays: np.ndarray) -> None:
    white = np.ones((1, 1, 1), np.float32)
    way = np.stack([facing(shift, 0.0, 2.0, 0, 0) for shift in np.linspace(-0.1, 0.1, SAMPLES)])
    image, _ = draw(black(), rays, 1.0, Cards(white, 0.2, way[:, None]), None)
    rest, _ = draw(black(), rays, 1.0, Cards(white, 0.2, still(facing(0, 0, 2.0, 0, 0))[:, None]), None)
    spread = [(np.indices(i.shape)[1] * i).sum() / i.sum() for i in (image, rest)]
    assert spread[0] == pytest.approx(spread[1], abs=0.3)
    assert (image > 0.02).any(axis=0).sum() > (rest > 0.02).any(axis=0).sum() + 20
    assert (image > 0.02).any(axis=1).sum() == pytest.approx((rest > 0.02).any(axis=1).sum(), abs=1)
    assert image.sum() == pytest.approx(rest.sum(), rel=0.02)


def test_a_robot_stands_on_the_floor_and_darkens_it_around_its_foot(rays: np.ndarray, camera: Camera) -> None:
    floor = Backdrop(np.full((HEIGHT, WIDTH), 0.5, np.float32), np.full((HEIGHT, WIDTH), 3.0, np.float32))
    robot = still(invert_se3(LOOK_DOWN))
    cylinders = robot_cylinders(0.178, 0.41, 0.45)
    image, box = draw(floor, rays, 1.0, None, Body(cylinders, robot))
    far = image.copy()
    far[box] = 0.5
    np.testing.assert_array_equal(far, floor.radiance)
    u, v = camera.project(np.array([[0.0, 0.0, 2.59]]))[0]
    assert image[round(v), round(u)] == pytest.approx(0.10, abs=0.01)  # the top plate
    u, v = camera.project(np.array([[0.20, 0.0, 3.0]]))[0]
    assert 0.25 < image[round(v), round(u)] < 0.35  # shadow
    u, v = camera.project(np.array([[0.45, 0.0, 3.0]]))[0]
    assert image[round(v), round(u)] > 0.48


def test_a_world_is_bent_as_the_lens_bends(make_world: Callable[..., World], camera: Camera, rays: np.ndarray) -> None:
    world = make_world([(-50, -50, -0.2, 50, 50, 0.0), (0.3, 0.2, 0.0, 0.7, 0.6, 0.5)])
    view = backdrop(Scene(world), LOOK_DOWN, rays, covering_pinhole(rays))
    assert np.isfinite(view.depth).all()
    on_box = view.depth < 2.501
    top = np.array([[x, y, 0.5, 1.0] for x in (0.3, 0.7) for y in (0.2, 0.6)]) @ invert_se3(LOOK_DOWN).T
    pixels = camera.project(top[:, :3])
    v, u = np.nonzero(on_box)
    np.testing.assert_allclose([u.min(), u.max()], [pixels[:, 0].min(), pixels[:, 0].max()], atol=1.5)
    np.testing.assert_allclose([v.min(), v.max()], [pixels[:, 1].min(), pixels[:, 1].max()], atol=1.5)
    assert view.depth[on_box].min() == pytest.approx(2.5, abs=1e-3)
    assert view.depth[0, 0] == pytest.approx(3.0, abs=1e-3)


def test_a_lens_that_no_pinhole_covers_is_refused() -> None:
    fisheye = Camera(
        "wide", 640, 480, np.array([[150.0, 0, 320], [0, 150, 240], [0, 0, 1]]), np.zeros(4), "equidistant"
    )  # type: ignore[arg-type]
    corners = pixel_corners(640, 480)
    with pytest.raises(WorldError, match="sees so wide"):
        covering_pinhole(fisheye.undistort(corners.reshape(-1, 2)).reshape(corners.shape), fineness=8.0)


def test_softness_keeps_the_light_and_touches_only_the_box() -> None:
    flat = np.full((80, 90), 0.25, np.float32)
    spot = flat.copy()
    spot[40, 50] = 1.0
    box = (slice(40, 41), slice(50, 51))
    out = soften(spot, 1.2, box, flat)
    assert out.sum() == pytest.approx(spot.sum(), rel=1e-5)
    assert out[40, 50] < 0.5
    np.testing.assert_allclose(out[:30], 0.25, rtol=1e-6)
    np.testing.assert_array_equal(soften(flat, 1.2, (slice(80, 0), slice(90, 0)), flat), flat)


def test_a_box_at_the_rim_is_softened_as_the_whole_picture_would_be() -> None:
    dice = np.random.default_rng(0)
    before = np.full((60, 70), 0.3, np.float32)
    after = before.copy()
    after[:9, 62:] = dice.uniform(0, 1, (9, 8))
    whole = (slice(0, 60), slice(0, 70))
    partly = soften(after, 0.8, (slice(0, 9), slice(62, 70)), soften(before, 0.8, whole, before))
    np.testing.assert_allclose(partly, soften(after, 0.8, whole, after), atol=1e-6)


def test_paper_is_not_clipped_at_the_right_exposure_and_is_at_four_times_that(rays: np.ndarray) -> None:
    dark = np.full((HEIGHT, WIDTH), 0.02, np.float32)
    paper = np.full((HEIGHT, WIDTH), 0.7 * PAPER, np.float32)
    shares = []
    for exposure in (1.0, 4.0):
        how = Development(2.0, np.ones_like(paper), gain_for(dark, 0.7, exposure))
        shares.append(float((develop_photo(paper, how, 1) == 255).mean()))
    assert shares[0] < 0.01
    assert shares[1] > 0.99


def test_noise_has_the_strength_that_is_asked_for_and_depends_on_the_key() -> None:
    grey = np.full((200, 200), 0.25, np.float32)
    how = Development(3.0, np.ones_like(grey), 1.0)
    one, other = develop_photo(grey, how, 1), develop_photo(grey, how, 2)
    assert one.std() == pytest.approx(3.0, rel=0.03)
    assert (one != other).any()
    np.testing.assert_array_equal(one, develop_photo(grey, how, 1))


def test_vignetting_is_the_fourth_power_of_the_cosine() -> None:
    camera = Camera.pinhole("plain", 201, 101, 100.0)
    corners = pixel_corners(201, 101)
    share = natural_vignetting(camera.undistort(corners.reshape(-1, 2)).reshape(corners.shape))
    assert share[50, 100] == pytest.approx(1.0, abs=1e-4)
    assert share[50, 200] == pytest.approx(0.25, abs=1e-3)  # 45 degrees


def test_a_picture_survives_its_file() -> None:
    image = np.random.default_rng(1).integers(0, 255, (40, 50)).astype(np.uint8)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(jpeg(image, None)))), image)
    assert Image.open(io.BytesIO(jpeg(image, 90))).format == "JPEG"
    assert len(jpeg(image, 30)) < len(jpeg(image, 95))


def test_a_floor_sways_a_robot_on_its_way_and_leaves_one_at_rest_alone() -> None:
    sway = Sway(np.radians(0.3), 0.001)
    planar = np.tile([1.0, 2.0, 0.5], (400, 1))
    way = np.linspace(0, 200, 400)
    poses = Floor(sway, seed=0, round_number=1).poses(planar, way)
    tilts = np.degrees(np.arcsin(poses[:, 2, :2]))
    np.testing.assert_allclose(tilts.std(axis=0), 0.3, rtol=0.15)
    assert poses[:, 2, 3].std() == pytest.approx(0.001, rel=0.15)
    rest = Floor(sway, 0, 1).poses(planar[:3], np.full(3, 7.0))
    np.testing.assert_array_equal(rest[0], rest[2])
    other = Floor(sway, 0, 2).poses(planar[:1], np.full(1, 7.0))
    assert (other != rest[:1]).any()


def test_the_pivot_stays_where_it_is_as_the_robot_tilts() -> None:
    for pivot in (0.0, 0.45):
        poses = Floor(Sway(np.radians(2.0), 0.0, pivot), 0, 0).poses(np.tile([1.0, 2.0, 0.5], (50, 1)), np.arange(50.0))
        np.testing.assert_allclose(poses @ [0, 0, pivot, 1], np.tile([1.0, 2.0, pivot, 1.0], (50, 1)), atol=1e-12)
        top = (poses @ [0, 0, pivot + 0.45, 1])[:, :2]
        assert 0.01 < np.hypot(*(top - [1.0, 2.0]).T).max() < 0.06


def test_turning_on_the_spot_counts_as_way() -> None:
    turning = np.array([[0.0, 0, 3.1], [0.0, 0, -3.1], [1.0, 0, -3.1]])
    np.testing.assert_allclose(travelled(turning), [0.0, 0.1 * (2 * np.pi - 6.2), 1 + 0.1 * (2 * np.pi - 6.2)])


def test_a_ceiling_is_seen_from_below(room: World) -> None:
    T_world_camera = pose_from_xyz_rpy((0.5, -0.5, 0.4), (0, -np.pi / 2, 0)) @ OPTICAL_IN_BODY
    camera = Camera.pinhole("up", 120, 90, 100.0)
    corners = pixel_corners(120, 90)
    rays = camera.undistort(corners.reshape(-1, 2)).reshape(corners.shape)
    view = backdrop(Scene(with_ceiling(room, 2.4)), T_world_camera, rays, covering_pinhole(rays))
    np.testing.assert_allclose(view.depth, 2.0, atol=1e-3)
    assert view.radiance.min() > 0.05
    assert view.radiance.std() > 0.002  # the tiles' joints
