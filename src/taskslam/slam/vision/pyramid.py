"""Image pyramids: level 0 smoothed, every further level half the size of the one below."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit

GreyImage = npt.NDArray[np.uint8]
Pyramid: TypeAlias = tuple[GreyImage, ...]


def build_pyramid(image: npt.NDArray[np.uint8], levels: int) -> Pyramid:
    """Levels of an (H, W) or (H, W, 3) RGB image, the finest first, grey; level 0 is blurred (`blur`)."""
    pyramid = [blur(np.array(grey(image), order="C"))]  # a copy: of one type, whoever owns the image
    while len(pyramid) < levels:
        pyramid.append(halve(pyramid[-1]))
    return tuple(pyramid)


def grey(image: npt.NDArray[np.uint8]) -> GreyImage:
    """(H, W) luma of an image that may be RGB: ITU-R BT.601, 0.299 R + 0.587 G + 0.114 B, rounded."""
    if image.ndim == 2:
        return image
    luma = image.astype(np.uint32) @ np.array([4899, 9617, 1868], np.uint32)  # in 1/2^14
    rounded: GreyImage = ((luma + (1 << 13)) >> 14).astype(np.uint8)
    return rounded


def same_pictures(before: tuple[Pyramid, Pyramid] | None, pair: tuple[Pyramid, Pyramid]) -> bool:
    """Whether both pictures of a pair repeat those before to the last grey level."""
    return before is not None and all(np.array_equal(b[0], p[0]) for b, p in zip(before, pair, strict=True))


@njit(cache=True)
def blur(image: GreyImage) -> GreyImage:
    """3 x 3 binomial filter (1 2 1)/4 both ways, rounded; the border is repeated."""
    rows, columns = image.shape
    out = np.empty_like(image)
    column = np.empty(columns, np.uint16)
    eight = np.uint16(8)
    for y in range(rows):
        above, below = image[max(y - 1, 0)], image[min(y + 1, rows - 1)]
        here, there = image[y], out[y]
        for x in range(columns):
            column[x] = np.uint16(above[x]) + np.uint16(2) * np.uint16(here[x]) + np.uint16(below[x])
        for x in range(1, columns - 1):
            total = np.uint16(column[x - 1]) + np.uint16(2) * column[x] + np.uint16(column[x + 1])
            there[x] = np.uint8((total + eight) >> np.uint16(4))
        there[0] = np.uint8((np.uint16(3) * column[0] + column[1] + eight) >> np.uint16(4))
        last = columns - 1
        there[last] = np.uint8((column[last - 1] + np.uint16(3) * column[last] + eight) >> np.uint16(4))
    return out


@njit(cache=True)
def halve(image: GreyImage) -> GreyImage:
    """Mean of every 2 x 2 pixels, rounded; of an odd side the last row or column is left out."""
    rows, columns = image.shape[0] // 2, image.shape[1] // 2
    out = np.empty((rows, columns), np.uint8)
    for y in range(rows):
        upper, lower, there = image[2 * y], image[2 * y + 1], out[y]
        for x in range(columns):
            total = np.uint16(upper[2 * x]) + np.uint16(upper[2 * x + 1])
            total += np.uint16(lower[2 * x]) + np.uint16(lower[2 * x + 1])
            there[x] = np.uint8((total + np.uint16(2)) >> np.uint16(2))
    return out


@njit(cache=True, inline="always")
def bilinear(image: Any, x: Any, y: Any) -> Any:
    """Grey level between pixels; (x, y) must lie within 0 <= x < W - 1, 0 <= y < H - 1."""
    x0, y0 = np.uintp(x), np.uintp(y)
    a, b = x - x0, y - y0
    x1, y1 = x0 + np.uintp(1), y0 + np.uintp(1)
    upper = (1.0 - a) * image[y0, x0] + a * image[y0, x1]
    lower = (1.0 - a) * image[y1, x0] + a * image[y1, x1]
    return (1.0 - b) * upper + b * lower
