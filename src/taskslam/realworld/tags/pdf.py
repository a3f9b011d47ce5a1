"""A small PDF writer for exact drawings: filled shapes, lines and text in millimetres, from the page's top left corner.

PDF 1.4 (ISO 32000-1), standard fonts, no compression, no dates: the same drawing gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

_POINTS_PER_MM = 72 / 25.4
_FONTS = ("Helvetica", "Helvetica-Bold")
# Advance widths of Helvetica, thousandths of an em, for the characters 32 to 126 (Adobe's font metrics).
_WIDTHS = (
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556,
    833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500,
    556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500,
    334, 260, 334, 584,
)  # fmt: skip

_UTF16_MARK = "\ufeff"

Point = tuple[float, float]


class Page:
    """One page, width x height mm; x to the right, y down. Everything is drawn in the order of the calls."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = width, height
        self._content: list[str] = []

    def cells(self, black: npt.NDArray[np.bool_], x: float, y: float, side: float) -> None:
        """Square cells (rows, columns), True where black, `side` mm each, the first with its top left corner at (x, y).

        One path, so that no viewer shows seams between neighbouring cells.
        """
        path = []
        for row, line in enumerate(black):
            edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(np.int8)))
            for start, end in zip(edges[::2], edges[1::2], strict=True):
                path.append(self._rectangle(x + start * side, y + row * side, (end - start) * side, side))
        self._content.append(" ".join(path) + " f")

    def rectangle(self, x: float, y: float, width: float, height: float) -> None:
        """A black rectangle with its top left corner at (x, y)."""
        self._content.append(self._rectangle(x, y, width, height) + " f")

    def polygon(self, points: Sequence[Point]) -> None:
        """A black polygon."""
        self._content.append(self._path(points) + " h f")

    def line(self, points: Sequence[Point], width: float = 0.2, grey: float = 0.0, dash: float = 0.0) -> None:
        """A line through `points`, `width` mm wide; grey: 0 black to 1 white; dash: mm, 0 for none."""
        pattern = f"[{_points(dash)}] 0 d" if dash else ""
        self._content.append(f"q {_points(width)} w {grey:.2f} G {pattern} {self._path(points)} S Q")

    def text(self, x: float, y: float, text: str, size: float = 3.5, bold: bool = False, anchor: str = "start") -> None:
        """One line of text, baseline at y; size: mm of the em. anchor: start, middle or end of the text is at x."""
        x -= {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * text_width(text, size)
        data = text.encode("cp1252", "replace").hex()
        self._content.append(
            f"BT /F{int(bold)} {_points(size)} Tf {_points(x)} {_points(self.height - y)} Td <{data}> Tj ET"
        )

    def content(self) -> bytes:
        """The page's content stream."""
        return "\n".join(self._content).encode("ascii")

    def _rectangle(self, x: float, y: float, width: float, height: float) -> str:
        return f"{_points(x)} {_points(self.height - y - height)} {_points(width)} {_points(height)} re"

    def _path(self, points: Sequence[Point]) -> str:
        steps = [f"{_points(x)} {_points(self.height - y)}" for x, y in points]
        return f"{steps[0]} m " + " ".join(f"{step} l" for step in steps[1:])


def text_width(text: str, size: float) -> float:
    """Width, mm, of a line of text in Helvetica of `size` mm, good enough to centre it."""
    return sum(_WIDTHS[ord(c) - 32] if 32 <= ord(c) <= 126 else 556 for c in text) * size / 1000


def write_pdf(pages: Iterable[Page], title: str) -> bytes:
    """The bytes of a PDF file. It asks viewers to print at full size."""
    fonts = [f"<< /Type /Font /Subtype /Type1 /BaseFont /{f} /Encoding /WinAnsiEncoding >>" for f in _FONTS]
    bodies: list[bytes] = [b"", b"", *(font.encode() for font in fonts)]
    kids = []
    resources = " ".join(f"/F{i} {i + 3} 0 R" for i in range(len(fonts)))
    for page in pages:
        content = page.content()
        bodies.append(b"<< /Length %d >>\nstream\n%b\nendstream" % (len(content), content))
        box = f"[0 0 {_points(page.width)} {_points(page.height)}]"
        bodies.append(
            f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents {len(bodies)} 0 R "
            f"/Resources << /Font << {resources} >> >> >>".encode()
        )
        kids.append(f"{len(bodies)} 0 R")
    bodies.append(f"<< /Title <{(_UTF16_MARK + title).encode('utf-16-be').hex()}> /Producer (taskslam) >>".encode())
    bodies[0] = b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>"
    bodies[1] = f"<< /Type /Pages /Kids [{' '.join(kids)}] /Count {len(kids)} >>".encode()

    out = bytearray(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
    offsets = []
    for number, body in enumerate(bodies, 1):
        offsets.append(len(out))
        out += b"%d 0 obj\n%b\nendobj\n" % (number, body)
    start = len(out)
    out += b"xref\n0 %d\n0000000000 65535 f \n" % (len(bodies) + 1)
    out += b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    out += b"trailer\n<< /Size %d /Root 1 0 R /Info %d 0 R >>\n" % (len(bodies) + 1, len(bodies))
    return bytes(out + b"startxref\n%d\n%%%%EOF\n" % start)


def _points(mm: float) -> str:
    return f"{mm * _POINTS_PER_MM:.4f}".rstrip("0").rstrip(".")
