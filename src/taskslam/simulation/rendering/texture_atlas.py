"""All textures of a world as one array of mip levels, so that a renderer finds any texel by one index.

A texel holds the square root of linear reflectance: a camera whose grey level is the square root of the light
(a gamma of 2, near to sRGB's curve) then needs one multiplication by the root of the light that falls there. Levels
are averaged in linear light. Sides are powers of two, so that repeating is a bit mask.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image

from taskslam.compiled import njit
from taskslam.simulation.rendering.shading import LINEAR_OF_BYTE, linear_of_srgb
from taskslam.world import Material

Floats = npt.NDArray[np.float32]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear RGB, ITU-R BT.709

_LARGEST_LOG2 = 11
LEVELS = _LARGEST_LOG2 + 1  # that every texture lists, the last one again and again if it has fewer
_WORD = 4  # bytes: a renderer reads texels by words, the last one too


@dataclass(frozen=True)
class TextureAtlas:
    """E textures.

    planes: (1 or 3, N) uint8, grey or red, green and blue, each row of texels ending with its first once more; opacity:
    (N,) uint8 likewise, or empty if no texture has holes; offset: (E, 12) int64 where each level begins; width, height:
    (E,) int64 base-2 logarithms of the first level's size; entry: (M,) int32 texture of each of the world's materials,
    -1 where it is clear all over; holes: (E,) bool.
    """

    planes: npt.NDArray[np.uint8]
    opacity: npt.NDArray[np.uint8]
    offset: npt.NDArray[np.int64]
    width: npt.NDArray[np.int64]
    height: npt.NDArray[np.int64]
    entry: npt.NDArray[np.int32]
    holes: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class _Pyramid:
    """Mip levels of one texture: (h, w, C) colour as stored, and (h, w) opacity where the texture has holes."""

    colour: list[npt.NDArray[np.uint8]]
    opacity: list[npt.NDArray[np.uint8]] | None


def texture_atlas(materials: tuple[Material, ...], used: npt.NDArray[np.bool_], color: bool) -> TextureAtlas:
    """The atlas of the materials in use; materials that look alike share an entry, plain ones are a single texel."""
    entry = np.full(len(materials), -1, np.int32)
    known: dict[tuple[object, ...], int] = {}
    pyramids: list[_Pyramid] = []
    for index in np.flatnonzero(used):
        look = materials[index]
        if look.diffuse[3] < 0.5:
            continue
        key = (id(look.texture), look.diffuse)
        if key not in known:
            known[key] = len(pyramids)
            pyramids.append(_pyramid(look, color))
        entry[index] = known[key]
    return _packed(pyramids, entry, 3 if color else 1)


def _packed(pyramids: list[_Pyramid], entry: npt.NDArray[np.int32], channels: int) -> TextureAtlas:
    offset = np.zeros((max(len(pyramids), 1), LEVELS), np.int64)
    size = np.zeros((2, max(len(pyramids), 1)), np.int64)
    end = 0
    for e, pyramid in enumerate(pyramids):
        size[:, e] = [math.frexp(side)[1] - 1 for side in pyramid.colour[0].shape[:2]]
        for level in range(LEVELS):
            if level < len(pyramid.colour):
                offset[e, level] = end
                end += pyramid.colour[level].shape[0] * (pyramid.colour[level].shape[1] + 1)
            else:
                offset[e, level] = end - 2  # the single texel that ends every pyramid
    planes = np.zeros((channels, end + _WORD), np.uint8)
    holes = np.array([pyramid.opacity is not None for pyramid in pyramids], bool)
    opacity = np.full(end if holes.any() else 0, 255, np.uint8)
    for e, pyramid in enumerate(pyramids):
        for level, colour in enumerate(pyramid.colour):
            span = slice(offset[e, level], offset[e, level] + colour.shape[0] * (colour.shape[1] + 1))
            planes[:, span] = _closed(colour).reshape(-1, channels).T
            if pyramid.opacity is not None:
                opacity[span] = _closed(pyramid.opacity[level]).ravel()
    return TextureAtlas(planes, opacity, offset, size[1], size[0], entry, holes)


def _closed(level: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """The same with each row's first texel at its end once more: neighbours always lie side by side."""
    return np.concatenate([level, level[:, :1]], axis=1)


def _pyramid(look: Material, color: bool) -> _Pyramid:
    tint = linear_of_srgb(np.array(look.diffuse[:3])).astype(np.float32)
    if look.texture is None:
        return _Pyramid([_stored(_channels(tint[None, None, :], color))], None)
    tinted = LINEAR_OF_BYTE[:, None] * tint
    linear = _looked_up(look.texture, tinted) if color else _summed(look.texture, tinted * LUMINANCE)
    sides = [_power_of_two(side) for side in linear.shape[:2]]
    linear = _resized(linear, sides)
    alpha = None
    if look.texture.shape[2] == 4 and look.texture[..., 3].min() < 128:
        alpha = _resized(look.texture[..., 3:].astype(np.float32) / np.float32(255.0), sides)
    colours, opacities = [_stored(linear)], [_opacity(alpha)]
    while max(linear.shape[:2]) > 1:
        if alpha is None:
            linear = _halved(linear)
        else:  # what is seen through must not tint the edges of what is seen
            weight = alpha + np.float32(1e-3)
            linear, alpha = _halved(linear * weight) / _halved(weight), _halved(alpha)
        colours.append(_stored(linear))
        opacities.append(_opacity(alpha))
    return _Pyramid(colours, None if alpha is None else [level for level in opacities if level is not None])


@njit(cache=True)
def _summed(texture, of_byte):  # type: ignore[no-untyped-def]
    """(h, w, 1) sums over three bytes of what (256, 3) `of_byte` makes of each."""
    out = np.empty((*texture.shape[:2], 1), np.float32)
    for row in range(texture.shape[0]):
        for column in range(texture.shape[1]):
            red, green, blue = texture[row, column, 0], texture[row, column, 1], texture[row, column, 2]
            out[row, column, 0] = of_byte[red, 0] + of_byte[green, 1] + of_byte[blue, 2]
    return out


@njit(cache=True)
def _looked_up(texture, of_byte):  # type: ignore[no-untyped-def]
    """(h, w, 3) what (256, 3) `of_byte` makes of each of three bytes."""
    out = np.empty((*texture.shape[:2], 3), np.float32)
    for row in range(texture.shape[0]):
        for column in range(texture.shape[1]):
            for channel in range(3):
                out[row, column, channel] = of_byte[texture[row, column, channel], channel]
    return out


def _channels(linear: Floats, color: bool) -> Floats:
    """(h, w, 3) itself, or its luminance as (h, w, 1)."""
    return linear if color else (linear @ LUMINANCE)[..., None]


def _stored(linear: Floats) -> npt.NDArray[np.uint8]:
    return (np.sqrt(np.clip(linear, 0.0, 1.0)) * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)


def _opacity(alpha: Floats | None) -> npt.NDArray[np.uint8] | None:
    return None if alpha is None else (np.clip(alpha[..., 0], 0.0, 1.0) * np.float32(255.0) + 0.5).astype(np.uint8)


def _power_of_two(side: int) -> int:
    return int(2 ** min(round(math.log2(side)), _LARGEST_LOG2))


def _resized(image: Floats, sides: list[int]) -> Floats:
    if list(image.shape[:2]) == sides:
        return image
    size = (sides[1], sides[0])
    layers = [Image.fromarray(np.ascontiguousarray(image[..., c])) for c in range(image.shape[2])]
    return np.stack([np.asarray(layer.resize(size, Image.Resampling.BOX), np.float32) for layer in layers], axis=2)


def _halved(image: Floats) -> Floats:
    """Mean of each 2 by 2 texels, or of each pair where a side is 1."""
    if image.shape[0] > 1:
        image = (image[0::2] + image[1::2]) * np.float32(0.5)
    if image.shape[1] > 1:
        image = (image[:, 0::2] + image[:, 1::2]) * np.float32(0.5)
    return image
