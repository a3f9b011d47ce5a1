"""Tag families: which squares of a tag are black and which are white, as the detector's own code tables say.

The cells come from the C library that also detects (`apriltag_to_image`), so that artwork, orientation and detection
cannot disagree: the first row of cells is the top of the official artwork.
"""

from __future__ import annotations

import ctypes
import importlib.util
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError, did_you_mean
from taskslam.realworld.extra import missing

DEFAULT_FAMILY = "tag36h11"

# Families whose outline is the outer edge of a black border. tag16h5 is left out: a quarter of tag-shaped decoys pass
# for one of its tags, against none of 3,360 for tag36h11.
CELLS = {"tag36h11": 8, "tag36h10": 8, "tag25h9": 7}

BoolArray = npt.NDArray[np.bool_]


class _ImageU8(ctypes.Structure):
    _fields_ = (
        ("width", ctypes.c_int32),
        ("height", ctypes.c_int32),
        ("stride", ctypes.c_int32),
        ("buf", ctypes.POINTER(ctypes.c_uint8)),
    )


def check_family(family: str) -> None:
    """Raise InputError unless `family` is one of `CELLS`."""
    if family not in CELLS:
        raise InputError(f"tag family '{family}': expected one of {', '.join(CELLS)}.{did_you_mean(family, CELLS)}")


def family_size(family: str = DEFAULT_FAMILY) -> int:
    """How many tags a family has; ids run from 0 to one less.

    Raises:
        InputError: an unknown family, or the detector library is not installed.
    """
    # The first field of the library's family structure, in every release so far, is the number of codes.
    return ctypes.c_uint32.from_address(_family(family)).value


@cache
def code_cells(family: str, tag_id: int) -> BoolArray:
    """Cells of a tag, (n, n) read-only, True where white; row 0 is the top of the official artwork, column 0 its left.

    The black border is included (its outer edge is the tag's outline, between whose corners sizes are measured), the
    white quiet zone around it is not: n = 8 for tag36h11.

    Raises:
        InputError: an unknown family or id, or the detector library is not installed.
    """
    count = family_size(family)
    if not 0 <= tag_id < count:
        raise InputError(f"tag id {tag_id}: expected 0 to {count - 1} in family {family}")
    library = _library()
    pointer = library.apriltag_to_image(_family(family), tag_id)
    image = pointer.contents
    pixels = np.ctypeslib.as_array(image.buf, (image.height, image.stride))[:, : image.width] > 127
    n = CELLS[family]
    quiet = (image.width - n) // 2
    cells = pixels[quiet : quiet + n, quiet : quiet + n].copy()
    library.image_u8_destroy(pointer)
    cells.setflags(write=False)
    return cells


@cache
def _family(family: str) -> int:
    check_family(family)
    create = getattr(_library(), f"{family}_create", None)
    if create is None:
        raise InputError(f"tag family '{family}': the installed AprilTag library does not have it")
    create.restype = ctypes.c_void_p
    address: int = create()
    return address


@cache
def _library() -> Any:
    for package in ("apriltag", "pyapriltags"):
        spec = importlib.util.find_spec(package)
        for folder in (spec.submodule_search_locations or ()) if spec is not None else ():
            for file in sorted(Path(folder).rglob("libapriltag.so*")):
                library = ctypes.CDLL(str(file))
                library.apriltag_to_image.restype = ctypes.POINTER(_ImageU8)
                library.apriltag_to_image.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
                library.image_u8_destroy.argtypes = (ctypes.POINTER(_ImageU8),)
                return library
    raise missing("The AprilTag library")
