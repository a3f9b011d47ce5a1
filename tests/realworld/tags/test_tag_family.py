from __future__ import annotations

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.tag_family import CELLS, code_cells, family_size

pytest.importorskip("apriltag")


@pytest.mark.parametrize("family", CELLS)
def test_our_own_drawing_of_a_tag_is_read_back_upright(family: str) -> None:
    number = family_size(family) - 1
    cells = code_cells(family, number)
    image = np.full((160, 200), 230, np.uint8)
    side = 10 * len(cells)
    image[30 : 30 + side, 50 : 50 + side] = np.kron(np.where(cells, 230, 20), np.ones((10, 10))).astype(np.uint8)
    with Detector(family) as detector:
        (tag,) = detector.detect(image)
    left, top, right, bottom = 49.5, 29.5, 49.5 + side, 29.5 + side
    assert tag.id == number
    assert tag.hamming == 0
    np.testing.assert_allclose(tag.corners, [[left, top], [right, top], [right, bottom], [left, bottom]], atol=0.1)


@pytest.mark.parametrize("family", CELLS)
def test_cells_hold_the_black_border_and_nothing_outside_it(family: str) -> None:
    cells = code_cells(family, 0)
    assert cells.shape == (CELLS[family], CELLS[family])
    assert not cells[[0, -1]].any()
    assert not cells[:, [0, -1]].any()
    assert cells.any()


def test_no_two_tags_are_alike_however_turned() -> None:
    seen = {np.rot90(code_cells("tag36h11", i), turn).tobytes() for i in range(587) for turn in range(4)}
    assert len(seen) == 4 * 587


@pytest.mark.parametrize(("family", "number"), [("tag36h11", 587), ("tag36h11", -1), ("tag16h5", 0), ("tag36h12", 0)])
def test_an_unknown_tag_is_refused_in_a_sentence(family: str, number: int) -> None:
    with pytest.raises(InputError, match="expected"):
        code_cells(family, number)
