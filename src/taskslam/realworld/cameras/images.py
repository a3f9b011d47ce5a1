"""Pictures from files as grey images; a broken one is a sentence, not a half-grey picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.reading import LARGEST_PICTURE, opened_picture, read_bytes

GreyImage = npt.NDArray[np.uint8]

SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp")
_FORMATS = ("JPEG", "PNG", "BMP", "PPM", "TIFF", "WEBP")


def read_grey(path: Path) -> GreyImage:
    """A picture file as a grey image (H, W).

    Raises:
        InputError: not a picture, cut short, corrupt or of more than 134 million pixels.
    """
    return decode_grey(read_bytes(path, "picture", InputError, LARGEST_PICTURE), str(path))


def decode_grey(content: bytes, name: str) -> GreyImage:
    """The grey image (H, W) that the bytes of a picture file hold. name: what an error calls it. Raises InputError."""
    with opened_picture(content, name, InputError, _FORMATS) as picture:
        picture.draft("L", picture.size)  # JPEG: only the luminance is decoded
        if picture.mode == "I;16":  # 16-bit grey, which convert() would clip
            return np.asarray(np.asarray(picture) >> 8, np.uint8)
        return np.array(picture.convert("L"))


def list_images(folder: Path) -> list[Path]:
    """Picture files in a folder, by name. Raises InputError for no folder."""
    try:
        return sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES)
    except OSError as error:
        raise InputError(f"{folder}: cannot list the pictures: {error.strerror}") from error
