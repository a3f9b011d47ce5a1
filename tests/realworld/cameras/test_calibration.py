from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from taskslam.errors import CameraError, InputError
from taskslam.realworld.cameras.boards import AprilGrid, CharucoBoard, board_page, largest_board, parse_board
from taskslam.realworld.cameras.calibration import View, calibrate
from taskslam.realworld.cameras.calibration_guidance import coverage, guidance
from taskslam.realworld.cameras.calibration_images import calibrate_from, collect_views
from taskslam.realworld.cameras.camera_model import Camera, DistortionModel
from taskslam.realworld.tags.tag_sheets import PAPERS

cv2 = pytest.importorskip("cv2")
pytest.importorskip("apriltag")

BOARD = np.array([[x, y, 0.0] for y in range(6) for x in range(8)]) * 0.03
LENSES = {
    DistortionModel.PLUMB_BOB: [0.11, -0.173, -0.0021, -0.0029, 0.0],
    DistortionModel.EQUIDISTANT: [0.02, -0.01, 0.004, -0.001],
}


def camera(model: DistortionModel = DistortionModel.PLUMB_BOB) -> Camera:
    K = np.array([[395.0, 0, 303.5], [0, 396.0, 244.75], [0, 0, 1]])
    return Camera("c930e", 640, 480, K, np.array(LENSES[model]), model)


def board_pose(rng: np.random.Generator, cam: Camera, width: float, tilt: float = 0.6) -> np.ndarray:
    """A pose with the board's middle somewhere in the image."""
    ray = np.append(cam.undistort(rng.uniform([0.1, 0.1], [0.9, 0.9]) * [cam.width, cam.height])[0], 1)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [*rng.uniform(-tilt, tilt, 2), rng.uniform(-0.5, 0.5)]).as_matrix()
    T[:3, 3] = ray * rng.uniform(0.9, 1.5) * width - T[:3, :3] @ [width / 2, width / 2.6, 0]
    return T


def exact_views(count: int, seed: int, noise: float, cam: Camera, tilt: float = 0.6) -> list[View]:
    rng = np.random.default_rng(seed)
    views = []
    while len(views) < count:
        T = board_pose(rng, cam, 0.21, tilt)
        pixels = cam.project(BOARD @ T[:3, :3].T + T[:3, 3])
        seen = ((pixels > 0) & (pixels < [cam.width, cam.height])).all(1)
        if seen.sum() >= 20:
            shifted = pixels[seen] + rng.normal(0, noise, (seen.sum(), 2))
            views.append(View(f"{len(views):02}.jpg", BOARD[seen], shifted, np.zeros((seen.sum(), 2))))
    return views


@pytest.mark.parametrize("model", LENSES)
def test_exact_corners_give_the_camera_back(model: DistortionModel) -> None:
    result = calibrate(exact_views(12, 0, 0.0, camera(model)), (640, 480), "east", model)
    np.testing.assert_allclose(result.camera.K, camera(model).K, atol=0.02)
    np.testing.assert_allclose(result.camera.distortion, camera(model).distortion, atol=1e-3)
    assert result.rms < 2e-3


def test_deviations_are_as_large_as_the_errors_are() -> None:
    ratios = []
    for seed in range(12):
        result = calibrate(exact_views(12, seed, 0.1, camera()), (640, 480))
        true = [395.0, 396.0, 303.5, 244.75, 0.11, -0.173, -0.0021, -0.0029]
        ratios.append(
            [(value - t) / deviation for (_, value, deviation), t in zip(result.parameters, true, strict=True)]
        )
    assert 0.6 < np.sqrt(np.mean(np.square(ratios))) < 1.3


def test_errors_that_go_together_in_a_view_widen_the_deviations() -> None:
    """A board bent differently in each view: the scatter of corners alone would promise too much."""
    ratios = []
    for seed in range(8):
        views = []
        for number, view in enumerate(exact_views(14, seed, 0.0, camera())):
            bend = np.random.default_rng(100 * seed + number).normal(0, 1, 2)
            wave = ((view.points[:, :2] - 0.1) / 0.1) ** 2
            views.append(View(view.name, view.points, view.pixels + 0.3 * wave * bend, view.outward))
        result = calibrate(views, (640, 480))
        ratios += [(result.camera.K[0, 0] - 395) / result.uncertainty.deviations[0]]
    assert np.sqrt(np.mean(np.square(ratios))) < 2.0


def test_a_view_that_disagrees_is_left_out_and_named() -> None:
    views = exact_views(14, 3, 0.05, camera())
    moved = views[5].pixels + np.random.default_rng(0).normal(0, 3, views[5].pixels.shape)
    views[5] = View("blurred.jpg", views[5].points, moved, views[5].outward)
    result = calibrate(views, (640, 480))
    assert [fitted.view.name for fitted in result.dropped] == ["blurred.jpg"]
    assert len(result.used) == 13
    assert result.dropped[0].rms > 1
    np.testing.assert_allclose(result.camera.K[0, 0], 395, atol=1)


def test_views_that_cannot_agree_are_refused() -> None:
    rng = np.random.default_rng(0)
    views = [
        View(v.name, v.points, v.pixels + (rng.normal(0, 4, v.pixels.shape) if i % 2 else 0), v.outward)
        for i, v in enumerate(exact_views(12, 4, 0.02, camera()))
    ]
    with pytest.raises(CameraError, match="more than a third"):
        calibrate(views, (640, 480))
    with pytest.raises(CameraError, match="3 views"):
        calibrate(views[:3], (640, 480))


def test_guidance_asks_for_what_is_missing() -> None:
    good = calibrate(exact_views(24, 5, 0.05, camera()), (640, 480))
    assert guidance(good) == []
    few = calibrate(exact_views(6, 6, 0.05, camera()), (640, 480))
    assert any("6 views" in sentence for sentence in guidance(few))
    flat = calibrate(exact_views(18, 7, 0.05, camera(), tilt=0.1), (640, 480))
    assert any("tilt" in sentence for sentence in guidance(flat))
    left = [v for v in exact_views(60, 8, 0.05, camera()) if v.pixels[:, 0].max() < 400][:16]
    advice = guidance(calibrate(left, (640, 480)))
    assert any("right" in sentence for sentence in advice)


def test_coverage_counts_corners_where_they_are() -> None:
    counts = coverage([np.array([[0.0, 0.0], [639.0, 479.0], [639.4, 0.0]])], (640, 480))
    assert counts.shape == (5, 8)
    assert (counts[0, 0], counts[4, 7], counts[0, 7], counts.sum()) == (1, 1, 1, 3)


@pytest.mark.parametrize(("spec", "count"), [("charuco:7x5:30", 14), ("aprilgrid:4x3:40", 12)])
def test_rendered_boards_give_the_focal_length_back_within_a_thousandth(
    spec: str, count: int, photograph: Callable[..., np.ndarray], tmp_path: Path
) -> None:
    board, cam = parse_board(spec), camera()
    rng = np.random.default_rng(1)
    width = board.cells().shape[1] * board.cell
    for number in range(count):
        image = photograph(cam, board.cells(), board.cell, board_pose(rng, cam, width), seed=number)
        Image.fromarray(image).save(tmp_path / f"{number:02}.png")
    (tmp_path / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0" + b"0" * 100)
    Image.fromarray(np.full((100, 100), 128, np.uint8)).save(tmp_path / "empty.png")
    collected = collect_views([tmp_path], board)
    assert {name for name, _ in collected.refused} >= {"broken.jpg", "empty.png"}
    result = calibrate_from(collected, board, "east", DistortionModel.PLUMB_BOB)
    for (_, value, deviation), true in zip(result.parameters[:2], (395.0, 396.0), strict=True):
        assert value == pytest.approx(true, rel=1e-3)
        assert abs(value - true) < 4 * deviation
    assert result.rms < 0.1


def test_pictures_of_another_size_are_refused_by_name(photograph: Callable[..., np.ndarray], tmp_path: Path) -> None:
    board, cam = CharucoBoard(7, 5, 0.03), camera()
    image = photograph(cam, board.cells(), board.cell, board_pose(np.random.default_rng(2), cam, 0.21, 0.1))
    for name in ("a.png", "b.png"):
        Image.fromarray(image).save(tmp_path / name)
    Image.fromarray(image).resize((1280, 960)).save(tmp_path / "large.png")
    collected = collect_views([tmp_path], board)
    assert collected.size == (640, 480)
    assert collected.refused == (("large.png", "1280 x 960 px, where most are 640 x 480"),)


def test_a_video_gives_the_frames_in_which_the_board_stands_still(
    photograph: Callable[..., np.ndarray], tmp_path: Path
) -> None:
    board, cam = CharucoBoard(7, 5, 0.03), camera()
    file = tmp_path / "board.avi"
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter_fourcc(*"MJPG"), 6.0, (640, 480), False)
    T = board_pose(np.random.default_rng(2), cam, 0.21, 0.1)
    still = photograph(cam, board.cells(), board.cell, T)
    for image in [still] * 4 + [np.roll(still, 9 * i, 1) for i in range(1, 5)]:
        writer.write(image)
    writer.release()
    collected = collect_views([file], board)
    assert [view.name for view in collected.views] == ["board.avi frame 1", "board.avi frame 3"]
    assert any("moved" in reason for _, reason in collected.refused)


def test_nothing_to_look_at_is_said(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match="no pictures found"):
        collect_views([tmp_path], CharucoBoard(7, 5, 0.03))
    (tmp_path / "video.mp4").write_bytes(b"no video")
    with pytest.raises(CameraError, match="not a picture, a folder of pictures or a video"):
        collect_views([tmp_path / "video.mp4"], CharucoBoard(7, 5, 0.03))


def test_boards_are_named_as_they_are_printed() -> None:
    for board in (CharucoBoard(8, 6, 0.029), AprilGrid(5, 4, 0.0365)):
        assert parse_board(board.spec) == board
    for kind in ("charuco", "aprilgrid"):
        board_page(largest_board(kind, 8, 6, PAPERS["A4"]), PAPERS["A4"])
    with pytest.raises(InputError, match="do not fit"):
        board_page(CharucoBoard(8, 6, 0.04), PAPERS["A4"])
    for wrong in ("charuco", "charuco:8x6", "charuco:99x99:5", "aprilgrid:0x3:4", "chess:8x6:20"):
        with pytest.raises(InputError, match="expected"):
            parse_board(wrong)
