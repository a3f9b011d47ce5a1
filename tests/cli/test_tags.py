from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.errors import InputError
from taskslam.realworld.tags.tag_family import code_cells

pytest.importorskip("apriltag")
run = CliRunner()


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    image = np.full((200, 300), 220, np.uint8)
    image[40:120, 100:180] = np.kron(code_cells("tag36h11", 7), np.ones((10, 10))) * 200 + 20
    Image.fromarray(image).save(tmp_path / "photo.png")
    return tmp_path / "photo.png"


def test_check_gives_json_of_id_family_and_corners(photo: Path) -> None:
    done = run.invoke(app, ["tags", "check", str(photo), "--json"], catch_exceptions=False)
    (tag,) = json.loads(done.stdout)
    assert (tag["id"], tag["family"]) == (7, "tag36h11")
    np.testing.assert_allclose(tag["corners"], [[99.5, 39.5], [179.5, 39.5], [179.5, 119.5], [99.5, 119.5]], atol=0.1)


def test_check_tells_people_what_it_saw(photo: Path, tmp_path: Path) -> None:
    done = run.invoke(app, ["tags", "check", str(photo)], catch_exceptions=False)
    assert "139.5" in done.stdout
    Image.fromarray(np.zeros((50, 50), np.uint8)).save(tmp_path / "dark.png")
    dark = run.invoke(app, ["tags", "check", str(tmp_path / "dark.png")], catch_exceptions=False)
    assert dark.exit_code == 1
    assert "no tag" in dark.stdout
    assert run.invoke(app, ["tags", "check", str(tmp_path / "dark.png"), "--json"]).stdout == "[]\n"


def tag_picture(family: str = "tag36h11", border: int = 40) -> np.ndarray:
    cells = np.kron(code_cells(family, 7), np.ones((10, 10), np.uint8)) * 200 + 20
    return np.pad(cells.astype(np.uint8), border, constant_values=220)


@pytest.mark.parametrize(
    ("picture", "told"),
    [
        (tag_picture()[:, ::-1], "There is tag 7 of tag36h11: mirrored"),
        (255 - tag_picture(), "There is tag 7 of tag36h11: its black and white are swapped"),
        (tag_picture("tag25h9"), "There is tag 7 of tag25h9: another family, say --family tag25h9"),
        (tag_picture(border=0), "There is tag 7 of tag36h11: at the edge of the picture"),
    ],
)
def test_check_says_what_it_sees_instead(tmp_path: Path, picture: np.ndarray, told: str) -> None:
    Image.fromarray(np.ascontiguousarray(picture)).save(tmp_path / "photo.png")
    done = run.invoke(app, ["tags", "check", str(tmp_path / "photo.png")], catch_exceptions=False)
    assert done.exit_code == 1
    assert "no tag of tag36h11" in done.stdout
    assert told in done.stdout


def test_check_names_a_picture_that_is_cut_short(photo: Path, tmp_path: Path) -> None:
    Image.open(photo).save(tmp_path / "whole.jpg")
    (tmp_path / "cut.jpg").write_bytes((tmp_path / "whole.jpg").read_bytes()[:-500])
    with pytest.raises(InputError, match=r"cut\.jpg: not a whole picture"):
        run.invoke(app, ["tags", "check", str(tmp_path / "cut.jpg")], catch_exceptions=False)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["0-3"], "4 pages, tag36h11, 160 mm"),
        (["7", "--kind", "plate", "--paper", "A3", "--plate", "280x280"], "1 page, tag36h11, 170 mm"),
        (["20-23", "--kind", "bundle", "--size", "150", "--spacing", "600"], "5 pages, tag36h11, 150 mm"),
        (["20-27", "--kind", "bundle", "--paper", "A3"], "2 pages"),
    ],
)
def test_make_writes_pages(arguments: list[str], told: str, tmp_path: Path) -> None:
    out = tmp_path / "tags.pdf"
    done = run.invoke(app, ["tags", "make", *arguments, "--out", str(out)], catch_exceptions=False)
    assert told in done.stdout
    assert out.read_bytes().startswith(b"%PDF-1.4")


def test_make_gives_the_lines_for_the_setup_file(tmp_path: Path) -> None:
    arguments = ["20-23", "--kind", "bundle", "--size", "150", "--spacing", "600", "--out", str(tmp_path / "t.pdf")]
    done = run.invoke(app, ["tags", "make", *arguments], catch_exceptions=False)
    assert "square: {ids: [20, 21, 22, 23], size: 0.15, spacing: 0.6}" in done.stdout
