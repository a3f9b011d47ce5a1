"""Sixteen pixels of a row at a time, written for LLVM's vector types.

LLVM does not vectorise such a loop by itself: it cannot know that a picture and its textures lie apart, nor will it
gather bytes. The operations are IEEE's, in this order and none of them fused, so every processor gives the same bytes;
one without wide vectors or gathers takes longer.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 16

_I1, _I8, _I32, _I64 = ir.IntType(1), ir.IntType(8), ir.IntType(32), ir.IntType(64)
_F32, _F64 = ir.FloatType(), ir.DoubleType()


@intrinsic
def shade_lanes(  # type: ignore[no-untyped-def]
    typingctx, out, row, column, count, left, planes, probes, steps, texels, fine, coarse, blend, light,  # noqa: ARG001
):  # fmt: skip
    """Write the first `count` of sixteen pixels of `out` (H, W) float32 from (row, column) on: texture times light.

    left: the first pixel's place in its run. planes: n, na, x, xa, y, ya, base_x, base_y, float64: pixel i of the run
    has the texel coordinates base_x + (x + xa i) / (n + na i) and the like in y. probes: how many samples a pixel, a
    step apart; steps: first_x, first_y, step_x, step_y, float32 texels of the first level. texels: (N,) uint8 whose
    rows have one texel more than they are wide, which repeats the first. fine, coarse: a level each: where it begins,
    base-2 logarithms of its width and height, and its texels per texel of the first level in x and y. blend: share of
    the coarse level. light: of the first pixel and its change from pixel to pixel, for values 0..255 of one sample.
    """
    level = types.Tuple((types.int64, types.int32, types.int32, types.float32, types.float32))
    signature = types.void(
        out,
        types.int64,
        types.int64,
        types.int64,
        types.int64,
        types.UniTuple(types.float64, 8),
        types.int64,
        types.UniTuple(types.float32, 4),
        texels,
        level,
        level,
        types.float32,
        types.UniTuple(types.float32, 2),
    )
    return signature, _emit


def _emit(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    picture, row, column, count, left, planes, probes, steps, texels, fine, coarse, blend, light = args
    lanes = _Lanes(builder)
    n, na, x, xa, y, ya, base_x, base_y = _fields(builder, planes, 8)
    first_x, first_y, step_x, step_y = _fields(builder, steps, 4)
    lit, brighter = _fields(builder, light, 2)
    atlas = context.make_array(signature.args[8])(context, builder, texels).data

    # Lanes beyond the last pixel repeat it, so that none divides by what lies beyond its triangle.
    number = lanes.numbers(_F64)
    last = lanes.spread(builder.sitofp(builder.sub(count, ir.Constant(_I64, 1)), _F64))
    along = builder.select(builder.fcmp_ordered("<", number, last), number, last)
    along = builder.fadd(lanes.spread(builder.sitofp(left, _F64)), along)
    inverse = builder.fdiv(lanes.same(_F64, 1.0), lanes.affine(n, na, along))
    xs = lanes.narrow(builder.fadd(builder.fmul(lanes.affine(x, xa, along), inverse), lanes.spread(base_x)))
    ys = lanes.narrow(builder.fadd(builder.fmul(lanes.affine(y, ya, along), inverse), lanes.spread(base_y)))

    total = cgutils.alloca_once(builder, ir.VectorType(_F32, LANES))
    builder.store(lanes.same(_F32, 0.0), total)
    only_fine = builder.fsub(ir.Constant(_F32, 1.0), blend)
    with cgutils.for_range(builder, probes, intp=_I64) as loop:
        steps_done = builder.sitofp(loop.index, _F32)
        there = (
            builder.fadd(xs, lanes.spread(builder.fadd(first_x, builder.fmul(steps_done, step_x)))),
            builder.fadd(ys, lanes.spread(builder.fadd(first_y, builder.fmul(steps_done, step_y)))),
        )

        def add(level: Any, share: Any, there: tuple[Any, Any] = there) -> None:
            sample = builder.fmul(lanes.spread(share), lanes.texture(atlas, _fields(builder, level, 5), *there))
            builder.store(builder.fadd(builder.load(total), sample), total)

        add(fine, only_fine)
        with builder.if_then(builder.fcmp_ordered(">", blend, ir.Constant(_F32, 0.0))):
            add(coarse, blend)
    radiance = builder.fmul(builder.load(total), lanes.affine(lit, brighter, lanes.numbers(_F32)))
    kind = signature.args[0]
    view = context.make_array(kind)(context, builder, picture)
    place = cgutils.get_item_pointer2(
        context,
        builder,
        view.data,
        cgutils.unpack_tuple(builder, view.shape, 2),
        cgutils.unpack_tuple(builder, view.strides, 2),
        kind.layout,
        [row, column],
    )
    lanes.store_some(radiance, place, count)
    return context.get_dummy_value()


def _fields(builder: Any, packed: Any, count: int) -> list[Any]:
    return [builder.extract_value(packed, k) for k in range(count)]


class _Lanes:
    """Operations on sixteen numbers at once."""

    def __init__(self, builder: Any) -> None:
        self._builder = builder

    def same(self, scalar: Any, value: float) -> Any:
        return ir.Constant(ir.VectorType(scalar, LANES), [value] * LANES)

    def numbers(self, scalar: Any) -> Any:
        """0 to 15."""
        return ir.Constant(ir.VectorType(scalar, LANES), [scalar_of(scalar, k) for k in range(LANES)])

    def spread(self, value: Any) -> Any:
        """A scalar in every lane."""
        nothing = ir.Constant(ir.VectorType(value.type, LANES), ir.Undefined)
        first = self._builder.insert_element(nothing, value, ir.Constant(_I32, 0))
        return self._builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(_I32, LANES), [0] * LANES))

    def affine(self, begin: Any, change: Any, along: Any) -> Any:
        return self._builder.fadd(self.spread(begin), self._builder.fmul(self.spread(change), along))

    def narrow(self, wide: Any) -> Any:
        return self._builder.fptrunc(wide, ir.VectorType(_F32, LANES))

    def texture(self, atlas: Any, level: list[Any], x: Any, y: Any) -> Any:
        """Bilinear values 0..255 of a repeating texture's level at texel coordinates of its first level."""
        builder = self._builder
        begin, width_log2, height_log2, scale_x, scale_y = level
        column, right_share, across = self._floor(x, scale_x, width_log2)
        row, lower_share, down = self._floor(y, scale_y, height_log2)
        left = builder.and_(column, across)
        pitch = self.spread(width_log2)

        def pairs(of: Any) -> tuple[Any, Any]:
            return self._pairs(atlas, begin, builder.add(builder.add(builder.shl(of, pitch), of), left))

        upper_left, upper_right = pairs(builder.and_(row, down))
        lower_left, lower_right = pairs(builder.and_(builder.add(row, self.same(_I32, 1)), down))
        upper = self._mix(upper_left, upper_right, right_share)
        lower = self._mix(lower_left, lower_right, right_share)
        return self._mix(upper, lower, lower_share)

    def _floor(self, texel: Any, scale: Any, log2: Any) -> tuple[Any, Any, Any]:
        """The texel to the left of a coordinate, the share of the next one, and the mask that repeats."""
        builder = self._builder
        wide = ir.VectorType(_F32, LANES)
        at = builder.fsub(builder.fmul(texel, self.spread(scale)), self.same(_F32, 0.5))
        below = builder.call(self._function(wide, [wide], f"llvm.floor.v{LANES}f32"), [at])
        mask = builder.sub(builder.shl(ir.Constant(_I32, 1), log2), ir.Constant(_I32, 1))
        return builder.fptosi(below, ir.VectorType(_I32, LANES)), builder.fsub(at, below), self.spread(mask)

    def _pairs(self, atlas: Any, begin: Any, index: Any) -> tuple[Any, Any]:
        """A texel and its neighbour to the right, as numbers: they lie side by side."""
        builder = self._builder
        words, pointers = ir.VectorType(_I32, LANES), ir.VectorType(ir.PointerType(), LANES)
        base = builder.ptrtoint(builder.gep(atlas, [begin]), _I64)
        place = builder.inttoptr(
            builder.add(self.spread(base), builder.sext(index, ir.VectorType(_I64, LANES))), pointers
        )
        gather = self._function(
            words, [pointers, _I32, ir.VectorType(_I1, LANES), words], f"llvm.masked.gather.v{LANES}i32.v{LANES}p0"
        )
        word = builder.call(gather, [place, ir.Constant(_I32, 1), self.same(_I1, 1), self.same(_I32, 0)])
        byte = self.same(_I32, 255)
        right = builder.and_(builder.lshr(word, self.same(_I32, 8)), byte)
        reals = ir.VectorType(_F32, LANES)
        return builder.sitofp(builder.and_(word, byte), reals), builder.sitofp(right, reals)

    def _mix(self, one: Any, other: Any, share: Any) -> Any:
        return self._builder.fadd(one, self._builder.fmul(share, self._builder.fsub(other, one)))

    def store_some(self, values: Any, place: Any, count: Any) -> None:
        """The first `count` of them, at a pointer to float32."""
        builder = self._builder
        flags = builder.icmp_signed("<", self.numbers(_I64), self.spread(count))
        store = self._function(
            ir.VoidType(),
            [values.type, place.type, _I32, flags.type],
            f"llvm.masked.store.v{LANES}f32.p0",
        )
        builder.call(store, [values, place, ir.Constant(_I32, 4), flags])

    def _function(self, result: Any, arguments: list[Any], name: str) -> Any:
        return cgutils.get_or_insert_function(self._builder.module, ir.FunctionType(result, arguments), name)


def scalar_of(scalar: Any, value: int) -> float | int:
    """A number as constants of a scalar type take it."""
    return value if isinstance(scalar, ir.IntType) else float(value)
