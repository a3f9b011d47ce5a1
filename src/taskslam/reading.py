"""Files that somebody else wrote, read with bounds: the one place that opens a file for reading, and all its limits.

Only ordinary files are opened, so that a pipe or a device where a file belongs ends in a sentence and not in waiting.
What a file declares (its size, an array's shape, a picture's width) is looked at before anything is allocated. The
caller names the error that carries the sentence, and `what`: the file's noun, such as `scenario`.
"""

from __future__ import annotations

import gzip
import io
import math
import os
import stat
import sys
import warnings
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from pydantic_core import from_json

if TYPE_CHECKING:
    from PIL.Image import Image

MIB = 1 << 20

COMPRESSED = ".gz"
LARGEST_WRITTEN_BY_HAND = MIB  # YAML, waypoint files
LARGEST_KEPT_PICTURE = MIB  # of an arrival, inside a page
LARGEST_MANIFEST = 64 * MIB
LARGEST_LOG = 64 * MIB  # of arrivals
LARGEST_JOURNAL = 256 * MIB
LARGEST_PICTURE = 512 * MIB
LARGEST_ARCHIVE = 512 * MIB  # all arrays of a method's map together
LARGEST_CACHED_WORLD = 8192 * MIB
LARGEST_WORLD_FILE = 512 * MIB  # a world, a mesh, a texture
LARGEST_TABLE = 1024 * MIB  # ten million poses
LARGEST_METRICS = 4096 * MIB  # ten thousand runs take half a gigabyte

LARGEST_NUMBER = 1e50  # of a coordinate, in any unit: squares of squares are still finite
MOST_PIXELS = 1 << 27  # of a camera's picture
MOST_TEXTURE_PIXELS = 1 << 26
MOST_HEIGHTS = 2100 * 2100  # of a terrain, which has twice as many triangles
MOST_CELLS = 1 << 25  # of a floor plan: a hall with sides of 290 m in cells of 5 cm
MOST_LINES = 1_000_000  # of a journal
MOST_TRIANGLES = 20_000_000  # of a world
MOST_ENTRIES = 100_000  # of a folder that a world names for its materials, with all below

Arrays = dict[str, npt.NDArray[Any]]


def is_file(path: Path) -> bool:
    """Whether there is an ordinary file; never raises, as `Path.is_file` does for a name that is too long."""
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: Path) -> bool:
    """Whether there is a folder; never raises."""
    return os.path.isdir(path)  # noqa: PTH112


def is_there(path: Path) -> bool:
    """Whether there is anything; never raises."""
    return os.path.exists(path)  # noqa: PTH110


class OrdinaryFile(io.BufferedReader):
    """An open file that allocates no more for a `read` than it holds, whatever size a damaged header asked for."""

    def __init__(self, raw: io.FileIO, size: int) -> None:
        super().__init__(raw)
        self._size = size

    def read(self, size: int | None = -1, /) -> bytes:
        """At most so many bytes, and none that came after it was opened."""
        left = max(self._size - self.tell(), 0)
        return super().read(left if size is None or size < 0 else min(size, left))


def open_file(path: Path, what: str, error: type[Exception], largest: int | None = None) -> OrdinaryFile:
    """An ordinary file, opened for reading bytes. largest: bytes that it may hold; None where it is read as a stream.

    Raises `error`: it cannot be opened, is a folder, a pipe or a device, or is larger.
    """
    try:
        # Without O_NONBLOCK, opening a pipe waits for somebody who writes into it.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except (OSError, ValueError) as fault:  # ValueError: a null byte or a lone surrogate in the path
        raise error(f"{path}: cannot read the {what}: {getattr(fault, 'strerror', None) or fault}") from fault
    status = os.fstat(descriptor)
    wrong = ""
    if not stat.S_ISREG(status.st_mode):
        found = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe or a device"
        wrong = f"{path}: cannot read the {what}: found {found}, expected a file"
    elif largest is not None and status.st_size > largest:
        wrong = f"{path}: larger than {largest / MIB:g} MB; expected a file that describes the {what}"
    if wrong:
        os.close(descriptor)
        raise error(wrong)
    return OrdinaryFile(io.FileIO(descriptor), status.st_size)


def read_bytes(path: Path, what: str, error: type[Exception], largest: int) -> bytes:
    """All bytes of a file, as many as it had when it was opened; of one that ends in `.gz`, what is compressed in it.

    Raises `error` as `open_file` does, or because a compressed file is damaged or holds more than `largest`.
    """
    with open_file(path, what, error, largest) as file:
        try:
            if path.suffix != COMPRESSED:
                return file.read()
            with gzip.GzipFile(fileobj=file) as whole:
                content = whole.read(largest + 1)
        except (OSError, EOFError, zlib.error) as fault:
            raise error(f"{path}: cannot read the {what}: {getattr(fault, 'strerror', None) or fault}") from fault
    if len(content) > largest:
        raise error(f"{path}: holds more than {largest / MIB:g} MB; expected a file that describes the {what}")
    return content


def read_text(path: Path, what: str, error: type[Exception], largest: int) -> str:
    """The text of a file in UTF-8. Raises `error` as `open_file` does, or because it is not UTF-8."""
    try:
        return read_bytes(path, what, error, largest).decode("utf-8")
    except UnicodeDecodeError:
        raise error(f"{path}: cannot read the {what}: not UTF-8 text") from None


def read_json(path: Path, what: str, error: type[Exception], largest: int) -> Any:
    """The value of a JSON file, its numbers finite. Raises `error` as `open_file` does, or because it is not JSON."""
    data = read_bytes(path, what, error, largest)
    try:
        return from_json(data, allow_inf_nan=False)
    except ValueError as fault:  # also for deep nesting, huge integers and lone surrogates
        raise error(f"{path}: cannot read the {what}: not JSON: {fault}") from None


def read_arrays(path: Path, what: str, error: type[Exception], largest: int) -> Arrays:
    """All arrays of an npz archive, nothing pickled. largest: bytes of all arrays together.

    Raises `error` as `open_file` does, or because the archive is damaged or declares more than it may hold.
    """
    with open_file(path, what, error) as file:
        try:
            return arrays_in(file, largest)
        except Exception as fault:  # of many kinds: zipfile's, zlib's, numpy's own, what `ast` meets in a header
            why = " ".join(str(fault).split())[:200] or type(fault).__name__
            raise error(f"{path}: not a {what} or cut short: {why}") from fault


def read_array(path: Path, what: str, error: type[Exception], largest: int) -> npt.NDArray[Any]:
    """The array of an npy file, not pickled. largest: bytes. Raises `error` as `read_arrays` does."""
    with open_file(path, what, error, largest) as file:
        try:
            return _array_of(file, path.name, os.fstat(file.fileno()).st_size)
        except Exception as fault:  # numpy's own, what `ast` meets in a header
            why = " ".join(str(fault).split())[:200] or type(fault).__name__
            raise error(f"{path}: not a {what} or cut short: {why}") from fault


def arrays_in(file: IO[bytes], largest: int) -> Arrays:
    """As `read_arrays`, from an open file; raises whatever zipfile and numpy raise, and ValueError."""
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        total = sum(member.file_size for member in members)
        if total > largest:
            raise ValueError(f"it declares {total} bytes, expected at most {largest}")
        return {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> npt.NDArray[Any]:
    with archive.open(member) as file:
        return _array_of(file, member.filename, member.file_size)


def _array_of(file: IO[bytes], name: str, size: int) -> npt.NDArray[Any]:
    version = np.lib.format.read_magic(file)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read_header(file)
    if math.prod(shape) * kind.itemsize != size - file.tell():
        raise ValueError(f"{name} declares the shape {shape}, which is not its size")
    if kind.kind not in "biufU":
        raise ValueError(f"{name} holds {kind}; expected numbers or text")
    file.seek(0)
    array: npt.NDArray[Any] = np.lib.format.read_array(file, allow_pickle=False)
    letters = np.frombuffer(array.tobytes(), np.dtype("u4").newbyteorder(kind.byteorder)) if kind.kind == "U" else None
    if letters is not None and letters.max(initial=0) > sys.maxunicode:
        raise ValueError(f"{name} holds text with letters that there are not")
    return array


@contextmanager
def opened_picture(
    content: bytes, where: str, error: type[Exception], formats: tuple[str, ...], most_pixels: int = MOST_PIXELS
) -> Iterator[Image]:
    """The picture that some bytes hold, its size known but not yet decoded; what the body meets in it is told too.

    where: how the sentence calls it. Raises `error`: not a picture of these formats, damaged, cut off, too large.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, which we bound, and of oddities inside
            with Image.open(io.BytesIO(content), formats=formats) as picture:
                if picture.width * picture.height > most_pixels:
                    raise error(
                        f"{where}: {picture.width} x {picture.height} px; expected at most {most_pixels} pixels"
                    )
                yield picture
    except error:
        raise
    except Exception as fault:  # the decoders' errors are of many kinds
        why = " ".join(str(fault).split())[:200] or type(fault).__name__
        raise error(f"{where}: not a whole picture ({why}); expected {', '.join(formats)}") from fault
