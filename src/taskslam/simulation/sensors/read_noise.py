"""From roots of radiance to grey levels: gain, Gaussian read noise, rounding, clipping; one pass over the pixels.

Noise comes from counters, not from a generator that is stepped: pixel i of a frame draws by a hash of the frame's key
and i (SplitMix64, Steele et al. 2014), so no order of evaluation changes it. Of each hash, four times 16 bits look up
the normal distribution's quantiles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from scipy.special import ndtri

from taskslam.compiled import njit
from taskslam.simulation.rendering.lanes import F32, I8, I32, I64, LANES, Lanes, Pointer

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
    for first in range(0, len(values), 4 * LANES):
        _develop_lanes(values, gain, noise, key, quantiles, out, first)


@intrinsic
def _develop_lanes(typingctx, values, gain, noise, key, quantiles, out, first):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Sixty-four pixels from index `first` on, a multiple of 64: sixteen hashes."""
    real = types.float32
    return types.void(values, real, real, types.uint64, quantiles, out, types.int64), _emit


def _emit(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    gain, noise, key, first = args[1], args[2], args[3], args[6]
    values, quantiles, out = (Pointer(context, builder, signature.args[k], args[k]) for k in (0, 4, 5))
    number = Lanes.counting(builder, I64)
    state = (number + builder.ashr(first, ir.Constant(I64, 2)) + 1) * 0x9E3779B97F4A7C15 + key
    state = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9
    state = (state ^ (state >> 27)) * 0x94D049BB133111EB
    for part, draws in enumerate((state ^ (state >> 31)).quarters()):
        begin = builder.add(first, ir.Constant(I64, part * LANES))
        inside = number < builder.sub(values.shape[0], begin)
        level = inside.loaded(values.at(begin)) * gain + draws.gathered(quantiles.start, F32) * noise + 0.5
        level.most(0.0).least(255.0).to(I32).to(I8).store(out.at(begin), inside)
    return context.get_dummy_value()
