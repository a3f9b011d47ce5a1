"""From roots of radiance to grey levels: gain, Gaussian read noise, rounding, clipping; one pass over the pixels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from taskslam.compiled import njit
from taskslam.simulation.rendering.lanes import I8, I32, I64, LANES, Lanes, Pointer
from taskslam.simulation.sensors.counted_noise import AT_ONCE, QUANTILES, drawn_lanes


def develop(radiance_root: npt.NDArray[np.float32], gain: float, noise: float, key: int) -> npt.NDArray[np.uint8]:
    """(H, W) or (H, W, 3) uint8 grey levels of roots of radiance.

    gain: multiplies the roots, 1.0 is full scale; noise: standard deviation in grey levels; key: 64 bits that name the
    frame and the camera.
    """
    out = np.empty(radiance_root.shape, np.uint8)
    flat = np.ascontiguousarray(radiance_root).reshape(-1)
    _develop(flat, np.float32(255.0 * gain), np.float32(noise), np.uint64(key), QUANTILES, out.reshape(-1))
    return out


@njit(cache=True, nogil=True)
def _develop(values, gain, noise, key, quantiles, out):  # type: ignore[no-untyped-def]
    for first in range(0, len(values), AT_ONCE):
        _develop_lanes(values, gain, noise, key, quantiles, out, first)


@intrinsic
def _develop_lanes(typingctx, values, gain, noise, key, quantiles, out, first):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Sixty-four pixels from index `first` on, a multiple of 64."""
    real = types.float32
    return types.void(values, real, real, types.uint64, quantiles, out, types.int64), _emit


def _emit(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    gain, noise, key, first = args[1], args[2], args[3], args[6]
    values, quantiles, out = (Pointer(context, builder, signature.args[k], args[k]) for k in (0, 4, 5))
    for part, draws in enumerate(drawn_lanes(builder, key, quantiles, first)):
        begin = builder.add(first, ir.Constant(I64, part * LANES))
        inside = Lanes.counting(builder, I64) < builder.sub(values.shape[0], begin)
        level = inside.loaded(values.at(begin)) * gain + draws * noise + 0.5
        level.most(0.0).least(255.0).to(I32).to(I8).store(out.at(begin), inside)
    return context.get_dummy_value()
