"""Sheets to print: single tags, bundles of four for a ceiling, plates for a robot's top; exact in millimetres.

A tag's size is the side of its black square, outer edge to outer edge. Around it goes a white quiet zone of one cell.
Each tag has a mark on the side of its artwork's top, which is the x axis of its frame, and lies in the middle of its
page or plate. Each page has a ruler, since many printers shrink a page without being asked to.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from taskslam.errors import InputError, did_you_mean
from taskslam.realworld.tags.pdf import Page, text_width
from taskslam.realworld.tags.tag_family import CELLS, code_cells

PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "Letter": (215.9, 279.4)}

MARGIN = 5.0  # mm that many printers leave white
FOOTER = 25.0  # mm for text and ruler, and as much above for the mark of the top
_SMALLEST, _LARGEST = 5.0, 3000.0
_MOST_IDS = 1000
_CORNERS = ("top left", "top right", "bottom right", "bottom left")


@dataclass(frozen=True, slots=True)
class Sheet:
    """What to print on. paper, area: width and height, mm; area: the part that is used, in the paper's middle.

    An area smaller than the paper is drawn as a line to cut along.
    """

    paper: tuple[float, float]
    area: tuple[float, float]

    @classmethod
    def of(cls, paper: str, area: str = "") -> Sheet:
        """From names: a paper of `PAPERS` or WIDTHxHEIGHT in mm; area: the same, the whole paper where empty.

        Raises:
            InputError: neither, out of range, or an area larger than the paper.
        """
        size = paper_size(paper)
        used = paper_size(area) if area else size
        if used[0] > size[0] or used[1] > size[1]:
            raise InputError(f"plate of {_by(used)}: larger than the paper of {_by(size)}")
        return cls(size, used)

    @property
    def room(self) -> float:
        """Side (mm) of the square in the middle that text and ruler leave free."""
        return min(self.area[0], self.area[1] - 2 * FOOTER) - 2 * MARGIN

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of paper and area, mm."""
        return self.paper[0] / 2, self.paper[1] / 2

    def largest_tag(self, family: str) -> float:
        """Largest size (mm) of one tag on this sheet, rounded down to 10 mm, or to 1 mm where it is below 50 mm."""
        return _rounded(self.room / _outline(family))


def paper_size(text: str) -> tuple[float, float]:
    """Width and height (mm) of a paper's name or of WIDTHxHEIGHT. Raises InputError."""
    for name, size in PAPERS.items():
        if text.lower() == name.lower():
            return size
    match = re.fullmatch(r"\s*([0-9.]{1,9})\s*[xX×]\s*([0-9.]{1,9})\s*(?:mm)?\s*", text)
    try:
        width, height = (float(part) for part in match.groups()) if match else (0.0, 0.0)
    except ValueError:
        width = height = 0.0
    if not (10 <= width <= _LARGEST and 10 <= height <= _LARGEST):
        raise InputError(
            f"paper '{text}': expected {', '.join(PAPERS)} or WIDTHxHEIGHT in mm, 10 to {_LARGEST:g} each."
            f"{did_you_mean(text, PAPERS)}"
        )
    return width, height


def parse_ids(text: str) -> list[int]:
    """Ids from a text such as `0-3,7`. Raises InputError unless it names at most 1000 of them."""
    ids: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,5})(?:\s*-\s*(\d{1,5}))?\s*", part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if last < first or len(ids) + last - first >= _MOST_IDS:
            raise InputError(f"ids '{text}': expected 7, 0-3 or 0,4,9, at most {_MOST_IDS}")
        ids.extend(range(first, last + 1))
    return ids


def tag_page(sheet: Sheet, family: str, tag_id: int, size: float, mark: str = "TOP", note: str = "") -> Page:
    """A page with one tag in the middle. size: mm. mark: the word at its top; note: a line in the footer.

    Raises:
        InputError: it does not fit, or no such tag.
    """
    _check_size(size)
    if size * _outline(family) > sheet.room + 1e-6:
        raise InputError(
            f"a tag of {size:g} mm with its white margin does not fit on {_by(sheet.area)}; "
            f"expected at most {sheet.largest_tag(family):g} mm"
        )
    page = _blank(sheet)
    middle = sheet.middle
    _tag(page, family, tag_id, size, middle)
    _mark(page, middle[0], middle[1] - size / 2 * _outline(family) - 2, mark)
    _centre_ticks(page, middle, size, family)
    draw_footer(page, sheet.area, [f"{family}  id {tag_id}  {size:g} mm", note or _PRINTING.format(size=f"{size:g}")])
    return page


def plate_page(sheet: Sheet, family: str, tag_id: int, size: float) -> Page:
    """A page for a robot's top: as `tag_page`, with the mark to the robot's front. Raises InputError."""
    page = tag_page(sheet, family, tag_id, size, "FRONT OF THE ROBOT")
    left, top, bottom = _frame(sheet)
    right, (x, y) = sheet.paper[0] - left, sheet.middle
    for line in ([(x, top), (x, top + 4)], [(x, bottom - 4), (x, bottom)]):
        page.line(line, 0.3)
    for line in ([(left, y), (left + 4, y)], [(right - 4, y), (right, y)]):
        page.line(line, 0.3)
    return page


def bundle_centres(spacing: float) -> list[tuple[float, float]]:
    """Centres of a bundle's four tags about its middle, mm to the right and up: clockwise from the top left."""
    half = spacing / 2
    return [(-half, half), (half, half), (half, -half), (-half, -half)]


def largest_spacing(sheet: Sheet, family: str, size: float) -> float:
    """Largest distance (mm) between neighbouring centres of a bundle on one sheet; negative if it does not fit."""
    return math.floor(sheet.room - size * _outline(family))


def largest_bundle(sheet: Sheet, family: str, spacing: float | None) -> float:
    """Largest size (mm) of a bundle's tags: on pages of their own where `spacing` is wider than the sheet.

    Without a spacing, four tags with a gap of one white margin more between them.
    """
    if spacing is not None and spacing > sheet.room:
        return min(sheet.largest_tag(family), _rounded(spacing / _outline(family)))
    if spacing is None:
        return _rounded(sheet.room / (2 * _outline(family) + 1 / CELLS[family]))
    return _rounded(min(sheet.room - spacing, spacing) / _outline(family))


def bundle_pages(sheet: Sheet, family: str, ids: Sequence[int], size: float, spacing: float) -> list[Page]:
    """A bundle of four tags: one page where it fits, else a page with a plan and one for each tag.

    ids: clockwise from the top left. size, spacing (between the centres of neighbours): mm.

    Raises:
        InputError: not four different ids, or tags that overlap or do not fit.
    """
    if len(set(ids)) != 4:
        raise InputError(f"bundle of ids {list(ids)}: expected four different ids")
    _check_size(size)
    if spacing < size * _outline(family) or spacing > 10 * _LARGEST:
        raise InputError(
            f"tags of {size:g} mm with {spacing:g} mm between centres overlap or lie too far apart; "
            f"expected {math.ceil(size * _outline(family))} to {10 * _LARGEST:g} mm"
        )
    title = f"{family}  ids {ids[0]} {ids[1]} {ids[2]} {ids[3]} clockwise  {size:g} mm  centres {spacing:g} mm apart"
    if spacing <= largest_spacing(sheet, family, size):
        page = _blank(sheet)
        middle = sheet.middle
        for tag_id, (right, up) in zip(ids, bundle_centres(spacing), strict=True):
            _tag(page, family, tag_id, size, (middle[0] + right, middle[1] - up))
        _mark(page, middle[0], middle[1] - spacing / 2 - size / 2 * _outline(family) - 2, "TOP")
        page.line([(middle[0] - 3, middle[1]), (middle[0] + 3, middle[1])], 0.2)
        page.line([(middle[0], middle[1] - 3), (middle[0], middle[1] + 3)], 0.2)
        draw_footer(page, sheet.area, [title, _PRINTING.format(size=f"{size:g}")])
        return [page]
    pages = [_plan(sheet, family, ids, size, spacing, title)]
    for tag_id, corner in zip(ids, _CORNERS, strict=True):
        pages.append(
            tag_page(sheet, family, tag_id, size, "TOP", f"{corner.capitalize()} of bundle {ids[0]} to {ids[3]}")
        )
    return pages


_PRINTING = "Print at 100 %. Check the ruler, then measure the black square: {size} mm. Keep the white margin."


def _outline(family: str) -> float:
    """Side of a tag with its white margin, as a multiple of its size."""
    return 1 + 2 / CELLS[family]


def _rounded(size: float) -> float:
    step = 10 if size >= 50 else 1
    return max(0.0, math.floor(size / step + 1e-9) * step)


def _check_size(size: float) -> None:
    if not _SMALLEST <= size <= _LARGEST:
        raise InputError(f"tag of {size:g} mm: expected {_SMALLEST:g} to {_LARGEST:g} mm")


def _by(size: tuple[float, float]) -> str:
    return f"{size[0]:g} x {size[1]:g} mm"


def _frame(sheet: Sheet) -> tuple[float, float, float]:
    """Left, top and bottom of the used area on the page, mm."""
    top = (sheet.paper[1] - sheet.area[1]) / 2
    return (sheet.paper[0] - sheet.area[0]) / 2, top, sheet.paper[1] - top


def _blank(sheet: Sheet) -> Page:
    page = Page(*sheet.paper)
    if sheet.area != sheet.paper:
        left, top, bottom = _frame(sheet)
        right = sheet.paper[0] - left
        page.line([(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], 0.15, grey=0.5)
    return page


def _tag(page: Page, family: str, tag_id: int, size: float, middle: tuple[float, float]) -> None:
    cells = code_cells(family, tag_id)
    page.cells(~cells, middle[0] - size / 2, middle[1] - size / 2, size / len(cells))


def _mark(page: Page, x: float, y: float, word: str) -> None:
    """An arrowhead that points up, its base at (x, y), and a word beside it."""
    page.polygon([(x - 3, y), (x + 3, y), (x, y - 6)])
    page.text(x + 5, y - 1, word, 3.5, bold=True)


def _centre_ticks(page: Page, middle: tuple[float, float], size: float, family: str) -> None:
    """Short lines at the edge of the white margin, level with the tag's centre, to measure between tags."""
    reach = size / 2 * _outline(family)
    x, y = middle
    if x - reach - 3 < 0:
        return
    for sign in (-1, 1):
        page.line([(x + sign * reach, y), (x + sign * (reach + 3), y)], 0.2)
    page.line([(x, y + reach), (x, y + reach + 3)], 0.2)


def draw_footer(page: Page, area: tuple[float, float], lines: Sequence[str]) -> None:
    """Two lines of text and a ruler of 100 mm, or as much as fits, at the bottom of an area in the page's middle."""
    x = (page.width - area[0]) / 2 + MARGIN + 2
    bottom = (page.height + area[1]) / 2
    room = area[0] - 2 * (MARGIN + 2)
    length = min(100, math.floor((room - 1) / 10) * 10)
    y = bottom - MARGIN - 3
    page.text(x, y - 15, lines[0], _fit(lines[0], room, 4.2), bold=True)
    page.text(x, y - 10.5, lines[1], _fit(lines[1], room, 2.9))
    page.line([(x, y), (x + length, y)], 0.25)
    for at in range(length + 1):
        tall = 3.5 if at % 10 == 0 else 2.2 if at % 5 == 0 else 1.3
        page.line([(x + at, y), (x + at, y - tall)], 0.2 if at % 10 == 0 else 0.1)
    for at in range(0, length + 1, 50):
        page.text(x + at, y - 4.3, f"{at} mm" if at else "0", 2.5, anchor="middle" if at else "start")


def _fit(text: str, room: float, size: float) -> float:
    return min(size, size * room / (text_width(text, size) * 1.08))


def _plan(sheet: Sheet, family: str, ids: Sequence[int], size: float, spacing: float, title: str) -> Page:
    """How the four pages of a bundle go together, to scale."""
    page = _blank(sheet)
    side = size * _outline(family)
    scale = (sheet.room - 10) / (spacing + side)
    (x, y), edge = sheet.middle, side / 2 * scale
    for tag_id, (right, up) in zip(ids, bundle_centres(spacing * scale), strict=True):
        _tag(page, family, tag_id, size * scale, (x + right, y - up))
        page.text(x + right, y - up + edge + 4, f"id {tag_id}", 4, anchor="middle")
    half = spacing / 2 * scale
    inner = half - edge
    page.line([(x - inner, y - half), (x + inner, y - half)], 0.2, grey=0.5, dash=2)
    page.line([(x - inner, y - inner), (x + inner, y + inner)], 0.2, grey=0.5, dash=2)
    page.line([(x - half, y - inner + 8), (x - half, y + inner)], 0.2, grey=0.5, dash=2)
    page.text(x, y - half - 2, f"{spacing:g} mm", 4, anchor="middle")
    page.text(x - half + 2, y, f"{spacing:g} mm", 4)
    page.text(x + 4, y - 2, f"{spacing * math.sqrt(2):.0f} mm", 4)
    _mark(page, x, y - half - edge - 2, "TOP")
    draw_footer(
        page,
        sheet.area,
        [title, "Plan, not to scale: mount the tags in one plane, centres as far apart as written here."],
    )
    return page
