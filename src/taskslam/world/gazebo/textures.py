"""Reading texture images, each once."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from taskslam.errors import WorldError
from taskslam.reading import MOST_HEIGHTS, MOST_TEXTURE_PIXELS, opened_picture
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.resources import Resources

_FORMATS = ("PNG", "JPEG", "TGA", "BMP", "GIF", "TIFF", "WEBP", "DDS", "PPM")  # not EPS, which starts a program
LARGEST_SIDE = 1024
"""Larger textures are reduced to this many pixels a side: a robot's camera sees no more, and a world of 4K textures
would fill gigabytes."""

Texture = npt.NDArray[np.uint8]


def decode(data: bytes) -> Texture | None:
    """(H, W, 3) or, where any pixel is transparent, (H, W, 4) uint8 sRGB; None if the image is damaged or too large."""
    try:
        with opened_picture(data, "texture", WorldError, _FORMATS, MOST_TEXTURE_PIXELS) as image:
            return _as_array(image)
    except WorldError:
        return None


def grey_image(data: bytes, where: str) -> npt.NDArray[np.float64]:
    """(H, W) of an 8 or 16 bit image, row 0 at the top, in 0..1. Raises WorldError."""
    with opened_picture(data, where, WorldError, _FORMATS, MOST_HEIGHTS) as image:
        if image.mode.startswith("I"):
            return np.asarray(image).astype(np.float64).clip(0, 65535) / 65535.0
        return np.asarray(image.convert("RGB"))[:, :, 0].astype(np.float64) / 255.0


def _as_array(image: Image.Image) -> Texture:
    if image.mode.startswith("I"):
        image = Image.fromarray((np.asarray(image).astype(np.uint32) >> 8).clip(0, 255).astype(np.uint8))
    transparent = image.mode in ("RGBA", "LA", "PA", "RGBa", "La") or "transparency" in image.info
    image = image.convert("RGBA" if transparent else "RGB")
    if max(image.size) > LARGEST_SIDE:
        ratio = LARGEST_SIDE / max(image.size)
        image = image.resize(
            (max(1, round(image.width * ratio)), max(1, round(image.height * ratio))), Image.Resampling.BOX
        )
    pixels = np.array(image, dtype=np.uint8)
    if pixels.shape[2] == 4 and bool((pixels[..., 3] == 255).all()):
        pixels = np.ascontiguousarray(pixels[..., :3])
    return pixels


class TextureStore:
    """Textures by the content of their files; those that are missing or damaged are noted once each."""

    def __init__(self, resources: Resources, left_out: LeftOut) -> None:
        self._resources, self._left_out = resources, left_out
        self._textures: dict[str, Texture | None] = {}
        self._noted: set[str] = set()

    def find(self, name: str, folder: Path) -> Texture | None:
        """The texture that a file in `folder` calls `name`; None, and noted, if it is missing or damaged."""
        path = self._resources.find_texture(name, folder)
        if path is None:
            self.missing(name)
            return None
        texture = self.decoded(self._resources.read(path))
        if texture is None:
            self.damaged(path.name)
        return texture

    def missing(self, name: str) -> None:
        """Note a texture that is nowhere to be found, by the last part of its name."""
        name = name.replace("\\", "/").rsplit("/", 1)[-1]
        if name not in self._noted:
            self._left_out.missing("texture", name)
        self._noted.add(name)

    def damaged(self, name: str) -> None:
        """Note a texture that cannot be decoded."""
        if name not in self._noted:
            self._left_out.damaged("texture", name)
        self._noted.add(name)

    def decoded(self, data: bytes) -> Texture | None:
        """The texture of an image file's bytes; the same bytes always give the same array."""
        digest = hashlib.sha256(data).hexdigest()
        if digest not in self._textures:
            self._textures[digest] = decode(data)
        return self._textures[digest]
