"""A rasterizer's two inner loops, sixteen at a time: where rows meet a triangle, and what pixels of a row see of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from taskslam.simulation.rendering.lanes import F32, F64, I32, I64, Lanes, Pointer, fields, sixteen_by_sixteen


@intrinsic
def span_lanes(typingctx, spans, first, end, top, long_slope, upper_slope, middle, lower_slope, width):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Columns at which a triangle's rows first..end meet its long side, spans[0], and its short ones, spans[1].

    spans: (2, R + 15) int32, of which up to fifteen rows after the last are written too. top, middle: row and column of
    the triangle's upper and middle corner, float64; slopes: columns a row, of the long side, and of the short sides
    above and below the middle. A span begins at the first whole column not left of a side, within 0..width.
    """
    point, real = types.UniTuple(types.float64, 2), types.float64
    signature = types.void(spans, types.int64, types.int64, point, real, real, point, real, real)
    return signature, _emit_spans


def _emit_spans(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    spans, first, end, top, long_slope, upper_slope, middle, lower_slope, width = args
    spans = Pointer(context, builder, signature.args[0], spans)
    top_row, top_column = fields(builder, top, 2)
    middle_row, middle_column = fields(builder, middle, 2)
    with sixteen_by_sixteen(builder, first, end) as row:
        number = Lanes(builder, builder.sitofp(row, F64)) + Lanes.counting(builder, F64)
        down, below = number - top_row, number - middle_row
        long = down * long_slope + top_column
        upper, lower = down * upper_slope + top_column, below * lower_slope + middle_column
        short = (number < middle_row).choose(upper, lower)
        for side, column in enumerate((long, short)):
            column.most(0.0).least(width).ceil().to(I32).store(spans.at(side, row))
    return context.get_dummy_value()


@intrinsic
def draw_lanes(typingctx, inverse_depth, seen, first, count, start, step, name):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Put `count` pixels from index `first` on into a z-buffer: pixel i, at start + step i, where that is nearer.

    inverse_depth: (N,) float32; seen: (N,) int32, which takes `name` where the pixel is taken; start, step: float32.
    """
    whole, real = types.int64, types.float32
    return types.void(inverse_depth, seen, whole, whole, real, real, types.int32), _emit_draw


def _emit_draw(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    depths, names, first, count, start, step, name = args
    depths, names = (Pointer(context, builder, signature.args[k], args[k]) for k in range(2))
    numbers = Lanes.counting(builder, I64)
    with sixteen_by_sixteen(builder, ir.Constant(I64, 0), count) as done:
        place = builder.add(first, done)
        along = Lanes.counting(builder, F32) + builder.sitofp(done, F32)
        inverse = along * step + start
        asked = numbers < builder.sub(count, done)
        nearer = asked & (inverse > asked.loaded(depths.at(place)))
        inverse.store(depths.at(place), nearer)
        Lanes(builder, name).store(names.at(place), nearer)
    return context.get_dummy_value()
