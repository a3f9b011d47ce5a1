"""How every printed figure looks, and how it is saved: the same input gives the same bytes.

    @printed
    def a_figure(...) -> Figure:
        figure = new_figure(COLUMN, 2.4)
        axes = figure.subplots()
        axes.plot(x, y, **line_style(style), **marker_style(style, filled=True))
        return figure

    save_figure(a_figure(...), Path("figures"), "name", ("pdf", "svg", "png"))

Sizes are inches on paper and points. Nothing here, or in what uses it, touches pyplot or keeps global settings.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeAlias, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from taskslam.files import write_whole, writing
from taskslam.report import palette
from taskslam.report.markers import Style

Width: TypeAlias = Literal["column", "page"]
Format: TypeAlias = Literal["pdf", "svg", "png"]
FORMATS: tuple[Format, ...] = ("pdf", "svg", "png")

COLUMN, PAGE = 3.5, 7.16  # in: one column and both columns of an IEEE page
WIDTHS: dict[Width, float] = {"column": COLUMN, "page": PAGE}
SMALL, NORMAL = 7.0, 7.5  # pt: nothing on a figure is smaller than SMALL
DPI = 300
FONT = "DejaVu Sans"  # comes with matplotlib

P = ParamSpec("P")
R = TypeVar("R")

# What a user's own matplotlibrc says must not change a result; the backend is chosen by the canvas, not by a setting.
_DEFAULTS = {key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith(("backend", "interactive"))}
_SETTINGS = {
    **_DEFAULTS,
    "font.family": FONT,
    "mathtext.fontset": "dejavusans",
    "font.size": SMALL,
    "axes.labelsize": NORMAL,
    "axes.titlesize": NORMAL,
    "axes.titlepad": 4.0,
    "axes.labelpad": 2.5,
    "axes.linewidth": 0.6,
    "axes.edgecolor": palette.MUTED,
    "axes.labelcolor": palette.INK,
    "axes.titlecolor": palette.INK,
    "axes.axisbelow": True,
    "axes.grid": False,
    "text.color": palette.INK,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "xtick.color": palette.MUTED,
    "ytick.color": palette.MUTED,
    "xtick.labelcolor": palette.INK,
    "ytick.labelcolor": palette.INK,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.pad": 2.0,
    "ytick.major.pad": 2.0,
    "grid.color": palette.HAIRLINE,
    "grid.linewidth": 0.5,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "lines.markersize": 4.5,
    "hatch.linewidth": 0.5,
    "figure.constrained_layout.h_pad": 0.02,
    "figure.constrained_layout.w_pad": 0.02,
    "savefig.dpi": DPI,
    "svg.hashsalt": "taskslam",
    "svg.fonttype": "path",  # looks the same where the font is missing
    "pdf.fonttype": 42,  # IEEE and others refuse Type 3
}
_METADATA: dict[Format, dict[str, str | None]] = {
    "pdf": {"Creator": "TaskSLAM-Bench", "Producer": None, "CreationDate": None},
    "svg": {"Creator": "TaskSLAM-Bench", "Date": None},
    "png": {"Software": None},
}

# For each shape of `markers.Style`: matplotlib's marker, and its size beside a circle's.
_MARKERS = (("o", 1.0), ("s", 0.92), ("^", 1.08), ("D", 0.86), ("v", 1.08), ("p", 1.14), ("*", 1.55))


def printed(draw: Callable[P, R]) -> Callable[P, R]:
    """Decorator: run a function that draws under the settings of printed figures, and restore the caller's after."""
    decorated: Callable[P, R] = mpl.rc_context(_SETTINGS)(draw)
    return decorated


def new_figure(width: float, height: float, constrained: bool = True) -> Figure:
    """An empty figure of so many inches on paper.

    constrained: axes are laid out so that nothing is cut off or overlaps; else `add_axes` says where they stand.
    """
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained" if constrained else None)
    FigureCanvasAgg(figure)
    return figure


def add_axes(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Axes whose frame stands so many inches from the figure's left and top edges."""
    whole_width, whole_height = figure.get_size_inches()
    bottom = whole_height - top - height
    return figure.add_axes((left / whole_width, bottom / whole_height, width / whole_width, height / whole_height))


def marker_style(style: Style, filled: bool = True, size: float = 4.5) -> dict[str, Any]:
    """Keywords of `Axes.plot` for a method's marker; hollow where the figure says so. size: points of a circle."""
    marker, beside = _MARKERS[style.shape]
    return {
        "marker": marker,
        "markersize": size * beside,
        "markerfacecolor": style.colour if filled else "white",
        "markeredgecolor": style.colour,
        "markeredgewidth": 1.1,
    }


def line_style(style: Style) -> dict[str, Any]:
    """Keywords of `Axes.plot` for a method's line."""
    return {"color": style.colour, "linewidth": 1.1, "solid_joinstyle": "round", "solid_capstyle": "round"}


def say_empty(axes: Axes) -> None:
    """Say in a panel that no method of it has a precision: one round, no complete waypoint, or no true pose."""
    axes.text(
        0.5, 0.5, "no precision to show", transform=axes.transAxes, ha="center", va="center", color=palette.MUTED,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 2},
    )  # fmt: skip


@printed
def figure_bytes(figure: Figure, kind: Format) -> bytes:
    """The figure as a file: no date, no machine, fixed identifiers."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=DPI, metadata=_METADATA[kind])
    return buffer.getvalue()


def save_figure(figure: Figure, folder: Path, name: str, formats: Sequence[Format]) -> list[Path]:
    """Write `name` in each format below a folder, which is made; returns the paths. Raises DiskFullError."""
    paths = [folder / f"{name}.{kind}" for kind in formats]
    with writing(folder):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    for path, kind in zip(paths, formats, strict=True):
        write_whole(path, figure_bytes(figure, kind))
    return paths
