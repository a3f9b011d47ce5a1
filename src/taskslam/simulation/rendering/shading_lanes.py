"""What a renderer's shading does most often, sixteen at a time: a row's segments made ready, and a segment's pixels.

A segment is up to sixteen pixels of a row on one triangle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from taskslam.simulation.rendering.lanes import F32, F64, I32, I64, LANES, Lanes, Pointer
from taskslam.simulation.rendering.texture_atlas import LEVELS

PROBES = 4  # texture samples along the direction in which a slanted surface stretches a pixel, at most
_PROBES_PER_STRETCH = 0.7
_COARSEST = LEVELS - 1
# log2(1 + f) for f in 0..1 as f times a polynomial, within 1.2e-4 and exact at both ends: a least maximum fit of ours.
_LOG2 = (1.43872211, -0.67776618, 0.32116329, -0.08211922)

# A triangle's numbers: three each for N, S, T, X and Y, functions A column + B row + C of the pixel, then two. Its
# barycentric coordinates are u = S / N and v = T / N (`screen_planes`); X / N and Y / N are the texel's distance from
# the first corner's texel, which are the last two.
AFFINE = 17
WHOLE = 5  # where its light begins, its light's cells, where its texture's levels are listed, log2 of width and height
# A segment's numbers, each for all segments of a row.
_REAL = (
    "n_step", "x", "x_step", "y", "y_step", "probe_x", "probe_x_step", "probe_y", "probe_y_step", "fine_x", "fine_y",
    "coarse_x", "coarse_y", "blend", "light", "light_step",
)  # fmt: skip
_INTEGER = ("fine_width", "fine_height", "coarse_width", "coarse_height", "probes")
SEGMENT, REALS, INTEGERS, BEGINNINGS = 4, len(_REAL), len(_INTEGER), 2


@intrinsic
def segment_lanes(  # type: ignore[no-untyped-def]
    typingctx, affine, whole, levels, light, segments, first, row, reals, integers, beginnings,  # noqa: ARG001
):  # fmt: skip
    """Make sixteen segments from index `first` on ready for `shade_lanes`.

    affine: (M, AFFINE) float64 and whole: (M, WHOLE) int64 of triangles; levels: (E, LEVELS) int64 where each level of
    a texture begins; light: (S,) float32 samples. segments: (SEGMENT, N + 15) int32: triangle, first column, pixels,
    and 1 where the segment before is on the same triangle. row: float64. Results: reals (REALS, N + 15) float32,
    integers (INTEGERS, N + 15) int32, beginnings (2, N + 15) int64 of the finer and the coarser level.
    """
    signature = types.void(
        affine, whole, levels, light, segments, types.int64, types.float64, reals, integers, beginnings
    )
    return signature, _emit_segments


def _emit_segments(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    first, row = args[5], args[6]
    affine, whole, levels, light, segments, reals, integers, beginnings = (
        Pointer(context, builder, signature.args[k], args[k]) for k in (0, 1, 2, 3, 4, 7, 8, 9)
    )

    def listed(line: int) -> Lanes:
        place = builder.bitcast(segments.at(line, first), ir.VectorType(I32, LANES).as_pointer())
        return Lanes(builder, builder.load(place, align=4))

    triangle = listed(0)
    begin, count, follows = (listed(line).to(F64) for line in (1, 2, 3))
    last, known = begin + count - 1.0, begin - follows

    def real(field: int) -> Lanes:
        return (triangle * AFFINE + field).gathered(affine.start, F64)

    def integer(field: int) -> Lanes:
        return (triangle * WHOLE + field).gathered(whole.start, I64)

    def plane(which: int) -> tuple[Lanes, Lanes, Lanes]:
        """Its change along the row, its change down, and its value in this row's column 0."""
        along, down, rest = (real(3 * which + k) for k in range(3))
        return along, down, down * row + rest

    (na, nb, n), (sa, _, s), (ta, _, t), (xa, xb, x), (ya, yb, y) = (plane(k) for k in range(5))
    one = Lanes.of(builder, F64, 1.0)

    begins, cells = integer(0), integer(1)

    def lit_at(column: Lanes) -> Lanes:
        inverse = one / (na * column + n)
        return _light(light, begins, cells, (sa * column + s) * inverse, (ta * column + t) * inverse)

    lit, lit_at_last = lit_at(known), lit_at(last)

    # Texel coordinates and what a pixel covers of them, in the segment's middle.
    middle = (begin + last) * 0.5
    inverse = one / (na * middle + n)
    there_x, there_y = (xa * middle + x) * inverse, (ya * middle + y) * inverse
    across = (xa - there_x * na) * inverse, (ya - there_y * na) * inverse
    down = (xb - there_x * nb) * inverse, (yb - there_y * nb) * inverse
    wide, high = across[0] * across[0] + across[1] * across[1], down[0] * down[0] + down[1] * down[1]
    taller = high > wide
    long, short = taller.choose(high, wide), taller.choose(wide, high)
    stretch_x, stretch_y = taller.choose(down[0], across[0]), taller.choose(down[1], across[1])

    # Several samples along the stretched direction let the level suit the other one, so that a floor seen at a grazing
    # angle is neither blurred nor aliased.
    probes = ((long / short.most(1.0)).sqrt() * _PROBES_PER_STRETCH + 0.5).least(float(PROBES)).floor().most(1.0)
    detail = _log2((long / (probes * probes)).most(1.0).to(F32)) * 0.5
    detail = detail.least(float(_COARSEST))
    level = detail.floor().least(float(_COARSEST - 1))
    # Blending two levels costs double: near to a level, that level alone will do.
    blend = ((detail - level - 0.25) * 2.0).most(0.0).least(1.0)
    coarser = Lanes.of(builder, F32, 1.0) <= blend
    level = coarser.choose(level + 1.0, level).to(I32)
    blend = coarser.choose(0.0, blend)

    share = one / (probes * 255.0)
    light_step = (lit_at_last - lit) * share / (last - known).most(1.0)
    probe_x, probe_y = stretch_x / probes, stretch_y / probes
    back = (probes - 1.0) * -0.5

    # Whole repeats are taken off, so that float32 tells places within a texel.
    textures, width, height = integer(2), integer(3).to(I32), integer(4).to(I32)
    inverse = one / (na * begin + n)
    result: dict[str, Lanes] = {"n_step": na * inverse}
    for axis, along, value, there, corner, size in (
        ("x", xa, x, there_x, real(15), width),
        ("y", ya, y, there_y, real(16), height),
    ):
        side = (Lanes.of(builder, I32, 1) << size).to(F64)
        here = (along * begin + value) * inverse
        result[axis] = here + (corner - ((there + corner) / side).floor() * side)
        result[f"{axis}_step"] = (along - here * na) * inverse
    result |= {"probe_x": back * probe_x, "probe_x_step": probe_x, "probe_y": back * probe_y, "probe_y_step": probe_y}
    result |= {"blend": blend, "light": lit * share + light_step * (begin - known), "light_step": light_step}
    whole_result = {"probes": probes.to(I32)}
    for line, (level_name, at) in enumerate((("fine", level), ("coarse", (level + 1).least(_COARSEST)))):
        for axis, length, size in (("x", "width", width), ("y", "height", height)):
            whole_result[f"{level_name}_{length}"] = left = (size - at).most(0)
            result[f"{level_name}_{axis}"] = ((left - size + 127) << 23).bits_as(F32)  # 2 to the power of left - size
        (textures + at.to(I64)).gathered(levels.start, I64).store(beginnings.at(line, first))
    for line, name in enumerate(_REAL):
        number = result[name]
        (number if number.scalar == F32 else number.to(F32)).store(reals.at(line, first))
    for line, name in enumerate(_INTEGER):
        whole_result[name].store(integers.at(line, first))
    return context.get_dummy_value()


def _light(light: Pointer, begin: Lanes, cells: Lanes, u: Lanes, v: Lanes) -> Lanes:
    """Linear interpolation in triangles' grids of light samples, as float64."""
    side = cells.to(F64)
    u, v = u.most(0.0).least(1.0) * side, v.most(0.0).least(1.0) * side
    j = v.to(I64).least(cells - 1)
    i = u.to(I64).least(cells - 1 - j)
    fu, fv = (u - i.to(F64)), (v - j.to(F64))
    here = begin + j * (cells + 1) - ((j * (j - 1)) >> 1) + i
    above = here + cells + 1 - j
    is_lower = (fu + fv) <= 1.0
    at_edge = (cells - 1) <= (i + j)
    lower = Lanes(u.builder, u.builder.or_(is_lower.value, at_edge.value))
    corner = lower.choose(here, above + 1)
    value, right, higher = (index.gathered(light.start, F32).to(F64) for index in (corner, here + 1, above))
    one = Lanes.of(u.builder, F64, 1.0)
    return value + lower.choose(fu, one - fv) * (right - value) + lower.choose(fv, one - fu) * (higher - value)


def _log2(number: Lanes) -> Lanes:
    """Base-2 logarithm of float32 numbers from 1 on; whatever of what is no number."""
    bits = number.bits_as(I32)
    fraction = ((bits & 0x7FFFFF) + 0x3F800000).bits_as(F32) - 1.0
    c0, c1, c2, c3 = _LOG2
    return (((fraction * c3 + c2) * fraction + c1) * fraction + c0) * fraction + ((bits >> 23) - 127).to(F32)


@intrinsic
def shade_lanes(typingctx, out, row, segments, segment, reals, integers, beginnings, texels):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Shade one segment of `out` (H, W) float32: texture times light.

    segments, reals, integers, beginnings as in `segment_lanes`; segment: which; texels: (N,) uint8 whose rows have one
    texel more than they are wide, which repeats the first.
    """
    whole = types.int64
    return types.void(out, whole, segments, whole, reals, integers, beginnings, texels), _emit_shade


def _emit_shade(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    row, segment = args[1], args[3]
    out, segments, reals, integers, beginnings, texels = (
        Pointer(context, builder, signature.args[k], args[k]) for k in (0, 2, 4, 5, 6, 7)
    )
    number = {name: builder.load(reals.at(line, segment)) for line, name in enumerate(_REAL)}
    number |= {name: builder.load(integers.at(line, segment)) for line, name in enumerate(_INTEGER)}
    column, count = (builder.sext(builder.load(segments.at(line, segment)), I64) for line in (1, 2))

    # Perspective: a texel coordinate is x + x_step i / (1 + n_step i). Lanes beyond the last pixel repeat it, so that
    # none divides by what lies beyond its triangle.
    pixel = Lanes.counting(builder, F32)
    along = pixel.least(builder.sitofp(builder.sub(count, ir.Constant(I64, 1)), F32))
    along = along / (along * number["n_step"] + 1.0)
    x, y = (along * number[f"{axis}_step"] + number[axis] + number[f"probe_{axis}"] for axis in "xy")

    total, at_x, at_y = (cgutils.alloca_once(builder, ir.VectorType(F32, LANES)) for _ in range(3))
    builder.store(Lanes.of(builder, F32, 0.0).value, total)
    builder.store(x.value, at_x)
    builder.store(y.value, at_y)
    only_fine = builder.fsub(ir.Constant(F32, 1.0), number["blend"])
    with cgutils.for_range(builder, builder.sext(number["probes"], I64), intp=I64):
        x, y = (Lanes(builder, builder.load(place)) for place in (at_x, at_y))

        def add(level: str, line: int, share: Any, x: Lanes = x, y: Lanes = y) -> None:
            begin = builder.gep(texels.start, [builder.load(beginnings.at(line, segment))])
            scales = (number[f"{level}_x"], number[f"{level}_y"])
            sides = (number[f"{level}_width"], number[f"{level}_height"])
            sample = _texture(begin, x * scales[0], y * scales[1], *sides) * share
            builder.store((Lanes(builder, builder.load(total)) + sample).value, total)

        add("fine", 0, only_fine)
        with builder.if_then(builder.fcmp_ordered(">", number["blend"], ir.Constant(F32, 0.0))):
            add("coarse", 1, number["blend"])
        builder.store((x + number["probe_x_step"]).value, at_x)
        builder.store((y + number["probe_y_step"]).value, at_y)
    radiance = Lanes(builder, builder.load(total)) * (pixel * number["light_step"] + number["light"])
    radiance.store(out.at(row, column), Lanes.counting(builder, I64) < count)
    return context.get_dummy_value()


def _texture(begin: Any, x: Lanes, y: Lanes, width_log2: Any, height_log2: Any) -> Lanes:
    """Bilinear values 0..255 of a repeating texture's level, which starts at the pointer `begin`."""
    column, right_share, across = _texel(x, width_log2)
    row, lower_share, down = _texel(y, height_log2)
    left = column & across
    upper, lower = (
        _mixed_pair(begin, (line << width_log2) + line + left, right_share) for line in (row & down, (row + 1) & down)
    )
    return upper + lower_share * (lower - upper)


def _texel(at: Lanes, log2: Any) -> tuple[Lanes, Lanes, Any]:
    """The texel to the left of a coordinate, the share of the next one, and the mask that repeats."""
    at = at - 0.5
    below = at.floor()
    builder = at.builder
    mask = builder.sub(builder.shl(ir.Constant(I32, 1), log2), ir.Constant(I32, 1))
    return below.to(I32), at - below, mask


def _mixed_pair(begin: Any, index: Lanes, share: Lanes) -> Lanes:
    """Between a texel and its neighbour to the right, which lie side by side: a word holds both."""
    words = index.gathered(begin, I32, pitch=1)
    left, right = (words & 255).to(F32), ((words >> 8) & 255).to(F32)
    return left + share * (right - left)
