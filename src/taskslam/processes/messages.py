"""How two processes talk: a length prefix, a JSON header, then the raw bytes of the arrays it declares.

    magic (4 bytes) | header length (u32) | payload length (u32) | header: JSON in UTF-8 | payload

The header's `arrays` lists `[name, dtype, shape]` in the order of the payload; dtypes are little-endian and come from
a short list. Nothing is pickled: the worst that a malicious peer can send is a wrong number. Sizes are bounded before
anything is allocated, and the declared shapes must account for every byte.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import TaskSlamError

MAGIC = b"TSLM"
MAX_HEADER = 1 << 20
MAX_PAYLOAD = 256 << 20
MAX_REPLY = 1 << 20
_MOST_ARRAYS, _MOST_DIMENSIONS = 64, 8

_PREFIX = struct.Struct("<4sII")
DTYPES = {name: np.dtype(name) for name in ("<f4", "<f8", "<i4", "<i8", "<u2", "<u4", "|u1")}
_NAMES = {dtype: name for name, dtype in DTYPES.items()}
_encode_json = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False).encode

Header = dict[str, Any]
Arrays = dict[str, npt.NDArray[Any]]


class WireError(TaskSlamError):
    """The bytes on the pipe are not a message: foreign output, a wrong size, an undeclared type."""


def pack(header: Mapping[str, object], arrays: Mapping[str, npt.NDArray[Any]] | None = None) -> bytes:
    """The bytes of one message.

    Raises:
        WireError: an array's dtype is not one that travels, or header or payload is beyond its bound.
        TypeError, ValueError: the header cannot be written as JSON.
    """
    parts: list[bytes] = []
    declared: list[tuple[str, str, tuple[int, ...]]] = []
    for name, array in (arrays or {}).items():
        dtype = _NAMES.get(array.dtype)
        if dtype is None:
            raise WireError(f"array '{name}' has dtype {array.dtype}; expected one of {', '.join(DTYPES)}")
        declared.append((name, dtype, array.shape))
        parts.append(array.tobytes())
    text = _encode_json({**header, "arrays": declared} if declared else header).encode()
    size = sum(map(len, parts))
    if len(text) > MAX_HEADER or size > MAX_PAYLOAD:
        raise WireError(f"message of {len(text)} + {size} bytes; at most {MAX_HEADER} + {MAX_PAYLOAD} travel")
    return b"".join((_PREFIX.pack(MAGIC, len(text), size), text, *parts))


class MessageReader:
    """Puts messages together from chunks of bytes as they arrive. max_payload: bytes of arrays in one message."""

    def __init__(self, max_payload: int = MAX_PAYLOAD) -> None:
        self._buffer = bytearray()
        self._max_payload = max_payload

    def messages(self, chunk: bytes) -> Iterator[tuple[Header, Arrays]]:
        """Every message that `chunk` completes. The arrays are writable copies.

        Raises:
            WireError: the bytes are not a message.
        """
        buffer = self._buffer
        buffer += chunk
        at = 0
        try:
            while len(buffer) - at >= _PREFIX.size:
                magic, header_size, payload_size = _PREFIX.unpack_from(buffer, at)
                if magic != MAGIC:
                    raise WireError(f"expected a message, got the bytes {bytes(buffer[at : at + 16])!r}")
                if header_size > MAX_HEADER or payload_size > self._max_payload:
                    raise WireError(
                        f"message of {header_size} + {payload_size} bytes; expected at most "
                        f"{MAX_HEADER} + {self._max_payload}"
                    )
                start = at + _PREFIX.size
                end = start + header_size + payload_size
                if len(buffer) < end:
                    return
                header = _parse_header(buffer[start : start + header_size])
                arrays = _parse_arrays(header.pop("arrays", ()), buffer, start + header_size, end)
                at = end
                yield header, arrays
        finally:
            del buffer[:at]


def _parse_header(text: bytearray) -> Header:
    try:
        header = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WireError(f"message header is not JSON: {str(error)[:200]}") from error
    if not isinstance(header, dict):
        raise WireError("message header is not a JSON object")
    return header


def _parse_arrays(declared: object, buffer: bytearray, start: int, end: int) -> Arrays:
    arrays: Arrays = {}
    at = start
    if not isinstance(declared, (list, tuple)) or len(declared) > _MOST_ARRAYS:
        raise WireError(f"the declared arrays are not a list of at most {_MOST_ARRAYS}")
    for entry in declared:
        try:
            name, dtype_name, shape = entry
            dtype = DTYPES[dtype_name]
            if not isinstance(name, str) or len(shape) > _MOST_DIMENSIONS:
                raise ValueError(f"a name that is no text, or more than {_MOST_DIMENSIONS} dimensions")
            if not all(type(n) is int and 0 <= n <= MAX_PAYLOAD for n in shape):
                raise ValueError("negative, fractional or boundless shape")
            stop = at + math.prod(shape) * dtype.itemsize
        except (KeyError, TypeError, ValueError) as error:
            raise WireError(f"array declaration {repr(entry)[:80]} is not [name, dtype, shape]") from error
        if stop > end:
            raise WireError(f"array '{name:.80}' {dtype_name} {shape} is larger than the message that holds it")
        arrays[name] = np.frombuffer(buffer[at:stop], dtype=dtype).reshape(shape)
        at = stop
    if at != end:
        raise WireError(f"{end - at} bytes of the message are declared by no array")
    return arrays
