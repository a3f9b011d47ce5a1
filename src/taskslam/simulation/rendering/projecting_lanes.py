"""What a rasterizer does to all that may be in view, sixteen at a time: boxes, vertices, triangles that show nothing.

A point's code has a bit for each side of the view that it lies beyond; what lies beyond one side as a whole is unseen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from taskslam.simulation.rendering.lanes import F32, F64, I32, I64, Lanes, Pointer, sixteen_by_sixteen

NEAR = 16  # the bit of the near plane
_LEFT, _RIGHT, _ABOVE, _BELOW, _FAR = 1, 2, 4, 8, 32
UNSEEN, PLAIN, CUT = 0, 1, 2  # what a triangle may be; cut by the near plane


class _Eye:
    """The camera's numbers, each for sixteen lanes, and its window of columns and rows."""

    def __init__(self, builder: Any, rotation: Pointer, position: Pointer, numbers: Pointer, window: Pointer) -> None:
        def load(array: Pointer, *index: int) -> Lanes:
            return Lanes(builder, builder.load(array.at(*index)))

        self._rotation = [[load(rotation, row, column) for column in range(3)] for row in range(3)]
        self._position = [load(position, axis) for axis in range(3)]
        self.focal, self.cx, self.cy, self.near, self.far = (load(numbers, k) for k in range(5))
        self._right, self._top, self._bottom = (load(window, k) for k in range(3))

    def seen_from(self, point: Sequence[Lanes]) -> list[Lanes]:
        """Points of the world, float64, in the camera's optical frame: across, down, ahead."""
        x, y, z = (one - origin for one, origin in zip(point, self._position, strict=True))
        return [a * x + b * y + c * z for a, b, c in self._rotation]

    def codes(self, across: Lanes, down: Lanes, ahead: Lanes) -> Lanes:
        """Int32 bits of the sides of the view that points in the optical frame lie beyond."""
        column, row = self.focal * across + self.cx * ahead, self.focal * down + self.cy * ahead
        sides = (
            (_LEFT, column < 0.0),
            (_RIGHT, column > self._right * ahead),
            (_ABOVE, row < self._top * ahead),
            (_BELOW, row > self._bottom * ahead),
            (NEAR, ahead < self.near),
            (_FAR, ahead > self.far),
        )
        nothing = Lanes.of(across.builder, I32, 0)
        code = nothing
        for bit, beyond in sides:
            code = code + beyond.choose(Lanes.of(across.builder, I32, bit), nothing)
        return code


@intrinsic
def box_lanes(typingctx, low, high, first, rotation, position, numbers, window, depth):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Of sixteen boxes from index `first` on: depth of the nearest corner, not below 0; -1 where all is unseen.

    low, high: (B, 3) float32; rotation, position, numbers: of the camera, as `rasterize` has them; window: (3,) float64
    last column, first row and last row; depth: (B + 15,) float64, the result.
    """
    signature = types.void(low, high, types.int64, rotation, position, numbers, window, depth)
    return signature, _emit_boxes


def _emit_boxes(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    low, high, rotation, position, numbers, window, depth = (
        Pointer(context, builder, signature.args[k], args[k]) for k in (0, 1, 3, 4, 5, 6, 7)
    )
    first = args[2]
    eye = _Eye(builder, rotation, position, numbers, window)
    last = builder.sub(low.shape[0], ir.Constant(I64, 1))
    which = (Lanes.counting(builder, I64) + first).least(last) * 3
    ends = [[(which + axis).gathered(side.start, F32).to(F64) for axis in range(3)] for side in (low, high)]
    outside, nearest = Lanes.of(builder, I32, 63), Lanes.of(builder, F64, float("inf"))
    for corner in range(8):
        seen = eye.seen_from([ends[corner >> axis & 1][axis] for axis in range(3)])
        outside, nearest = outside & eye.codes(*seen), nearest.least(seen[2])
    (outside > 0).choose(-1.0, nearest.most(0.0)).store(depth.at(first))
    return context.get_dummy_value()


@intrinsic
def project_lanes(  # type: ignore[no-untyped-def]
    typingctx, vertices, first, count, rotation, position, numbers, window, camera, screen, codes,  # noqa: ARG001
):  # fmt: skip
    """`count` vertices from index `first` on, in the optical frame, on the screen, and their codes.

    vertices: (V, 3) float32; camera: (3, N + 15) float64 m; screen: (3, N + 15) float64 column, row and inverse depth,
    which mean nothing before the near plane; codes: (N + 15,) int32.
    """
    whole = types.int64
    signature = types.void(vertices, whole, whole, rotation, position, numbers, window, camera, screen, codes)
    return signature, _emit_vertices


def _emit_vertices(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    vertices, rotation, position, numbers, window, camera, screen, codes = (
        Pointer(context, builder, signature.args[k], args[k]) for k in (0, 3, 4, 5, 6, 7, 8, 9)
    )
    first, count = args[1], args[2]
    eye = _Eye(builder, rotation, position, numbers, window)
    one = Lanes.of(builder, F64, 1.0)
    last = builder.sub(count, ir.Constant(I64, 1))
    with sixteen_by_sixteen(builder, ir.Constant(I64, 0), count) as done:
        which = ((Lanes.counting(builder, I64) + done).least(last) + first) * 3
        seen = eye.seen_from([(which + axis).gathered(vertices.start, F32).to(F64) for axis in range(3)])
        inverse = one / seen[2]
        for axis, centre in enumerate((eye.cx, eye.cy)):
            (eye.focal * seen[axis] * inverse + centre).store(screen.at(axis, done))
            seen[axis].store(camera.at(axis, done))
        inverse.store(screen.at(2, done))
        seen[2].store(camera.at(2, done))
        eye.codes(*seen).store(codes.at(done))
    return context.get_dummy_value()


@intrinsic
def sort_out_lanes(typingctx, triangles, first, count, base, screen, codes, kind):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """What `count` triangles from index `first` on are: UNSEEN, which hold no pixel's centre; PLAIN; CUT.

    triangles: (T, 3) int32 vertices, of which `base` is the first in `screen` and `codes`, as `project_lanes` fills
    them; kind: (N + 15,) int32, the result.
    """
    whole = types.int64
    return types.void(triangles, whole, whole, whole, screen, codes, kind), _emit_triangles


def _emit_triangles(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:
    triangles, screen, codes, kind = (Pointer(context, builder, signature.args[k], args[k]) for k in (0, 4, 5, 6))
    first, count, base = args[1], args[2], args[3]
    last = builder.sub(count, ir.Constant(I64, 1))
    with sixteen_by_sixteen(builder, ir.Constant(I64, 0), count) as done:
        which = ((Lanes.counting(builder, I64) + done).least(last) + first) * 3
        corners = [(which + k).gathered(triangles.start, I32).to(I64) - base for k in range(3)]
        code = [corner.gathered(codes.start, I32) for corner in corners]
        beyond = (code[0] & code[1] & code[2]) > 0
        reach = []
        for axis in range(2):
            at = [corner.gathered(screen.at(axis, 0), F64) for corner in corners]
            least, most = at[0].least(at[1]).least(at[2]), at[0].most(at[1]).most(at[2])
            reach.append(least.ceil() < most.ceil())
        is_cut = Lanes(builder, builder.or_(builder.or_(code[0].value, code[1].value), code[2].value)) & NEAR
        plain = (reach[0] & reach[1]).choose(Lanes.of(builder, I32, PLAIN), UNSEEN)
        found = beyond.choose(Lanes.of(builder, I32, UNSEEN), (is_cut > 0).choose(CUT, plain))
        found.store(kind.at(done))
    return context.get_dummy_value()
