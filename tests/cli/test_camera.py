from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.errors import CameraError, InputError
from taskslam.geometry import rotation_from_rpy
from taskslam.realworld.cameras import calibration_images
from taskslam.realworld.cameras.calibration import View
from taskslam.realworld.cameras.calibration_images import CollectedViews
from taskslam.realworld.cameras.camera_files import load_camera
from taskslam.realworld.cameras.camera_model import Camera

pytest.importorskip("cv2")
run = CliRunner()


def views(count: int) -> tuple[View, ...]:
    """Corners of a board as a known camera sees them."""
    camera = Camera.pinhole("east", 640, 480, 400.0)
    rng = np.random.default_rng(0)
    board = np.array([[x, y, 0.0] for y in range(6) for x in range(8)]) * 0.03
    made = []
    for number in range(count):
        R = rotation_from_rpy(*rng.uniform(-0.5, 0.5, 3))
        at = np.array([*rng.uniform([-0.25, -0.2], [0.05, 0.05]), 0.35])
        pixels = camera.project(board @ R.T + at)
        pixels += rng.normal(0, 0.05, pixels.shape)
        picture = np.full((480, 640), 10 * number, np.uint8)
        made.append(View(f"<{number}>.jpg", board, pixels, np.zeros_like(pixels), lambda p=picture: p))  # type: ignore[misc]
    return tuple(made)


def test_board_prints_its_own_name(tmp_path: Path) -> None:
    arguments = ["camera", "board", "--paper", "A4", "--out", str(tmp_path / "board.pdf")]
    done = run.invoke(app, arguments, catch_exceptions=False)
    assert "--board charuco:8x6:29" in done.stdout
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(InputError, match="--grid 8"):
        run.invoke(app, ["camera", "board", "--grid", "8"], catch_exceptions=False)


def test_calibrate_writes_the_camera_and_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def collected(*_: object) -> CollectedViews:
        return CollectedViews((640, 480), views(16), (("empty<.jpg", "no board"),))

    monkeypatch.setattr(calibration_images, "collect_views", collected)
    out = tmp_path / "east.yaml"
    arguments = ["camera", "calibrate", str(tmp_path), "--board", "charuco:8x6:30", "--name", "east", "-o", str(out)]
    done = run.invoke(app, arguments, catch_exceptions=False)
    assert "640 x 480 px, 16 views" in done.stdout
    assert "fx" in done.stdout
    assert load_camera(out).K[0, 0] == pytest.approx(400, abs=1)
    page = (tmp_path / "east.html").read_text()
    assert page.count("data:image/jpeg;base64,") == 16
    assert "&lt;3&gt;.jpg" in page
    assert "empty&lt;.jpg" in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")


def test_calibrate_without_a_board_in_sight_is_one_sentence(tmp_path: Path) -> None:
    Image.fromarray(np.full((480, 640), 128, np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(CameraError, match=r"no view of the board charuco:8x6:30.*a\.png: no board"):
        run.invoke(app, ["camera", "calibrate", str(tmp_path), "--board", "charuco:8x6:30"], catch_exceptions=False)
    arguments = ["camera", "calibrate", str(tmp_path), "--board", "charuco:8x6:30", "--model", "plumb_bop"]
    with pytest.raises(InputError, match="Did you mean 'plumb_bob'"):
        run.invoke(app, arguments, catch_exceptions=False)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["none.avi", "--out", "east"], "no such file"),
        (["0", "--out", "east", "--size", "large"], "--size large"),
        (["0", "--out", "east", "--start", "noon"], "--start noon"),
        (["0", "--out", "east", "--rate", "0"], "expected a rate"),
    ],
)
def test_record_refuses_what_it_cannot_do(arguments: list[str], told: str) -> None:
    with pytest.raises(InputError, match=told):
        run.invoke(app, ["camera", "record", *arguments], catch_exceptions=False)
