"""`Surface`: triangles of one look, as meshes and primitives deliver them; and `MeshBuilder`, which gathers them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from taskslam.errors import WorldError, WorldTooLargeError
from taskslam.geometry import FloatArray
from taskslam.reading import MOST_TRIANGLES
from taskslam.world.world import Material, TriangleMesh

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


def check_surface(surface: Surface, where: str) -> Surface:
    """The surface without zero-area triangles and with unit normals.

    Raises WorldError for NaN, infinite or absent vertices.
    """
    if len(surface.triangles) and (
        surface.triangles.min(initial=0) < 0 or surface.triangles.max(initial=0) >= len(surface.vertices)
    ):
        raise WorldError(f"Mesh {where} refers to vertices that it does not have.")
    used = surface.vertices[surface.triangles]
    bad = ~(np.abs(used.reshape(-1, 9)) < _LARGEST).all(axis=1)
    if bad.any():
        raise WorldError(
            f"Mesh {where} has NaN or infinite vertices in {np.count_nonzero(bad)} of {len(used)} triangles."
        )
    face = np.cross(used[:, 1] - used[:, 0], used[:, 2] - used[:, 0])
    length = np.linalg.norm(face, axis=1)
    keep = length > 0.0
    flat = np.repeat((face[keep] / length[keep, None])[:, None], 3, axis=1)
    normals = flat
    if surface.normals is not None:
        given = surface.normals[keep]
        size = np.linalg.norm(given, axis=2, keepdims=True)
        usable = np.isfinite(size) & (size > 1e-12)
        normals = np.where(usable, given / np.where(usable, size, 1.0), flat)
    return replace(
        surface,
        triangles=surface.triangles[keep],
        uv=np.nan_to_num(surface.uv[keep], nan=0.0, posinf=0.0, neginf=0.0),
        normals=normals,
        metres=None if surface.metres is None else surface.metres[keep],
    )


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


@dataclass
class MeshBuilder:
    """Gathers surfaces, already in the world frame, into one `TriangleMesh`."""

    table: MaterialTable
    _parts: list[tuple[Surface, int, int]] = field(default_factory=list)
    _count: int = 0

    def add(self, surface: Surface, owner: int) -> None:
        """Add a checked surface that belongs to model `owner`; triangles without area in float32 are dropped.

        Raises WorldTooLargeError where they become too many.
        """
        corners = surface.vertices.astype(np.float32)[surface.triangles].astype(np.float64)
        keep = np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0.0, axis=1)
        if not keep.all():
            normals = None if surface.normals is None else surface.normals[keep]
            surface = replace(surface, triangles=surface.triangles[keep], uv=surface.uv[keep], normals=normals)
        self._count += len(surface.triangles)
        if self._count > MOST_TRIANGLES:
            raise WorldTooLargeError(
                f"The world comes to more than {MOST_TRIANGLES} triangles; expected coarser models."
            )
        if len(surface.triangles):
            self._parts.append((surface, self.table.index(surface.material), owner))

    def build(self) -> TriangleMesh:
        """All surfaces as one mesh; vertices that no triangle uses are left out."""
        vertices, triangles, material, uv, normals, owner = [], [], [], [], [], []
        offset = 0
        for surface, material_index, owner_index in self._parts:
            used, compact = np.unique(surface.triangles, return_inverse=True)
            count = len(surface.triangles)
            vertices.append(surface.vertices[used].astype(np.float32))
            triangles.append((compact.reshape(count, 3) + offset).astype(np.int32))
            material.append(np.full(count, material_index, np.int32))
            uv.append(surface.uv.astype(np.float32))
            normals.append(np.asarray(surface.normals, dtype=np.float32))
            owner.append(np.full(count, owner_index, np.int32))
            offset += len(used)
        if not self._parts:
            return TriangleMesh(
                np.empty((0, 3), np.float32), np.empty((0, 3), np.int32), np.empty(0, np.int32),
                np.empty((0, 3, 2), np.float32), np.empty((0, 3, 3), np.float32), np.empty(0, np.int32),
            )  # fmt: skip
        return TriangleMesh(
            np.concatenate(vertices),
            np.concatenate(triangles),
            np.concatenate(material),
            np.concatenate(uv),
            np.concatenate(normals),
            np.concatenate(owner),
        )
