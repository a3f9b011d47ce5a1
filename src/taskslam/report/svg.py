"""A drawing as text: the few SVG elements that the figures need, always escaped, the same bytes every time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from markupsafe import Markup, escape

from taskslam.geometry import FloatArray
from taskslam.report.palette import on_page


class Svg:
    """An SVG drawing for a page in its own units, y downwards. `label` is what a screen reader says.

    Colours of the palette are written by their names, which the page's style sheet explains.
    """

    def __init__(
        self,
        width: float,
        height: float,
        label: str,
        kind: str = "drawing",
        stretched: bool = False,
        role: str = "img",
    ) -> None:
        """Begin a drawing. kind: its class in the page; stretched: it fills its box without keeping its proportions.

        role: `img`, or `group` if there are links in it, which a screen reader then finds.
        """
        stretch = 'preserveAspectRatio="none" ' if stretched else ""
        self._head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" class="{kind}" style="--width: {number(width)}px" {stretch}'
            f'viewBox="0 0 {number(width)} {number(height)}" '
            f'role="{role}" aria-label="{escape(label)}">'
        )
        self._parts: list[str] = []

    def add(self, tag: str, content: str | None = None, /, **attributes: object) -> None:
        """Append an element; `stroke_width=2` becomes `stroke-width="2"`, and `class_` becomes `class`."""
        head = f"<{tag}{_attributes(attributes)}"
        self._parts.append(f"{head}/>" if content is None else f"{head}>{escape(content)}</{tag}>")

    def line(self, x1: float, y1: float, x2: float, y2: float, **attributes: object) -> None:
        """Append a straight line."""
        self.add("line", x1=x1, y1=y1, x2=x2, y2=y2, **attributes)

    def polyline(self, points: FloatArray, **attributes: object) -> None:
        """Append an open line through (N, 2) points."""
        joined = " ".join(f"{number(x)},{number(y)}" for x, y in points.tolist())
        self.add("polyline", points=joined, fill="none", **attributes)

    def polygon(self, points: FloatArray, **attributes: object) -> None:
        """Append a closed shape through (N, 2) points."""
        joined = " ".join(f"{number(x)},{number(y)}" for x, y in points.tolist())
        self.add("polygon", points=joined, **attributes)

    def circle(self, x: float, y: float, radius: float, **attributes: object) -> None:
        """Append a circle."""
        self.add("circle", cx=x, cy=y, r=radius, **attributes)

    def text(self, x: float, y: float, content: str, **attributes: object) -> None:
        """Append a line of text with its baseline at y."""
        self.add("text", content, x=x, y=y, **attributes)

    @contextmanager
    def group(self, tag: str = "g", /, **attributes: object) -> Iterator[None]:
        """Elements added inside share these attributes. tag: `g`, or `a` for a link."""
        self._parts.append(f"<{tag}{_attributes(attributes)}>")
        yield
        self._parts.append(f"</{tag}>")

    @contextmanager
    def window(self, width: float, height: float) -> Iterator[None]:
        """Elements added inside are cut off at the edges of this rectangle at the origin."""
        self._parts.append(f'<svg width="{number(width)}" height="{number(height)}" overflow="hidden">')
        yield
        self._parts.append("</svg>")

    def markup(self) -> Markup:
        """The finished drawing, safe to place in a page."""
        return Markup(self._head + "".join(self._parts) + "</svg>")  # noqa: S704 every part was escaped above


def number(value: float) -> str:
    """A coordinate with at most two decimals."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _attributes(attributes: dict[str, object]) -> str:
    parts = []
    for name, value in attributes.items():
        text = number(value) if isinstance(value, float) else str(value)
        text = on_page(text) if name in ("fill", "stroke") else text
        parts.append(f' {name.rstrip("_").replace("_", "-")}="{escape(text)}"')
    return "".join(parts)
