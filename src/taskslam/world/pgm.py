"""Portable grey maps, plain (P2) and binary (P5), as the Netpbm specification writes them."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from taskslam.errors import FloorPlanError
from taskslam.reading import MOST_CELLS

_NO_PIXEL = re.compile(rb"[^\s\d]\S{0,15}|\d{7,}")
_LONGEST_GAP = 1 << 16  # bytes of blanks and comments before a number of the header
_TOKEN = re.compile(rb"(?:\s|#[^\n]*\n)*([^\s#]+)")


def read_pgm(data: bytes, where: str) -> tuple[npt.NDArray[np.uint16], int]:
    """(H, W) grey, row 0 at the top, and the grey that is white; `where` names the file in messages.

    Raises:
        FloorPlanError: another format, a broken header, too large, too few pixels, or one above the stated maximum.
    """
    magic, at = _token(data, 0, where, "magic number")
    if magic not in (b"P2", b"P5"):
        expected = "expected a grey map (P2, P5), PNG, BMP or TIFF"
        raise FloorPlanError(f"{where}: no picture that is read: starts with {magic[:8]!r}, {expected}")
    width, at = _number(data, at, where, "width")
    height, at = _number(data, at, where, "height")
    maximum, at = _number(data, at, where, "maximum grey value")
    if width == 0 or height == 0 or not 1 <= maximum <= 65535:
        raise FloorPlanError(f"{where}: broken header: {width} x {height} pixels with maximum {maximum}")
    if width * height > MOST_CELLS:
        raise FloorPlanError(f"{where}: {width} x {height} pixels; expected at most {MOST_CELLS}")
    pixels = _plain(data[at:], where, width * height) if magic == b"P2" else _binary(data[at + 1 :], maximum)
    if len(pixels) < width * height:
        raise FloorPlanError(f"{where}: truncated: {width} x {height} pixels promised, {len(pixels)} found")
    image = pixels[: width * height].reshape(height, width)
    if image.max() > maximum:
        raise FloorPlanError(f"{where}: a pixel is {image.max()}, above the stated maximum {maximum}")
    return image.astype(np.uint16), maximum


def write_pgm(image: npt.NDArray[np.uint8]) -> bytes:
    """Bytes of a binary grey map (P5) of an (H, W) uint8 image, row 0 at the top."""
    height, width = image.shape
    return b"P5\n%d %d\n255\n" % (width, height) + np.ascontiguousarray(image).tobytes()


def _token(data: bytes, at: int, where: str, what: str) -> tuple[bytes, int]:
    found = _TOKEN.match(data, at, at + _LONGEST_GAP)
    if found is None:
        raise FloorPlanError(f"{where}: truncated: the header ends before its {what}")
    return found[1], found.end()


def _number(data: bytes, at: int, where: str, what: str) -> tuple[int, int]:
    token, at = _token(data, at, where, what)
    if not (token.isdigit() and len(token) <= 9):
        raise FloorPlanError(f"{where}: broken header: {what} is {token[:16]!r}, expected a whole number")
    return int(token), at


def _plain(data: bytes, where: str, count: int) -> npt.NDArray[np.int64]:
    text = re.sub(rb"#[^\n]*", b"", data)
    if wrong := _NO_PIXEL.search(text):
        raise FloorPlanError(f"{where}: a pixel is {wrong[0][:16]!r}, expected a whole number")
    return np.fromstring(text, np.int64, count, sep=" ") if text.strip() else np.zeros(0, np.int64)


def _binary(data: bytes, maximum: int) -> npt.NDArray[np.generic]:
    if maximum < 256:
        return np.frombuffer(data, np.uint8)
    return np.frombuffer(data[: len(data) // 2 * 2], ">u2")
