"""Portable grey maps, plain (P2) and binary (P5), as the Netpbm specification writes them."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from taskslam.errors import FloorPlanError

_TOKEN = re.compile(rb"(?:\s|#[^\n]*\n)*([^\s#]+)")


def read_pgm(data: bytes, where: str) -> npt.NDArray[np.float64]:
    """(H, W) float64 grey in 0..255, row 0 at the top; `where` names the file in messages.

    Raises:
        FloorPlanError: another format, a broken header, too few pixels, or a pixel above the stated maximum.
    """
    magic, at = _token(data, 0, where, "magic number")
    if magic not in (b"P2", b"P5"):
        raise FloorPlanError(f"{where}: not a grey map: starts with {magic[:8]!r}, expected P2 or P5")
    width, at = _number(data, at, where, "width")
    height, at = _number(data, at, where, "height")
    maximum, at = _number(data, at, where, "maximum grey value")
    if width == 0 or height == 0 or not 1 <= maximum <= 65535:
        raise FloorPlanError(f"{where}: broken header: {width} x {height} pixels with maximum {maximum}")
    pixels = _plain(data[at:], where) if magic == b"P2" else _binary(data[at + 1 :], maximum)
    if len(pixels) < width * height:
        raise FloorPlanError(f"{where}: truncated: {width} x {height} pixels promised, {len(pixels)} found")
    image = pixels[: width * height].reshape(height, width).astype(np.float64)
    if image.max() > maximum:
        raise FloorPlanError(f"{where}: a pixel is {image.max():.0f}, above the stated maximum {maximum}")
    return image if maximum == 255 else image * (255.0 / maximum)


def write_pgm(image: npt.NDArray[np.uint8]) -> bytes:
    """Bytes of a binary grey map (P5) of an (H, W) uint8 image, row 0 at the top."""
    height, width = image.shape
    return b"P5\n%d %d\n255\n" % (width, height) + np.ascontiguousarray(image).tobytes()


def _token(data: bytes, at: int, where: str, what: str) -> tuple[bytes, int]:
    found = _TOKEN.match(data, at)
    if found is None:
        raise FloorPlanError(f"{where}: truncated: the header ends before its {what}")
    return found[1], found.end()


def _number(data: bytes, at: int, where: str, what: str) -> tuple[int, int]:
    token, at = _token(data, at, where, what)
    if not (token.isdigit() and len(token) <= 9):
        raise FloorPlanError(f"{where}: broken header: {what} is {token[:16]!r}, expected a whole number")
    return int(token), at


def _plain(data: bytes, where: str) -> npt.NDArray[np.int64]:
    tokens = re.sub(rb"#[^\n]*", b"", data).split()
    try:
        return np.array([int(token) for token in tokens if token.isdigit() or _refuse(token)], np.int64)
    except ValueError as error:
        raise FloorPlanError(f"{where}: {error}") from error


def _refuse(token: bytes) -> bool:
    raise ValueError(f"a pixel is {token[:16]!r}, expected a whole number")


def _binary(data: bytes, maximum: int) -> npt.NDArray[np.generic]:
    if maximum < 256:
        return np.frombuffer(data, np.uint8)
    return np.frombuffer(data[: len(data) // 2 * 2], ">u2")
