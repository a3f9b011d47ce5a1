"""Decoding one camera image: 8-bit grey or RGB of a known size, or a sentence that says what it is instead."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.errors import DatasetError

_FORMATS = ("PNG", "JPEG", "PPM", "BMP")


def read_image(source: Path | bytes, where: str, size: tuple[int, int] | None) -> npt.NDArray[np.uint8]:
    """(H, W) or (H, W, 3) uint8 of an image file, or of its bytes. size: (width, height) that it must have.

    Raises:
        DatasetError: no such file, damaged or cut off, another size, more than 8 bits or a palette.
    """
    from PIL import Image

    try:
        with Image.open(source if isinstance(source, Path) else io.BytesIO(source), formats=_FORMATS) as image:
            if size is not None and image.size != size:
                width, height = image.size
                raise DatasetError(
                    f"{where}: an image of {width}x{height} pixels; expected {size[0]}x{size[1]} as the others"
                )
            if image.mode not in ("L", "RGB"):
                raise DatasetError(f"{where}: an image of mode {image.mode}; expected 8-bit grey or RGB")
            return np.asarray(image)
    except DatasetError:
        raise
    except FileNotFoundError:
        raise DatasetError(f"{where}: the image does not exist") from None
    except (
        Exception
    ) as error:  # the decoder's errors are of many kinds: OSError, SyntaxError, zlib.error, its bomb guard
        raise DatasetError(f"{where}: the image is damaged: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
