"""Mesh files of any supported format as surfaces in metres; each file is read once.

Coordinates are taken as they stand, as Gazebo takes them. That goes for glTF too, which is y-up by its specification:
gz-common's AssimpLoader keeps the transforms of the file's own nodes and adds none (graphics/src/AssimpLoader.cc,
`UpdatedRootNodeTransform`; its test LoadGLTF2Triangle expects a file's vertices unchanged).
"""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from taskslam.errors import WorldError
from taskslam.world.gazebo.collada import read_collada
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.mesh_content import declared_triangles, refuse_unknown_extensions, with_ears_clipped
from taskslam.world.gazebo.resources import Resources
from taskslam.world.gazebo.surfaces import DEFAULT_MATERIAL, Surface, check_surface
from taskslam.world.gazebo.textures import TextureStore
from taskslam.world.world import Material

_BY_TRIMESH = (".obj", ".stl", ".gltf", ".glb")


class MeshLibrary:
    """Loads mesh files, checks them and remembers them."""

    def __init__(self, resources: Resources, textures: TextureStore, left_out: LeftOut) -> None:
        self._resources, self._textures, self._left_out = resources, textures, left_out
        self._meshes: dict[Path, list[Surface]] = {}

    def load(self, path: Path) -> list[Surface]:
        """Surfaces of a COLLADA, OBJ, STL or glTF file.

        Raises WorldError for another format, a damaged file, and NaN or infinite vertices.
        """
        if path not in self._meshes:
            data = self._resources.read(path)
            suffix = path.suffix.lower()
            if suffix == ".dae":
                surfaces = read_collada(data, path, self._textures, self._left_out)
            elif suffix in _BY_TRIMESH:
                surfaces = _read_by_trimesh(data, path, self._resources, self._textures)
                lost = declared_triangles(data, suffix) - sum(len(surface.triangles) for surface in surfaces)
                if lost > 0:
                    self._left_out.damaged("part of a mesh", f"{lost} triangles of {path.name}")
            else:
                raise WorldError(f"Mesh {path} has an unknown format; expected .dae, .obj, .stl, .gltf or .glb.")
            self._meshes[path] = [check_surface(surface, str(path)) for surface in surfaces]
        return self._meshes[path]

    def submesh(self, path: Path, name: str, center: bool) -> list[Surface]:
        """The surfaces of one part of a mesh, by option moved so that their bounding box is centred on the origin.

        Raises WorldError if the mesh has no part of that name.
        """
        surfaces = self.load(path)
        chosen = [surface for surface in surfaces if name in surface.name.split("\n")]
        if not chosen:
            known = sorted({part for surface in surfaces for part in surface.name.split("\n") if part})
            raise WorldError(f"Mesh {path} has no submesh '{name}'; it has {', '.join(known) or 'no named parts'}.")
        if not center:
            return chosen
        points = np.concatenate([surface.vertices[surface.triangles].reshape(-1, 3) for surface in chosen])
        middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
        return [replace(surface, vertices=surface.vertices - middle) for surface in chosen]


class _Resolver(trimesh.resolvers.Resolver):  # type: ignore[misc]
    """Hands trimesh the files that a mesh refers to, found as Gazebo finds textures and never outside the roots."""

    def __init__(self, resources: Resources, folder: Path, textures: TextureStore) -> None:
        self._resources, self._folder, self._textures = resources, folder, textures

    def get(self, name: str) -> bytes:
        path = self._resources.find_texture(name, self._folder)
        if path is None:
            if Path(name).suffix.lower() not in (".mtl", ".bin"):
                self._textures.missing(Path(name).name)
            raise FileNotFoundError(name)
        return self._resources.read(path)

    def write(self, name: str, data: bytes) -> None:  # noqa: ARG002 - trimesh's interface
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> _Resolver:  # noqa: ARG002
        return self

    def keys(self) -> list[str]:
        return []


def _read_by_trimesh(data: bytes, path: Path, resources: Resources, textures: TextureStore) -> list[Surface]:
    suffix = path.suffix.lower()
    try:
        if suffix in (".gltf", ".glb"):
            refuse_unknown_extensions(data)
        scene = trimesh.load_scene(
            io.BytesIO(with_ears_clipped(data) if suffix == ".obj" else data),
            file_type=suffix[1:],
            resolver=_Resolver(resources, path.parent, textures),
            process=False,
            **({"split_objects": True} if suffix == ".obj" else {}),
        )
        surfaces = []
        for node in scene.graph.nodes_geometry:
            T, name = scene.graph[node]
            mesh = scene.geometry[name]
            if isinstance(mesh, trimesh.Trimesh):
                names = dict.fromkeys((str(node), str(name), str(mesh.metadata.get("name", name))))
                surfaces.append(_surface(mesh, "\n".join(names), path, textures).transformed(np.asarray(T)))
    except WorldError:
        raise
    except Exception as error:  # trimesh raises whatever its parsers meet in a damaged file
        raise WorldError(f"{path} is not a {path.suffix[1:].upper()} mesh that can be read: {error}.") from error
    if not any(len(surface.triangles) for surface in surfaces):
        # Depending on what is installed beside it, trimesh reads garbage as an empty mesh.
        raise WorldError(f"{path} is not a {path.suffix[1:].upper()} mesh that can be read: it holds no triangles.")
    return surfaces


def _surface(mesh: Any, name: str, path: Path, textures: TextureStore) -> Surface:
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    faces = np.asarray(mesh.faces, dtype=np.int64)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError("it has vertices or triangles that lack coordinates or corners")
    uv = getattr(mesh.visual, "uv", None)
    corner_uv = np.zeros((len(faces), 3, 2)) if uv is None or len(uv) == 0 else np.asarray(uv, np.float64)[faces]
    # Only normals that the file holds: computed ones would round the edges of a box.
    stored = mesh._cache.cache.get("vertex_normals")
    normals = None if stored is None or len(stored) == 0 else np.asarray(stored, dtype=np.float64)[faces]
    return Surface(vertices, faces, corner_uv, normals, _material(mesh, path, textures), name)


def _material(mesh: Any, path: Path, textures: TextureStore) -> Material:
    look = getattr(mesh.visual, "material", None)
    if look is None:
        return DEFAULT_MATERIAL
    image = getattr(look, "baseColorTexture", None) or getattr(look, "image", None)
    factor = getattr(look, "baseColorFactor", None)
    if factor is None:
        factor = getattr(look, "diffuse", None)
    rgba = np.ones(4) if factor is None else np.append(np.asarray(factor, np.float64).ravel(), 255.0)[:4] / 255.0
    texture = None
    if isinstance(image, Image.Image):
        buffer = io.BytesIO()
        try:
            image.save(buffer, format="PNG")
            texture = textures.decoded(buffer.getvalue())
        except (OSError, ValueError, SyntaxError):
            textures.damaged(f"texture of {path.name}")
        rgba[:3] = 1.0 if texture is not None and path.suffix.lower() == ".obj" else rgba[:3]
    r, g, b, a = (float(v) for v in np.clip(rgba, 0.0, 1.0))
    return Material(f"{path.stem}/{getattr(look, 'name', None) or 'material'}", (r, g, b, a), texture)
