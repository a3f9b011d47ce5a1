"""Sixteen numbers at a time, in LLVM's vector types, written as one writes a single number.

LLVM does not vectorise a renderer's loops by itself: it cannot know that a picture and its textures lie apart, nor will
it gather bytes. The operations are IEEE's, in the order in which they are written and none of them fused, so every
processor gives the same bytes; one without wide vectors or gathers takes longer.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite import ir
from numba.core import cgutils

LANES = 16

I1, I8, I32, I64 = ir.IntType(1), ir.IntType(8), ir.IntType(32), ir.IntType(64)
F32, F64 = ir.FloatType(), ir.DoubleType()


class Lanes:
    """Sixteen numbers of one type. Operators take another sixteen, an LLVM scalar of that type or a Python number.

    Comparisons give sixteen flags and are false where one side is no number; `&`, `^` and shifts are for whole numbers.
    """

    def __init__(self, builder: Any, value: Any) -> None:
        """value: an LLVM vector, or a scalar for every lane."""
        self.builder = builder
        if isinstance(value.type, ir.VectorType):
            self.value = value
        else:
            nothing = ir.Constant(ir.VectorType(value.type, LANES), ir.Undefined)
            first = builder.insert_element(nothing, value, ir.Constant(I32, 0))
            everywhere = ir.Constant(ir.VectorType(I32, LANES), [0] * LANES)
            self.value = builder.shuffle_vector(first, nothing, everywhere)

    @classmethod
    def of(cls, builder: Any, scalar: Any, *numbers: float) -> Lanes:
        """Constants of a scalar type: one for every lane, or one for each."""
        kind = int if isinstance(scalar, ir.IntType) else float
        each = numbers if len(numbers) == LANES else numbers * LANES
        return cls(builder, ir.Constant(ir.VectorType(scalar, LANES), [kind(number) for number in each]))

    @classmethod
    def counting(cls, builder: Any, scalar: Any) -> Lanes:
        """0 to 15."""
        return cls.of(builder, scalar, *range(LANES))

    @property
    def scalar(self) -> Any:
        """The type of a lane."""
        return self.value.type.element

    def __add__(self, other: Any) -> Lanes:
        return self._arithmetic("add", other)

    def __sub__(self, other: Any) -> Lanes:
        return self._arithmetic("sub", other)

    def __mul__(self, other: Any) -> Lanes:
        return self._arithmetic("mul", other)

    def __truediv__(self, other: Any) -> Lanes:
        return self._arithmetic("div", other)

    def __and__(self, other: Any) -> Lanes:
        return self._like(self.builder.and_(self.value, self._other(other)))

    def __xor__(self, other: Any) -> Lanes:
        return self._like(self.builder.xor(self.value, self._other(other)))

    def __lshift__(self, other: Any) -> Lanes:
        return self._like(self.builder.shl(self.value, self._other(other)))

    def __rshift__(self, other: Any) -> Lanes:
        return self._like(self.builder.lshr(self.value, self._other(other)))

    def __lt__(self, other: Any) -> Lanes:
        return self._compared("<", other)

    def __gt__(self, other: Any) -> Lanes:
        return self._compared(">", other)

    def __le__(self, other: Any) -> Lanes:
        return self._compared("<=", other)

    def choose(self, yes: Any, no: Any) -> Lanes:
        """Of flags: `yes` where one is set, else `no`; one of the two at least is sixteen numbers."""
        some = yes if isinstance(yes, Lanes) else no
        return self._like(self.builder.select(self.value, some._other(yes), some._other(no)))

    def least(self, other: Any) -> Lanes:
        """The smaller of two; `other` where this is no number."""
        smaller: Lanes = self < other
        return smaller.choose(self, other)

    def most(self, other: Any) -> Lanes:
        """The larger of two; `other` where this is no number."""
        larger: Lanes = self > other
        return larger.choose(self, other)

    def floor(self) -> Lanes:
        """The whole number below, of the same type."""
        return self._rounded("floor")

    def ceil(self) -> Lanes:
        """The whole number above, of the same type."""
        return self._rounded("ceil")

    def sqrt(self) -> Lanes:
        """The square root, rounded as IEEE asks."""
        return self._rounded("sqrt")

    def to(self, scalar: Any) -> Lanes:
        """The same numbers in another type; a real is cut towards 0."""
        wide, reals = ir.VectorType(scalar, LANES), (ir.FloatType, ir.DoubleType)
        if isinstance(self.scalar, reals) and isinstance(scalar, reals):
            step = self.builder.fptrunc if scalar == F32 else self.builder.fpext
        elif isinstance(scalar, reals):
            step = self.builder.sitofp
        elif isinstance(self.scalar, reals):
            step = self.builder.fptosi
        else:
            step = self.builder.trunc if scalar.width < self.scalar.width else self.builder.sext
        return self._like(step(self.value, wide))

    def bits_as(self, scalar: Any) -> Lanes:
        """The same bits taken for another type of equal size."""
        return self._like(self.builder.bitcast(self.value, ir.VectorType(scalar, LANES)))

    def quarters(self) -> list[Lanes]:
        """Of int64: the sixty-four 16 bits that they hold, the lowest of the first number first, as four int32."""
        builder, short = self.builder, ir.VectorType(ir.IntType(16), 4 * LANES)
        all_of_them = builder.bitcast(self.value, short)
        found = []
        for k in range(4):
            which = ir.Constant(ir.VectorType(I32, LANES), list(range(LANES * k, LANES * (k + 1))))
            some = builder.shuffle_vector(all_of_them, ir.Constant(short, ir.Undefined), which)
            found.append(self._like(builder.zext(some, ir.VectorType(I32, LANES))))
        return found

    def gathered(self, start: Any, scalar: Any, pitch: int = 0) -> Lanes:
        """What lies at these indices (int32 or int64) from a pointer on, `pitch` bytes apart or side by side."""
        builder = self.builder
        wide, pointers = ir.VectorType(scalar, LANES), ir.VectorType(ir.PointerType(), LANES)
        base = Lanes(builder, builder.ptrtoint(start, I64))
        index = self if self.scalar == I64 else self.to(I64)
        place = builder.inttoptr((base + index * (pitch or _size(scalar))).value, pointers)
        gather = self._function(
            wide,
            [pointers, I32, ir.VectorType(I1, LANES), wide],
            f"llvm.masked.gather.v{LANES}{_code(scalar)}.v{LANES}p0",
        )
        flags = Lanes.of(builder, I1, 1).value
        return self._like(builder.call(gather, [place, ir.Constant(I32, 1), flags, Lanes.of(builder, scalar, 0).value]))

    def loaded(self, place: Any) -> Lanes:
        """Of flags: float32 numbers from a pointer on, 0 where none is set; nothing is read there."""
        numbers = ir.VectorType(F32, LANES)
        load = self._function(numbers, [place.type, I32, self.value.type, numbers], f"llvm.masked.load.v{LANES}f32.p0")
        nothing = Lanes.of(self.builder, F32, 0).value
        return self._like(self.builder.call(load, [place, ir.Constant(I32, 4), self.value, nothing]))

    def store(self, place: Any, flags: Lanes | None = None) -> None:
        """Write the numbers from a pointer on, all or where a flag is set."""
        builder = self.builder
        if flags is None:
            builder.store(self.value, builder.bitcast(place, self.value.type.as_pointer()), align=_size(self.scalar))
            return
        types = [self.value.type, place.type, I32, flags.value.type]
        store = self._function(ir.VoidType(), types, f"llvm.masked.store.v{LANES}{_code(self.scalar)}.p0")
        builder.call(store, [self.value, place, ir.Constant(I32, _size(self.scalar)), flags.value])

    def _arithmetic(self, name: str, other: Any) -> Lanes:
        step = name if isinstance(self.scalar, ir.IntType) else f"f{name}"
        return self._like(getattr(self.builder, step)(self.value, self._other(other)))

    def _compared(self, sign: str, other: Any) -> Lanes:
        compare = self.builder.icmp_signed if isinstance(self.scalar, ir.IntType) else self.builder.fcmp_ordered
        return self._like(compare(sign, self.value, self._other(other)))

    def _rounded(self, how: str) -> Lanes:
        function = self._function(self.value.type, [self.value.type], f"llvm.{how}.v{LANES}{_code(self.scalar)}")
        return self._like(self.builder.call(function, [self.value]))

    def _other(self, other: Any) -> Any:
        if isinstance(other, Lanes):
            return other.value
        if isinstance(other, int | float):
            return Lanes.of(self.builder, self.scalar, other).value
        return Lanes(self.builder, other).value

    def _like(self, value: Any) -> Lanes:
        return Lanes(self.builder, value)

    def _function(self, result: Any, arguments: list[Any], name: str) -> Any:
        return cgutils.get_or_insert_function(self.builder.module, ir.FunctionType(result, arguments), name)


def _size(scalar: Any) -> int:
    """Bytes."""
    return scalar.width // 8 if isinstance(scalar, ir.IntType) else (4 if scalar == F32 else 8)


def _code(scalar: Any) -> str:
    """As names of LLVM's functions have it: i32, f64."""
    return f"{'i' if isinstance(scalar, ir.IntType) else 'f'}{8 * _size(scalar)}"


class Pointer:
    """Where an array of Numba's begins, and its length along each axis."""

    def __init__(self, context: Any, builder: Any, kind: Any, array: Any) -> None:
        view = context.make_array(kind)(context, builder, array)
        self._builder, self.start = builder, view.data
        self.shape = cgutils.unpack_tuple(builder, view.shape, kind.ndim)

    def at(self, *index: Any) -> Any:
        """A pointer to an element of a contiguous array; an index is an LLVM int64 or a Python number."""
        builder, place = self._builder, ir.Constant(I64, 0)
        for length, one in zip(self.shape, index, strict=True):
            step = ir.Constant(I64, one) if isinstance(one, int) else one
            place = builder.add(builder.mul(place, length), step)
        return builder.gep(self.start, [place])


def fields(builder: Any, packed: Any, count: int) -> list[Any]:
    """The elements of a tuple of Numba's."""
    return [builder.extract_value(packed, k) for k in range(count)]


@contextmanager
def sixteen_by_sixteen(builder: Any, first: Any, end: Any) -> Iterator[Any]:
    """A loop from int64 `first` to below `end` in steps of sixteen; the body is what is written within."""
    with cgutils.for_range_slice(builder, first, end, ir.Constant(I64, LANES), intp=I64) as (index, _):
        yield index
