"""`Surface`: triangles of one look, as meshes and primitives deliver them; and `MeshBuilder`, which gathers them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import WorldError, WorldTooLargeError
from taskslam.geometry import FloatArray
from taskslam.reading import MOST_TRIANGLES
from taskslam.world.world import Material, TriangleMesh

_BLOCK = 1 << 16  # triangles
_LARGEST = 1e9  # metres; beyond it products of coordinates lose all meaning
DEFAULT_MATERIAL = Material("default", diffuse=(0.7, 0.7, 0.7, 1.0))


@dataclass(frozen=True)
class Surface:
    """Triangles of one material in a frame of their own.

    vertices: (V, 3) float64; triangles: (T, 3) int; normals: (T, 3, 3) per corner or None for flat shading; uv:
    (T, 3, 2) per corner; metres: (T, 3, 2) the same plane coordinates in metres, where a primitive can give them
    (for materials that repeat at their true size); name: what `<submesh>` calls it.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.int64]
    uv: FloatArray
    normals: FloatArray | None = None
    material: Material = DEFAULT_MATERIAL
    name: str = ""
    metres: FloatArray | None = None

    def transformed(self, T: FloatArray) -> Surface:
        """The surface under an affine (4, 4) map; a reflection turns the winding, so that outside stays outside."""
        linear = T[:3, :3]
        vertices = self.vertices @ linear.T + T[:3, 3]
        triangles, uv, metres, normals = self.triangles, self.uv, self.metres, self.normals
        if normals is not None and abs(np.linalg.det(linear)) > 1e-18:
            normals = normals @ np.linalg.inv(linear)  # inverse transpose, for row vectors
        else:
            normals = None
        if np.linalg.det(linear) < 0:
            triangles, uv = triangles[:, ::-1], uv[:, ::-1]
            metres = None if metres is None else metres[:, ::-1]
            normals = None if normals is None else normals[:, ::-1]
        return replace(self, vertices=vertices, triangles=triangles, uv=uv, normals=normals, metres=metres)

    def chosen(self, keep: npt.NDArray[np.bool_]) -> Surface:
        """Some of its triangles, (T,); itself where they are all."""
        if keep.all():
            return self
        normals, metres = (None if array is None else array[keep] for array in (self.normals, self.metres))
        return replace(self, triangles=self.triangles[keep], uv=self.uv[keep], normals=normals, metres=metres)


def check_surface(surface: Surface, where: str) -> Surface:
    """The surface without zero-area triangles and with unit normals.

    Raises WorldError for NaN, infinite or absent vertices.
    """
    if len(surface.triangles) and (
        surface.triangles.min(initial=0) < 0 or surface.triangles.max(initial=0) >= len(surface.vertices)
    ):
        raise WorldError(f"Mesh {where} refers to vertices that it does not have.")
    count = len(surface.triangles)
    keep = np.empty(count, dtype=np.bool_)
    normals, bad = np.empty((count, 3, 3)), 0
    for some in _blocks(count):
        used = surface.vertices[surface.triangles[some]]
        bad += int(np.count_nonzero(~(np.abs(used.reshape(-1, 9)) < _LARGEST).all(axis=1)))
        face = np.cross(used[:, 1] - used[:, 0], used[:, 2] - used[:, 0])
        length = np.linalg.norm(face, axis=1)
        keep[some] = length > 0.0
        flat = (face / np.where(length > 0.0, length, 1.0)[:, None])[:, None]
        normals[some] = flat if surface.normals is None else _unit(surface.normals[some], flat)
    if bad:
        raise WorldError(f"Mesh {where} has NaN or infinite vertices in {bad} of {count} triangles.")
    surface = replace(surface, normals=normals).chosen(keep)
    finite = np.isfinite(surface.uv).all()
    return surface if finite else replace(surface, uv=np.nan_to_num(surface.uv, nan=0.0, posinf=0.0, neginf=0.0))


def _unit(given: FloatArray, flat: FloatArray) -> FloatArray:
    """(T, 3, 3) normals of length 1; `flat` (T, 1, 3) where one has no direction."""
    size = np.linalg.norm(given, axis=2, keepdims=True)
    usable = np.isfinite(size) & (size > 1e-12)
    return np.where(usable, given / np.where(usable, size, 1.0), flat)


def _blocks(count: int) -> Iterator[slice]:
    """So many triangles in pieces, so that what is computed on the way needs little memory."""
    yield from (slice(begin, min(begin + _BLOCK, count)) for begin in range(0, count, _BLOCK))


class MaterialTable:
    """The materials of a world, each once."""

    def __init__(self) -> None:
        self.materials: list[Material] = []
        self._index: dict[tuple[object, ...], int] = {}

    def index(self, material: Material) -> int:
        """Index of a material, added if it is new. Textures are compared by identity: equal files are loaded once."""
        texture = None if material.texture is None else id(material.texture)
        key = (material.name, material.diffuse, texture, material.texture_scale, material.emissive, material.specular)
        if key not in self._index:
            self._index[key] = len(self.materials)
            self.materials.append(material)
        return self._index[key]


_COLUMNS: tuple[tuple[tuple[int, ...], type], ...] = (
    ((3,), np.float32), ((3,), np.int32), ((), np.int32), ((3, 2), np.float32), ((3, 3), np.float32), ((), np.int32),
)  # fmt: skip
"""Of `TriangleMesh`, in its order: shape of an entry and kind."""


@dataclass
class MeshBuilder:
    """Gathers surfaces, already in the world frame, into one `TriangleMesh`."""

    table: MaterialTable
    _columns: tuple[list[npt.NDArray[Any]], ...] = field(default_factory=lambda: tuple([] for _ in _COLUMNS))
    _count: int = 0
    _vertices: int = 0

    def add(self, surface: Surface, owner: int) -> None:
        """Add a checked surface that belongs to model `owner`; triangles without area in float32 are dropped.

        Raises WorldTooLargeError where they become too many.
        """
        vertices = surface.vertices.astype(np.float32)
        keep = np.empty(len(surface.triangles), dtype=np.bool_)
        for some in _blocks(len(keep)):
            corners = vertices[surface.triangles[some]].astype(np.float64)
            keep[some] = np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0.0, axis=1)
        surface = surface.chosen(keep)
        count = len(surface.triangles)
        self._count += count
        if self._count > MOST_TRIANGLES:
            raise WorldTooLargeError(
                f"The world comes to more than {MOST_TRIANGLES} triangles; expected coarser models."
            )
        if not count:
            return
        used = np.zeros(len(vertices), dtype=np.bool_)
        used[surface.triangles] = True
        new = (np.cumsum(used) - 1 + self._vertices).astype(np.int32)
        columns = (
            vertices[used],
            new[surface.triangles],
            np.full(count, self.table.index(surface.material), np.int32),
            surface.uv.astype(np.float32),
            np.asarray(surface.normals, dtype=np.float32),
            np.full(count, owner, np.int32),
        )
        for parts, column in zip(self._columns, columns, strict=True):
            parts.append(column)
        self._vertices += len(columns[0])

    def build(self) -> TriangleMesh:
        """All surfaces as one mesh, which the builder then no longer holds; unused vertices are left out."""
        whole = []
        for parts, (width, kind) in zip(self._columns, _COLUMNS, strict=True):
            whole.append(parts[0] if len(parts) == 1 else np.concatenate([np.empty((0, *width), kind), *parts]))
            parts.clear()
        return TriangleMesh(*whole)
