"""Rays against triangles, by Intel Embree. Rays are float32, as Embree's are; world frame, metres.

The one place that talks to Embree; LiDARs and previews call it. Eight neighbouring rays go through its tree together,
at nearly twice the rate of single ones. A triangle's distance has the same bits either way (a test compares them); of
two surfaces in one place, packets may meet the one and single rays the other, an ulp apart. embreex has Python names
for single rays only, so its library is called directly. Names and layouts are those of Embree 4's API: `RTCRayHit8`,
`rtcIntersect8`. The scene is robust, as embreex makes it: no ray slips between two triangles.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import embreex.rtcore_scene  # noqa: F401 - loads the library
import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from taskslam.compiled import njit
from taskslam.world import TriangleMesh

_PACKET = 8
# Fields of a packet, each for all of its rays: origin, tnear, direction, time, tfar, mask, id, flags, normal, u, v, and
# which triangle of which geometry of which instance.
_TFAR, _MASK, _U, _V, _PRIMITIVE, _GEOMETRY, _INSTANCE = 8, 9, 15, 16, 17, 18, 19
_FIELDS = 24  # of 21, or more in a library built with other options
_ALIGNMENT = 64
_NOTHING = np.uint32(0xFFFFFFFF)
_TRIANGLES, _INDEX, _VERTEX, _UINT3, _FLOAT3, _ROBUST = 0, 0, 1, 0x5003, 0x9003, 4


class _Arguments(ctypes.Structure):
    """`RTCIntersectArguments`: coherent rays, any feature."""

    _fields_ = (
        ("flags", ctypes.c_uint),
        ("feature_mask", ctypes.c_uint),
        ("context", ctypes.c_void_p),
        ("filter", ctypes.c_void_p),
        ("intersect", ctypes.c_void_p),
        ("more", ctypes.c_uint64 * 4),
    )


_COHERENT = _Arguments(1 << 16, 0xFFFFFFFF)


@cache
def _library() -> ctypes.CDLL:
    """The library that embreex has loaded, whichever file it is."""
    for line in Path("/proc/self/maps").read_text(encoding="utf-8", errors="surrogateescape").splitlines():
        path = line.partition("/")[2]
        if "libembree" in path.rpartition("/")[2]:
            library = ctypes.CDLL(f"/{path}")
            for name in ("NewDevice", "NewScene", "NewGeometry", "SetNewGeometryBuffer"):
                getattr(library, f"rtc{name}").restype = ctypes.c_void_p
            return library
    raise ImportError("embreex is loaded, but no libembree is: expected the wheel of embreex from PyPI")


@cache
def _device() -> ctypes.c_void_p:
    return ctypes.c_void_p(_library().rtcNewDevice(None))


class RayCaster:
    """A triangle mesh prepared for ray queries."""

    def __init__(self, mesh: TriangleMesh) -> None:
        library, device = _library(), _device()
        self._scene = ctypes.c_void_p(library.rtcNewScene(device))
        weakref.finalize(self, library.rtcReleaseScene, self._scene)
        library.rtcSetSceneFlags(self._scene, _ROBUST)
        if len(mesh):
            geometry = ctypes.c_void_p(library.rtcNewGeometry(device, _TRIANGLES))
            _fill(geometry, _VERTEX, _FLOAT3, np.ascontiguousarray(mesh.vertices, np.float32))
            _fill(geometry, _INDEX, _UINT3, np.ascontiguousarray(mesh.triangles, np.uint32))
            library.rtcCommitGeometry(geometry)
            library.rtcAttachGeometry(self._scene, geometry)
            library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(self._scene)
        self._pointers = (
            ctypes.cast(library.rtcIntersect8, ctypes.c_void_p).value,
            self._scene.value,
            ctypes.addressof(_COHERENT),
        )

    def distances(
        self, origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.float32]:
        """(N,) distance to the first triangle along each ray, in units of the direction's length; +inf for none.

        origins, directions: (N, 3) float32, C-contiguous.
        """
        return self.hits(origins, directions)[1]

    def hits(
        self, origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """Triangle index (N,) (-1 for none), distance (N,) and barycentric u, v (N, 2) of each ray's first hit."""
        found: tuple[npt.NDArray[np.int32], npt.NDArray[np.float32], npt.NDArray[np.float32]] = _trace(
            *self._pointers, origins, directions
        )
        return found


def _fill(geometry: ctypes.c_void_p, kind: int, form: int, rows: npt.NDArray[Any]) -> None:
    """Copy (N, 3) numbers of 32 bits into a buffer of a geometry."""
    size = ctypes.c_size_t
    place = _library().rtcSetNewGeometryBuffer(geometry, kind, 0, form, size(12), size(len(rows)))
    ctypes.memmove(place, rows.ctypes.data, rows.nbytes)


@njit(cache=True, nogil=True)
def _trace(function, scene, arguments, origins, directions):  # type: ignore[no-untyped-def]
    count = len(origins)
    distance, triangle, uv = np.empty(count, np.float32), np.empty(count, np.int32), np.empty((count, 2), np.float32)
    # One packet, aligned, as reals and as whole numbers; then which of its rays there are.
    memory = np.zeros((_FIELDS + 1) * _PACKET + _ALIGNMENT // 4, np.uint32)
    skipped = (-memory.ctypes.data % _ALIGNMENT) // 4
    whole = memory[skipped : skipped + (_FIELDS + 1) * _PACKET].reshape(_FIELDS + 1, _PACKET)
    real = whole.view(np.float32)
    address = whole.ctypes.data
    for begin in range(0, count, _PACKET):
        for k in range(_PACKET):
            ray = begin + k
            whole[_FIELDS, k] = _NOTHING if ray < count else np.uint32(0)
            ray = min(ray, count - 1)
            for axis in range(3):
                real[axis, k] = origins[ray, axis]
                real[4 + axis, k] = directions[ray, axis]
            real[_TFAR, k] = np.inf
            whole[_MASK, k] = _NOTHING
            whole[_PRIMITIVE, k], whole[_GEOMETRY, k], whole[_INSTANCE, k] = _NOTHING, _NOTHING, _NOTHING
        _intersect(function, address + 4 * _FIELDS * _PACKET, scene, address, arguments)
        for k in range(min(_PACKET, count - begin)):
            distance[begin + k] = real[_TFAR, k]
            triangle[begin + k] = np.int32(whole[_PRIMITIVE, k])
            uv[begin + k, 0], uv[begin + k, 1] = real[_U, k], real[_V, k]
    return triangle, distance, uv


@intrinsic
def _intersect(typingctx, function, valid, scene, rays, arguments):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Call `rtcIntersect8(valid, scene, rays, arguments)` at the address `function`; all of them are addresses."""
    return types.void(*[types.intp] * 5), _emit


def _emit(context: Any, builder: Any, signature: Any, args: Sequence[Any]) -> Any:  # noqa: ARG001
    pointer = ir.PointerType(ir.IntType(8))
    kind = ir.FunctionType(ir.VoidType(), [pointer] * 4)
    function = builder.inttoptr(args[0], ir.PointerType(kind))
    builder.call(function, [builder.inttoptr(one, pointer) for one in args[1:]])
    return context.get_dummy_value()
