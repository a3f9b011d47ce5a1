"""Calibration boards: what they look like, how they print, where their corners are seen.

Both kinds are fields of square cells, so that one bitmap serves the printer and the tests. A board is named as it is
written on its own footer: `charuco:8x6:28` has 8 by 6 squares of 28 mm, `aprilgrid:5x4:40` 5 by 4 tags of 40 mm.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.undistortion import Rectifier
from taskslam.realworld.extra import load_opencv
from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.pdf import Page
from taskslam.realworld.tags.tag_family import CELLS, DEFAULT_FAMILY, code_cells
from taskslam.realworld.tags.tag_sheets import FOOTER, MARGIN, draw_footer

_SQUARE_CELLS = 8  # of a ChArUco square; its marker of 4 x 4 bits and their border fills 6 of them
_MARKERS = 100
_TAG_CELLS = CELLS[DEFAULT_FAMILY]
_GAP_CELLS = 2  # between the tags of a grid: both white margins
_FEWEST_CORNERS = 6
_INSIDE_PX = 5.0  # a tag nearer to the image's edge may be cut


@dataclass(frozen=True, eq=False)
class Found:
    """Corners of a board. points: (N, 3) on it, m; pixels: (N, 2); outward: (N, 2), see `calibration.View`."""

    points: FloatArray
    pixels: FloatArray
    outward: FloatArray


class Board(Protocol):
    """A printed pattern of known geometry."""

    @property
    def spec(self) -> str:
        """Its name, from which `parse_board` makes it again."""

    @property
    def cell(self) -> float:
        """Side of a cell, m."""

    def cells(self) -> npt.NDArray[np.bool_]:
        """(rows, columns), True where white."""


@dataclass(frozen=True, slots=True)
class CharucoBoard:
    """A chessboard with ArUco markers (4 x 4 bits) in its white squares. square: side, m."""

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3 or self.columns * self.rows > 2 * _MARKERS or not 0.002 <= self.square <= 1:
            raise InputError(
                f"{self.spec}: expected at least 3 x 3 and at most {2 * _MARKERS} squares of 2 to 1000 mm each"
            )

    @property
    def spec(self) -> str:
        """As on the footer."""
        return f"charuco:{self.columns}x{self.rows}:{self.square * 1000:g}"

    @property
    def cell(self) -> float:
        """Side of a cell, m."""
        return self.square / _SQUARE_CELLS

    def cells(self) -> npt.NDArray[np.bool_]:
        """(rows, columns) as OpenCV draws the board at one pixel a cell."""
        size = (self.columns * _SQUARE_CELLS, self.rows * _SQUARE_CELLS)
        return np.asarray(self.opencv().generateImage(size, marginSize=0, borderBits=1) > 127)

    def opencv(self) -> Any:
        """OpenCV's board of the same name."""
        cv2 = load_opencv()
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
        marker = self.square * (_SQUARE_CELLS - 2) / _SQUARE_CELLS
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, marker, dictionary)


@dataclass(frozen=True, slots=True)
class AprilGrid:
    """Tags of family tag36h11 in a grid, ids from 0 in reading order, a quarter of a tag apart. size: of a tag, m."""

    columns: int
    rows: int
    size: float

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 1 or not 2 <= self.columns * self.rows <= 500 or not 0.005 <= self.size <= 2:
            raise InputError(f"{self.spec}: expected 2 to 500 tags of 5 to 2000 mm each")

    @property
    def spec(self) -> str:
        """As on the footer."""
        return f"aprilgrid:{self.columns}x{self.rows}:{self.size * 1000:g}"

    @property
    def cell(self) -> float:
        """Side of a cell, m."""
        return self.size / _TAG_CELLS

    @property
    def count(self) -> int:
        """Number of tags."""
        return self.columns * self.rows

    def cells(self) -> npt.NDArray[np.bool_]:
        """(rows, columns); no white margin around the whole."""
        step = _TAG_CELLS + _GAP_CELLS
        field = np.ones((self.rows * step - _GAP_CELLS, self.columns * step - _GAP_CELLS), np.bool_)
        for number in range(self.count):
            row, column = (step * n for n in divmod(number, self.columns))
            field[row : row + _TAG_CELLS, column : column + _TAG_CELLS] = code_cells(DEFAULT_FAMILY, number)
        return field

    def corners(self, number: int) -> FloatArray:
        """(4, 3) corners TL, TR, BR, BL of a tag, m: x to the right, y down, from the board's top left."""
        row, column = divmod(number, self.columns)
        square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
        return np.asarray((square * _TAG_CELLS + np.array([column, row, 0]) * (_TAG_CELLS + _GAP_CELLS)) * self.cell)


def parse_board(text: str) -> CharucoBoard | AprilGrid:
    """A board from its name, such as `charuco:8x6:28` or `aprilgrid:5x4:40` (mm). Raises InputError."""
    match = re.fullmatch(r"\s*(charuco|aprilgrid):(\d{1,3})x(\d{1,3}):(\d{1,4}(?:\.\d{1,4})?)\s*", text, re.IGNORECASE)
    if match is None:
        raise InputError(f"board '{text}': expected charuco:COLUMNSxROWS:MM or aprilgrid:COLUMNSxROWS:MM")
    kind = CharucoBoard if match[1].lower() == "charuco" else AprilGrid
    return kind(int(match[2]), int(match[3]), float(match[4]) / 1000)


def largest_board(kind: str, columns: int, rows: int, paper: tuple[float, float]) -> CharucoBoard | AprilGrid:
    """The largest board, in whole mm of its square or tag, on a paper (mm) turned as suits it. Raises InputError."""
    one = parse_board(f"{kind}:{columns}x{rows}:100")
    height, width = one.cells().shape
    page = _turned(paper, width >= height)
    room = page[0] - 2 * MARGIN, page[1] - 2 * MARGIN - FOOTER
    size = math.floor(100 * min(room[0] / width, room[1] / height) / (one.cell * 1000))
    return parse_board(f"{kind}:{columns}x{rows}:{size}")


def board_page(board: Board, paper: tuple[float, float]) -> Page:
    """The board on a paper (width, height in mm, turned as suits it). Raises InputError if it does not fit."""
    cells = board.cells()
    side = board.cell * 1000
    height, width = (n * side for n in cells.shape)
    page = Page(*_turned(paper, width >= height))
    if width > page.width - 2 * MARGIN + 1e-6 or height > page.height - 2 * MARGIN - FOOTER + 1e-6:
        raise InputError(f"{board.spec}: {width:g} x {height:g} mm do not fit on {page.width:g} x {page.height:g} mm")
    free = page.height - 2 * MARGIN - FOOTER - height
    page.cells(~cells, (page.width - width) / 2, MARGIN + free / 2, side)
    lines = [
        f"taskslam camera calibrate IMAGES --board {board.spec}",
        "Print at 100 %, glue it flat on a stiff board, measure and correct the millimetres in the name.",
    ]
    draw_footer(page, (page.width, page.height), lines)
    return page


class BoardFinder:
    """Finds a board's corners in grey images; a context manager."""

    def __init__(self, board: CharucoBoard | AprilGrid) -> None:
        self._board = board
        self._tags: Detector | None = None
        self._charuco: Any = None
        self._points = np.empty((0, 3))
        if isinstance(board, AprilGrid):
            self._tags = Detector(DEFAULT_FAMILY, range(board.count))
        else:
            charuco = board.opencv()
            self._charuco = load_opencv().aruco.CharucoDetector(charuco)
            self._points = np.asarray(charuco.getChessboardCorners(), np.float64)

    def __enter__(self) -> BoardFinder:
        return self

    def __exit__(self, *_: object) -> None:
        if self._tags is not None:
            self._tags.close()

    @property
    def wants_rectified(self) -> bool:
        """Whether corners become better in rectified images: those of tags do, those between squares do not."""
        return self._tags is not None

    def find(
        self, image: npt.NDArray[np.uint8], name: str = "image", rectifier: Rectifier | None = None
    ) -> Found | None:
        """The corners in a raw image; None where too few are seen to be of use.

        rectifier: look in the rectified image, and bend what is found back.

        Raises:
            DetectorError: the tag detector died over the image.
        """
        if isinstance(self._board, AprilGrid):
            return _usable(self._find_tags(image, name, self._board, rectifier))
        corners, ids, _, _ = self._charuco.detectBoard(image)
        if ids is None:
            return None
        pixels = np.asarray(corners, np.float64).reshape(-1, 2)
        return _usable(Found(self._points[ids.ravel()], pixels, np.zeros_like(pixels)))

    def _find_tags(
        self, image: npt.NDArray[np.uint8], name: str, board: AprilGrid, rectifier: Rectifier | None
    ) -> Found:
        assert self._tags is not None
        tags = self._tags.detect(rectifier.image(image) if rectifier else image, name)
        once = [tag for tag in tags if sum(other.id == tag.id for other in tags) == 1]
        seen = np.array([tag.corners for tag in once]).reshape(-1, 2)
        outward = _outward(seen.reshape(-1, 4, 2)).reshape(-1, 2)
        if rectifier:
            outward = rectifier.raw(seen + outward / 2) - rectifier.raw(seen - outward / 2)
            seen = rectifier.raw(seen)
        points = np.array([board.corners(tag.id) for tag in once]).reshape(-1, 3)
        high = np.array(image.shape[::-1]) - 1 - _INSIDE_PX
        inside = ((seen >= _INSIDE_PX) & (seen <= high)).all(1).reshape(-1, 4).all(1).repeat(4)
        return Found(points[inside], seen[inside], outward[inside])


def _outward(corners: FloatArray) -> FloatArray:
    """(N, 4, 2) where the corners TL, TR, BR, BL of N squares move if all four edges move outwards by one pixel."""
    after = np.roll(corners, -1, axis=1) - corners
    after /= np.linalg.norm(after, axis=2, keepdims=True)
    normal_after = np.stack([after[..., 1], -after[..., 0]], axis=2)  # the interior lies to the right of each edge
    normal_before = np.roll(normal_after, 1, axis=1)
    along = 1 + (normal_after * normal_before).sum(2, keepdims=True)
    return np.asarray((normal_after + normal_before) / along)


def _usable(found: Found) -> Found | None:
    """Not with few corners, nor with all on one line of the board."""
    if len(found.points) < _FEWEST_CORNERS or not np.isfinite(found.pixels).all():
        return None
    spread = np.linalg.svd(found.points[:, :2] - found.points[:, :2].mean(0), compute_uv=False)
    return None if spread[1] < 0.1 * spread[0] else found


def _turned(paper: tuple[float, float], wide: bool) -> tuple[float, float]:
    return (max(paper), min(paper)) if wide else (min(paper), max(paper))
