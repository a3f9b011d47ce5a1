"""Pictures from files as grey images; a broken one is a sentence, not a half-grey picture."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from taskslam.errors import InputError

GreyImage = npt.NDArray[np.uint8]

SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp")
_MOST_PIXELS = 1 << 27
_FORMATS = ("JPEG", "PNG", "BMP", "PPM", "TIFF", "WEBP")


def read_grey(path: Path) -> GreyImage:
    """A picture file as a grey image (H, W).

    Raises:
        InputError: not a picture, cut short, corrupt or of more than 134 million pixels.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot read the picture: {error.strerror}") from error
    return decode_grey(content, str(path))


def decode_grey(content: bytes, name: str) -> GreyImage:
    """The grey image (H, W) that the bytes of a picture file hold. name: what an error calls it. Raises InputError."""
    try:
        with Image.open(io.BytesIO(content), formats=_FORMATS) as picture:
            if picture.width * picture.height > _MOST_PIXELS:
                raise InputError(
                    f"{name}: {picture.width} x {picture.height} px; expected at most {_MOST_PIXELS} pixels"
                )
            picture.draft("L", picture.size)  # JPEG: only the luminance is decoded
            if picture.mode == "I;16":  # 16-bit grey, which convert() would clip
                return np.asarray(np.asarray(picture) >> 8, np.uint8)
            return np.array(picture.convert("L"))
    except InputError:
        raise
    # Pillow's decoders raise many kinds of errors on broken bytes.
    except Exception as error:
        raise InputError(f"{name}: not a whole picture ({error}); expected JPEG, PNG or the like") from error


def list_images(folder: Path) -> list[Path]:
    """Picture files in a folder, by name. Raises InputError for no folder."""
    try:
        return sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES)
    except OSError as error:
        raise InputError(f"{folder}: cannot list the pictures: {error.strerror}") from error
