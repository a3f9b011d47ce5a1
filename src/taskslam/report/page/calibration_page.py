"""A camera's calibration as one self-contained page: parameters, where the image was covered, every view."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import jinja2
import numpy as np
from markupsafe import Markup
from PIL import Image

from taskslam.files import write_whole, writing
from taskslam.geometry import FloatArray
from taskslam.printable import printable
from taskslam.realworld.cameras.calibration import Calibration, FittedView
from taskslam.realworld.cameras.calibration_guidance import guidance
from taskslam.realworld.cameras.images import GreyImage
from taskslam.report.palette import BLUE, HAIRLINE, INK, MUTED, VERMILION, style_sheet
from taskslam.report.svg import Svg

_WIDTH = 480.0
_MOST_DOTS = 6000
_THUMBNAIL = 360  # px
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


def write_calibration_page(
    calibration: Calibration, refused: Sequence[tuple[str, str]], board: str, file: str, out: Path
) -> None:
    """Write the page. refused: name and reason of pictures without a use; file: where the camera was written.

    Raises:
        DiskFullError, RecordError: it cannot be written.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("taskslam.report.page"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    style = resources.files("taskslam.report.page").joinpath("templates", "style.css").read_text(encoding="utf-8")
    views = sorted(calibration.views, key=lambda fitted: (fitted.used, -fitted.rms))
    text = environment.get_template("calibration.html").render(
        calibration=calibration,
        camera=calibration.camera,
        board=board,
        file=file,
        advice=guidance(calibration),
        refused=refused,
        policy=_POLICY,
        style=Markup(style_sheet() + style),  # noqa: S704 our own file, no input in it
        covered=_covered(calibration),
        unsure=_unsure(calibration),
        scatter=_scatter(calibration),
        views=[(fitted, _picture(calibration, fitted)) for fitted in views],
    )
    with writing(out):
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, printable(text))


def _covered(calibration: Calibration) -> Markup:
    """Every corner of the used views, where it was seen."""
    camera = calibration.camera
    scale = _WIDTH / camera.width
    svg = Svg(_WIDTH, camera.height * scale, "Where in the image corners of the board were seen")
    _frame(svg, camera.height * scale)
    pixels = np.concatenate([fitted.view.pixels for fitted in calibration.used])
    for x, y in (pixels[:: -(-len(pixels) // _MOST_DOTS)] * scale).tolist():
        svg.circle(x, y, 1.6, fill=BLUE, fill_opacity=0.55)
    return svg.markup()


def _unsure(calibration: Calibration) -> Markup:
    """How surely the lens is known over the image: shade and figure, px."""
    camera, image = calibration.camera, calibration.uncertainty.image
    scale = _WIDTH / camera.width
    height = camera.height * scale
    svg = Svg(_WIDTH, height, "Standard deviation, in pixels, of where the lens puts a known ray")
    rows, columns = image.shape
    top = max(float(np.nanmax(image)), 1e-3)
    for i in range(rows):
        for j in range(columns):
            shade = float(np.nan_to_num(image[i, j], nan=top)) / top
            x, y, w, h = _WIDTH * j / columns, height * i / rows, _WIDTH / columns, height / rows
            svg.add("rect", x=x, y=y, width=w, height=h, fill=BLUE, fill_opacity=round(0.05 + 0.6 * shade, 3))
            if j % 3 == 0 and i % 2 == 0:
                svg.text(x + w / 2, y + h / 2 + 3, f"{image[i, j]:.2f}", font_size=9, fill=INK, text_anchor="middle")
    _frame(svg, height)
    return svg.markup()


def _scatter(calibration: Calibration) -> Markup:
    """Reprojection errors of the used views, px, inside a circle of the root mean square."""
    errors = np.concatenate([fitted.errors for fitted in calibration.used])
    size = 300.0
    reach = max(3 * calibration.rms, 1e-3)
    svg = Svg(size, size, "Reprojection errors of all corners")
    half = size / 2
    svg.line(0, half, size, half, stroke=HAIRLINE)
    svg.line(half, 0, half, size, stroke=HAIRLINE)
    for x, y in errors[:: -(-len(errors) // _MOST_DOTS)].tolist():
        if max(abs(x), abs(y)) < reach:
            svg.circle(half + x / reach * half, half + y / reach * half, 1.5, fill=BLUE, fill_opacity=0.5)
    svg.circle(half, half, calibration.rms / reach * half, fill="none", stroke=VERMILION, stroke_width=1.5)
    svg.text(
        half + 5, half - calibration.rms / reach * half - 5, f"{calibration.rms:.2f} px", font_size=12, fill=VERMILION
    )
    svg.text(size - 4, half - 5, f"{reach:.2f} px", font_size=11, fill=MUTED, text_anchor="end")
    return svg.markup()


def _picture(calibration: Calibration, fitted: FittedView) -> Markup:
    """A view, its corners as seen and the errors, enlarged so that the root mean square is as long as a finger."""
    camera = calibration.camera
    width = 240.0
    scale = width / camera.width
    colour = BLUE if fitted.used else VERMILION
    svg = Svg(width, camera.height * scale, f"{fitted.view.name}: {fitted.rms:.2f} px")
    if fitted.view.picture is not None:
        data = base64.b64encode(_thumbnail(fitted.view.picture())).decode("ascii")
        svg.add("image", href=f"data:image/jpeg;base64,{data}", width=width, height=camera.height * scale)
    enlarged = 12.0 / max(calibration.rms, 1e-6)
    arrows: FloatArray = np.clip(fitted.errors * enlarged, -60, 60)
    for (x, y), (dx, dy) in zip((fitted.view.pixels * scale).tolist(), arrows.tolist(), strict=True):
        svg.line(x, y, x + dx, y + dy, stroke=colour, stroke_width=1)
        svg.circle(x, y, 1.4, fill=colour)
    return svg.markup()


def _thumbnail(image: GreyImage) -> bytes:
    picture = Image.fromarray(image)
    picture.thumbnail((_THUMBNAIL, _THUMBNAIL))
    buffer = io.BytesIO()
    picture.save(buffer, "JPEG", quality=70)
    return buffer.getvalue()


def _frame(svg: Svg, height: float) -> None:
    svg.add("rect", x=0.5, y=0.5, width=_WIDTH - 1, height=height - 1, fill="none", stroke=MUTED)
