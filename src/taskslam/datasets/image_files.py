"""Decoding one camera image: grey or RGB of a known size, 16 bits scaled to 8, or a sentence on what it is instead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.errors import DatasetError
from taskslam.reading import LARGEST_PICTURE, opened_picture, read_bytes

_FORMATS = ("PNG", "JPEG", "PPM", "BMP")


def read_image(source: Path | bytes, where: str, size: tuple[int, int] | None) -> npt.NDArray[np.uint8]:
    """(H, W) or (H, W, 3) uint8 of an image file, or of its bytes. size: (width, height) that it must have.

    Raises:
        DatasetError: no such file, damaged or cut off, another size, or a palette.
    """
    content = read_bytes(source, "image", DatasetError, LARGEST_PICTURE) if isinstance(source, Path) else source
    with opened_picture(content, where, DatasetError, _FORMATS) as image:
        if size is not None and image.size != size:
            width, height = image.size
            raise DatasetError(
                f"{where}: an image of {width}x{height} pixels; expected {size[0]}x{size[1]} as the others"
            )
        if image.mode.startswith("I;16"):  # TUM-VI keeps 12 bits of light in the upper ones of 16
            return (np.asarray(image) >> 8).astype(np.uint8)
        if image.mode not in ("L", "RGB"):
            raise DatasetError(f"{where}: an image of mode {image.mode}; expected grey or RGB of 8 bits, or grey of 16")
        return np.asarray(image)
