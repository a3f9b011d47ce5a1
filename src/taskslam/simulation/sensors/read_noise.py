"""From roots of radiance to grey levels: gain, Gaussian read noise, rounding, clipping; one pass over the pixels.

Noise comes from counters, not from a generator that is stepped: pixel i of a frame draws by a hash of the frame's key
and i (SplitMix64, Steele et al. 2014), so no order of evaluation changes it. Of each hash, four times 16 bits look up
the normal distribution's quantiles.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from taskslam.compiled import njit

_BITS = 16


def _quantiles() -> npt.NDArray[np.float32]:
    """(65536,) the middle quantile of each equal share of the standard normal distribution, with variance exactly 1."""
    count = 1 << _BITS
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / np.sqrt(np.mean(values**2)), dtype=np.float32)


_QUANTILES = _quantiles()


def develop(radiance_root: npt.NDArray[np.float32], gain: float, noise: float, key: int) -> npt.NDArray[np.uint8]:
    """(H, W) or (H, W, 3) uint8 grey levels of roots of radiance.

    gain: multiplies the roots, 1.0 is full scale; noise: standard deviation in grey levels; key: 64 bits that name the
    frame and the camera.
    """
    out = np.empty(radiance_root.shape, np.uint8)
    flat = np.ascontiguousarray(radiance_root).reshape(-1)
    _develop(flat, np.float32(255.0 * gain), np.float32(noise), np.uint64(key), _QUANTILES, out.reshape(-1))
    return out


@njit(cache=True, nogil=True)
def _develop(values, gain, noise, key, quantiles, out):  # type: ignore[no-untyped-def]
    half, top = np.float32(0.5), np.float32(255.0)
    for begin in range(0, len(values), 4):
        bits = key + np.uint64(begin // 4 + 1) * np.uint64(0x9E3779B97F4A7C15)
        bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        bits ^= bits >> np.uint64(31)
        for i in range(begin, min(begin + 4, len(values))):
            level = values[i] * gain + noise * quantiles[bits & np.uint64(0xFFFF)] + half
            out[i] = np.uint8(min(max(level, np.float32(0.0)), top))
            bits >>= np.uint64(16)
