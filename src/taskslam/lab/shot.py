"""From light to a photograph: the lens's softness and falling-off, exposure, the sensor's noise, JPEG."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy.ndimage import gaussian_filter

from taskslam.lab.image import PAPER
from taskslam.simulation.sensors.exposure import metered_gain
from taskslam.simulation.sensors.read_noise import develop

_PAPER_LEVEL = 0.93  # of full scale, at most: a tag's white must not clip


@dataclass(frozen=True)
class Development:
    """What happens to the light on its way to the file.

    noise: read noise, grey levels of 255; vignetting: (H, W) share of the light that reaches each pixel; gain: on roots
    of light, 1.0 is full scale.
    """

    noise: float
    vignetting: npt.NDArray[np.float32]
    gain: float


def gain_for(radiance: npt.NDArray[np.float32], light: float, exposure: float) -> float:
    """Gain on roots of light at which the scene is well exposed and white paper is not clipped.

    radiance: (H, W) of the scene without tags; light: what falls on paper; exposure: times that, 1 is right.
    """
    right = min(metered_gain(np.sqrt(radiance)), _PAPER_LEVEL / float(np.sqrt(light * PAPER)))
    return right * float(np.sqrt(exposure))


def soften(
    radiance: npt.NDArray[np.float32], softness: float, box: tuple[slice, slice], softened: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    """`softened`, the picture of before, with the changed `box` of `radiance` blurred into it; both linear (H, W).

    softness: sigma, px, of the Gaussian point-spread function of lens and focus.
    """
    if softness <= 0:
        return radiance
    out = softened.copy()
    reach = int(np.ceil(4 * softness)) + 1
    if box[0].start >= box[0].stop:
        return out
    outer = tuple(slice(max(0, span.start - 2 * reach), span.stop + 2 * reach) for span in box)
    patch = gaussian_filter(radiance[outer], softness, mode="nearest", truncate=4.0)
    inner = tuple(slice(max(0, span.start - reach), span.stop + reach) for span in box)
    shift = tuple(
        slice(i.start - o.start, i.start - o.start + len(range(*i.indices(size))))
        for i, o, size in zip(inner, outer, out.shape, strict=True)
    )
    out[inner] = patch[shift]
    return out


def develop_photo(radiance: npt.NDArray[np.float32], how: Development, key: int) -> npt.NDArray[np.uint8]:
    """Grey levels (H, W) of softened linear light; key: 64 bits that name the frame, for its noise."""
    root = np.sqrt(radiance * how.vignetting, dtype=np.float32)
    return develop(root, how.gain, how.noise, key)


def jpeg(image: npt.NDArray[np.uint8], quality: int | None) -> bytes:
    """The picture as a file's bytes: JPEG of this quality, or PNG where it is None."""
    buffer = io.BytesIO()
    if quality is None:
        Image.fromarray(image).save(buffer, format="PNG", compress_level=1)
    else:
        Image.fromarray(image).save(buffer, format="JPEG", quality=quality)
    return buffer.getvalue()
