"""Standard normal draws by counters, not from a generator that is stepped.

Draw i of a frame comes from a hash of the frame's key and i (SplitMix64, Steele et al. 2014), so no order of evaluation
changes it, and a frame that nobody looks at need not draw. Of each hash, four times 16 bits look up the normal
distribution's quantiles. Keys are drawn from the run's streams: who knows one frame's key knows no other's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from scipy.special import ndtri

from taskslam.compiled import njit
from taskslam.simulation.rendering.lanes import F32, I64, LANES, Lanes, Pointer

AT_ONCE = 4 * LANES
_BITS = 16


def _quantiles() -> npt.NDArray[np.float32]:
    """(65536,) the middle quantile of each equal share of the standard normal distribution, with variance exactly 1."""
    count = 1 << _BITS
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / np.sqrt(np.mean(values**2)), dtype=np.float32)


QUANTILES = _quantiles()


def next_key(noise: np.random.Generator) -> int:
    """64 bits that name the next frame of a noise source."""
    return int(noise.bit_generator.random_raw())


def standard_normal(key: int, shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """The draws of the frame that `key` names, in C order."""
    out: npt.NDArray[np.float32] = drawn(np.uint64(key), QUANTILES, math.prod(shape))
    return out.reshape(shape)


@njit(cache=True, nogil=True)
def drawn(key, quantiles, count):  # type: ignore[no-untyped-def]
    """(count,) float32: `standard_normal` for kernels. key: uint64; quantiles: `QUANTILES`."""
    out = np.empty(count, np.float32)
    for first in range(0, count, AT_ONCE):
        _fill_lanes(key, quantiles, out, first)
    return out


@intrinsic
def _fill_lanes(typingctx, key, quantiles, out, first):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Sixty-four draws from index `first` on, a multiple of 64."""
    return types.void(types.uint64, quantiles, out, types.int64), _emit


def _emit(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    key, first = args[0], args[3]
    quantiles, out = (Pointer(context, builder, signature.args[k], args[k]) for k in (1, 2))
    for part, draws in enumerate(drawn_lanes(builder, key, quantiles, first)):
        begin = builder.add(first, ir.Constant(I64, part * LANES))
        inside = Lanes.counting(builder, I64) < builder.sub(out.shape[0], begin)
        draws.store(out.at(begin), inside)
    return context.get_dummy_value()


def drawn_lanes(builder: Any, key: Any, quantiles: Pointer, first: Any) -> list[Lanes]:
    """Draws `first` to `first` + 63, as four times sixteen float32: sixteen hashes. first: int64, a multiple of 64."""
    state = (Lanes.counting(builder, I64) + builder.ashr(first, ir.Constant(I64, 2)) + 1) * 0x9E3779B97F4A7C15 + key
    state = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9
    state = (state ^ (state >> 27)) * 0x94D049BB133111EB
    return [index.gathered(quantiles.start, F32) for index in (state ^ (state >> 31)).quarters()]
