"""What OBJ, STL and glTF files declare, looked at beside the library that reads them, which passes over what it cannot.

A file's own count of triangles is held against what came of it; glTF names the extensions without which it means
nothing; OBJ polygons are cut into triangles as they are, not into fans.
"""

from __future__ import annotations

import re
import struct
from typing import Any

import numpy as np
from pydantic_core import from_json

from taskslam.world.gazebo.polygons import is_concave, polygon_corners

_FACE = re.compile(rb"^[ \t]*f[ \t]+([^\n#]*)", re.MULTILINE)
_VERTEX = re.compile(rb"^[ \t]*v[ \t]+([^\n#]*)", re.MULTILINE)
_POLYGON = re.compile(rb"^[ \t]*f(?:[ \t]+[^\s#]+){4}", re.MULTILINE)
_CONTINUED = re.compile(rb"\\[ \t]*\r?\n")
_LOOKS_ONLY = re.compile(r"KHR_(?:materials_|texture_|lights_|xmp)|EXT_(?:texture_|lights_)|MSFT_texture|KHR_animation")
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # modes of glTF
_MODES = (_TRIANGLES, _STRIP, _FAN)


def with_ears_clipped(data: bytes) -> bytes:
    """An OBJ whose concave polygons are triangles; all else stays as it is."""
    data = _CONTINUED.sub(b" ", data)
    if not _POLYGON.search(data):
        return data
    vertices = _obj_vertices(data)
    starts = np.array([found.start() for found in _VERTEX.finditer(data)])

    def cut(face: re.Match[bytes]) -> bytes:
        words = face[1].split()
        if len(words) < 4:
            return face[0]
        index = np.array([int(word.split(b"/")[0]) for word in words])
        before = int(np.searchsorted(starts, face.start()))
        ring = vertices[np.where(index > 0, index - 1, before + index)]
        count = np.array([len(words)])
        if not is_concave(ring, count)[0]:
            return face[0]
        if b"-" in face[1]:
            words = [_absolute(word, before) for word in words]
        triangles = polygon_corners(ring, count)
        return b"\n".join(b"f " + b" ".join(words[corner] for corner in row) for row in triangles)

    return _FACE.sub(cut, data)


def _absolute(word: bytes, before: int) -> bytes:
    """A corner whose vertex is counted from the end, counted from the start; the rest of it is left to the reader."""
    vertex, slash, rest = word.partition(b"/")
    return b"%d" % (before + int(vertex) + 1) + slash + rest if int(vertex) < 0 else word


def _obj_vertices(data: bytes) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([[float(word) for word in found[1].split()[:3]] for found in _VERTEX.finditer(data)]).reshape(-1, 3)


def declared_triangles(data: bytes, suffix: str) -> int:
    """How many triangles a file of a format says that it holds; 0 where it does not say."""
    if suffix == ".obj":
        return sum(max(len(found[1].split()) - 2, 0) for found in _FACE.finditer(_CONTINUED.sub(b" ", data)))
    if suffix == ".stl":
        (count,) = struct.unpack_from("<I", data, 80) if len(data) >= 84 else (0,)
        return int(count) if len(data) == 84 + 50 * count else data.lower().count(b"endfacet")
    return _declared_by_gltf(gltf_header(data))


def _declared_by_gltf(header: dict[str, Any]) -> int:
    """Triangles of a glTF's scene, each mesh as often as a node shows it."""
    accessors, meshes, nodes = (header.get(key) or [] for key in ("accessors", "meshes", "nodes"))
    shown = [node["mesh"] for node in nodes if "mesh" in node]
    total = 0
    for mesh in shown:
        for primitive in meshes[mesh].get("primitives", ()):
            mode = primitive.get("mode", 4)
            source = primitive.get("indices", primitive.get("attributes", {}).get("POSITION"))
            if mode in _MODES and source is not None:
                count = int(accessors[source]["count"])
                total += count // 3 if mode == _TRIANGLES else max(count - 2, 0)
    return total


def refuse_unknown_extensions(data: bytes) -> None:
    """Raise ValueError where a glTF requires an extension, such as Draco's compression, that is not read."""
    required = gltf_header(data).get("extensionsRequired") or []
    unknown = [str(name) for name in required if not _LOOKS_ONLY.match(str(name))]
    if unknown:
        raise ValueError(f"it needs {', '.join(unknown)}, which is not read; export it without compression")


def gltf_header(data: bytes) -> dict[str, Any]:
    """The JSON of a .gltf or .glb file. Raises ValueError."""
    if data[:4] == b"glTF":
        if len(data) < 20:
            raise ValueError("it is cut short")
        (length,) = struct.unpack_from("<I", data, 12)
        data = data[20 : 20 + length]
    header = from_json(data)
    if not isinstance(header, dict):
        raise ValueError("its header is no object")
    return header
