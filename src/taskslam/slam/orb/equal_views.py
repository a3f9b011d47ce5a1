"""Keeps ORB-SLAM3 from ending its process where it finds no rotation between two views.

For every place that looks like an earlier one, its loop closer guesses the motion between the two views from three
points at a time (`Sim3Solver::ComputeSim3`, after Horn 1987) and keeps the guess that most other points confirm. It
divides by the length of the rotation, so zero, as of three points and themselves, becomes not a number, and Sophus
aborts: https://github.com/UZ-SLAMLab/ORB_SLAM3/issues/608, not mended in the sources that the package is built from.

The function is called through a slot that the dynamic linker fills. Here the slot gets a function of ours, which calls
ORB-SLAM3's own. Only three points whose rotation cannot be told from zero are exchanged before, for a motion that no
other point confirms. So the guess fails, and the loop closer goes on to the next, as it does after any bad one.
"""

from __future__ import annotations

import ctypes
import struct
from pathlib import Path
from typing import Any

from llvmlite import binding
from numba import carray, types

from taskslam.compiled import cfunc

COMPUTE = "_ZN9ORB_SLAM310Sim3Solver11ComputeSim3ERN5Eigen6MatrixIfLi3ELi3ELi0ELi3ELi3EEES4_"
_RELOCATIONS, _JUMP_SLOT = 4, 7  # SHT_RELA, R_X86_64_JUMP_SLOT
_ZERO = 1e-5  # rad, roughly; float32 loses an angle of 3e-7, and a pixel is 3e-3

_Floats = ctypes.POINTER(ctypes.c_float)
_Function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, _Floats, _Floats)
_FLOATS = types.CPointer(types.float32)
_SIGNATURE = types.void(types.voidptr, _FLOATS, _FLOATS)
# Known by name, so that the machine code, in which addresses would stand, can be kept from start to start.
_ORIGINAL, _COUNT = "taskslam_equal_views_original", "taskslam_equal_views_count"
_original, _count = types.ExternalFunction(_ORIGINAL, _SIGNATURE), types.ExternalFunction(_COUNT, types.void())


class EqualViews:
    """The guard of a library, for as long as the process lives. happened: how many guesses it has made fail.

    original, guarded: (solver, first three points, second three points), a point after the other.

    Raises:
        ValueError: the library has no such slot.
        OSError: it cannot be read.
    """

    def __init__(self, library: Path) -> None:
        slot, function = _slot(library.read_bytes(), COMPUTE)
        self._library = ctypes.CDLL(str(library))
        address = ctypes.cast(getattr(self._library, COMPUTE), ctypes.c_void_p).value
        assert address is not None
        self.happened = 0
        self.original = _Function(address)
        self._count = ctypes.CFUNCTYPE(None)(self._add_one)
        for name, called in ((_ORIGINAL, self.original), (_COUNT, self._count)):
            binding.add_symbol(name, ctypes.cast(called, ctypes.c_void_p).value)
        self._compiled = cfunc(_SIGNATURE)(_guarded)
        self.guarded = _Function(self._compiled.address)
        ctypes.c_void_p.from_address(address - function + slot).value = self._compiled.address

    def _add_one(self) -> None:
        self.happened += 1


def _guarded(solver: Any, first: Any, second: Any) -> None:
    """ORB-SLAM3's own, but for rotations of zero. It runs without Python's lock, in a thread of ORB-SLAM3."""
    a = carray(first, (3, 3))  # a row is a point
    b = carray(second, (3, 3))
    x = y = z = spread = 0.0  # (x, y, z) is the sine of the rotation times its axis, times about the spread
    for k in range(3):
        u0 = a[k, 0] - (1.0 * a[0, 0] + a[1, 0] + a[2, 0]) / 3.0
        u1 = a[k, 1] - (1.0 * a[0, 1] + a[1, 1] + a[2, 1]) / 3.0
        u2 = a[k, 2] - (1.0 * a[0, 2] + a[1, 2] + a[2, 2]) / 3.0
        v0 = b[k, 0] - (1.0 * b[0, 0] + b[1, 0] + b[2, 0]) / 3.0
        v1 = b[k, 1] - (1.0 * b[0, 1] + b[1, 1] + b[2, 1]) / 3.0
        v2 = b[k, 2] - (1.0 * b[0, 2] + b[1, 2] + b[2, 2]) / 3.0
        x += v1 * u2 - v2 * u1
        y += v2 * u0 - v0 * u2
        z += v0 * u1 - v1 * u0
        spread += abs(v0 * u0 + v1 * u1 + v2 * u2)
    if not abs(x) + abs(y) + abs(z) > _ZERO * spread:  # nor is it where a point is not a number
        _count()
        # A third of a turn about (1, 1, 1), which lies at the edge of a picture or beyond.
        for k in range(3):
            for c in range(3):
                a[k, c] = 1.0 if c == k else 0.0
                b[k, c] = 1.0 if c == (k + 1) % 3 else 0.0
    _original(solver, first, second)


def _slot(elf: bytes, symbol: str) -> tuple[int, int]:
    """Where, from the start of the loaded library, the slot of a symbol and the symbol itself lie."""
    try:
        return _find_slot(elf, symbol.encode() + b"\0")
    except struct.error:
        raise ValueError("not a library of this machine") from None


def _find_slot(elf: bytes, name: bytes) -> tuple[int, int]:
    (table,) = struct.unpack_from("<Q", elf, 0x28)
    size, number = struct.unpack_from("<HH", elf, 0x3A)
    # name, type, flags, address, offset, size, link, info, alignment, size of an entry
    sections = [struct.unpack_from("<IIQQQQIIQQ", elf, table + i * size) for i in range(number)]
    for section in sections:
        if section[1] != _RELOCATIONS or section[6] >= number:
            continue
        symbols = sections[section[6]]
        names = sections[symbols[6]][4] if symbols[6] < number else 0
        for at in range(section[4], section[4] + section[5], 24):
            slot, info = struct.unpack_from("<QQ", elf, at)
            if info & 0xFFFFFFFF == _JUMP_SLOT:
                start, _, _, value = struct.unpack_from("<IHHQ", elf, symbols[4] + 24 * (info >> 32))
                if value and elf.startswith(name, names + start):
                    return slot, value
    raise ValueError("no such slot")
