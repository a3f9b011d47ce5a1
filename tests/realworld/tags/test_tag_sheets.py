from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.errors import InputError
from taskslam.realworld.cameras.images import read_grey
from taskslam.realworld.tags.detector import Detector, Tag
from taskslam.realworld.tags.pdf import Page, write_pdf
from taskslam.realworld.tags.tag_sheets import (
    Sheet,
    bundle_centres,
    bundle_pages,
    largest_bundle,
    largest_spacing,
    paper_size,
    parse_ids,
    plate_page,
    tag_page,
)

pytest.importorskip("apriltag")
FAMILY = "tag36h11"
DPI = 150


def rasterised(pages: list[Page], folder: Path) -> list[list[Tag]]:
    """The tags on each page as a viewer draws them; corners in mm from the page's top left corner."""
    if shutil.which("pdftoppm") is None:
        pytest.skip("pdftoppm (poppler-utils) is not installed")
    (folder / "tags.pdf").write_bytes(write_pdf(pages, "Tags"))
    subprocess.run(["pdftoppm", "-r", str(DPI), "-gray", folder / "tags.pdf", folder / "page"], check=True)
    with Detector() as detector:
        seen = [detector.detect(read_grey(file)) for file in sorted(folder.glob("page*.pgm"))]
    return [[Tag(t.id, t.family, t.hamming, t.margin, (t.corners + 0.5) * 25.4 / DPI) for t in tags] for tags in seen]


def test_a_printed_tag_has_its_size_and_lies_in_the_middle_of_the_page(tmp_path: Path) -> None:
    ((tag,),) = rasterised([tag_page(Sheet.of("A4"), FAMILY, 7, 160)], tmp_path)
    middle, half = np.array([105, 148.5]), 80
    expected = middle + np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    assert tag.id == 7
    np.testing.assert_allclose(tag.corners, expected, atol=0.06)


def test_a_plate_is_cut_around_the_tag(tmp_path: Path) -> None:
    ((tag,),) = rasterised([plate_page(Sheet.of("A3", "280x280"), FAMILY, 3, 150)], tmp_path)
    np.testing.assert_allclose(tag.corners.mean(0), [148.5, 210], atol=0.06)


def test_a_bundle_on_one_page_has_the_spacing_that_it_names(tmp_path: Path) -> None:
    sheet = Sheet.of("A3")
    (tags,) = rasterised(bundle_pages(sheet, FAMILY, [20, 21, 22, 23], 100, 160), tmp_path)
    expected = np.array([148.5, 210]) + np.array(bundle_centres(160)) * [1, -1]
    assert [tag.id for tag in tags] == [20, 21, 22, 23]
    np.testing.assert_allclose([tag.corners.mean(0) for tag in tags], expected, atol=0.06)


def test_a_bundle_wider_than_the_paper_is_a_plan_and_four_pages(tmp_path: Path) -> None:
    pages = rasterised(bundle_pages(Sheet.of("A4"), FAMILY, [0, 1, 2, 3], 150, 600), tmp_path)
    assert [[tag.id for tag in tags] for tags in pages] == [[0, 1, 2, 3], [0], [1], [2], [3]]


@pytest.mark.parametrize("paper", ["A4", "A3", "Letter", "250x250", "120x160"])
def test_the_largest_sizes_offered_do_fit(paper: str) -> None:
    sheet = Sheet.of(paper)
    tag_page(sheet, FAMILY, 0, sheet.largest_tag(FAMILY))
    size = largest_bundle(sheet, FAMILY, None)
    assert len(bundle_pages(sheet, FAMILY, [0, 1, 2, 3], size, largest_spacing(sheet, FAMILY, size))) == 1
    assert len(bundle_pages(sheet, FAMILY, [0, 1, 2, 3], largest_bundle(sheet, FAMILY, 600), 600)) == 5


def test_what_does_not_fit_is_refused_with_what_would() -> None:
    with pytest.raises(InputError, match="at most 160 mm"):
        tag_page(Sheet.of("A4"), FAMILY, 0, 161)
    with pytest.raises(InputError, match="larger than the paper"):
        Sheet.of("A4", "280x280")
    with pytest.raises(InputError, match="overlap"):
        bundle_pages(Sheet.of("A4"), FAMILY, [0, 1, 2, 3], 100, 110)
    with pytest.raises(InputError, match="four different ids"):
        bundle_pages(Sheet.of("A4"), FAMILY, [0, 1, 1, 3], 50, 80)


def test_papers_are_known_by_name_or_by_size() -> None:
    assert paper_size("a4") == (210, 297)
    assert paper_size("300x200mm") == (300, 200)


@given(st.text(max_size=12))
def test_any_text_as_paper_or_ids_is_read_or_refused(text: str) -> None:
    for read in (paper_size, parse_ids):
        with contextlib.suppress(InputError):
            assert read(text)


def test_ids_are_ranges_and_lists() -> None:
    assert parse_ids("0-3, 7") == [0, 1, 2, 3, 7]
    with pytest.raises(InputError, match="expected"):
        parse_ids("3-1")
    with pytest.raises(InputError, match="at most 1000"):
        parse_ids("0-99999")


def test_the_file_is_a_valid_pdf_with_a_100_mm_ruler() -> None:
    page = tag_page(Sheet.of("A4"), FAMILY, 0, 100)
    content = write_pdf([page], "Tags")
    for number, offset in enumerate(re.findall(rb"(\d{10}) 00000 n", content), 1):
        assert content[int(offset) :].startswith(b"%d 0 obj" % number)
    start = int(re.search(rb"startxref\n(\d+)", content)[1])  # type: ignore[index]
    assert content[start:].startswith(b"xref")
    lengths = [
        (float(x1) - float(x0)) * 25.4 / 72
        for x0, y0, x1, y1 in re.findall(r"([\d.]+) ([\d.]+) m ([\d.]+) ([\d.]+) l S", page.content().decode())
        if y0 == y1
    ]
    assert max(lengths) == pytest.approx(100, abs=0.001)
    assert content == write_pdf([tag_page(Sheet.of("A4"), FAMILY, 0, 100)], "Tags")
