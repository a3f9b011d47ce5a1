"""COLLADA meshes, as Gazebo reads them: units applied, up-axis not.

Gazebo scales by `<unit meter>` and ignores `<up_axis>` (gazebo-classic issue 1305), so worlds are made for meshes taken
as they are: the AWS hospital's meshes are marked Y_UP and stand along z. Parsing is pycollada's.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import collada
import numpy as np
from collada.scene import ControllerNode, GeometryNode, Node, NodeNode

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray
from taskslam.world.gazebo.document import parse_xml
from taskslam.world.gazebo.surfaces import DEFAULT_MATERIAL, Surface
from taskslam.world.gazebo.textures import TextureStore
from taskslam.world.world import Material

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_DEEPEST_NODE = 64
_NO_NUMBER = re.compile("nan|inf|#", re.IGNORECASE)  # also the 1.#QNAN of some exporters


@dataclass(frozen=True)
class _Instance:
    geometry: Any
    T: FloatArray
    names: tuple[str, ...]
    materials: dict[str, Any]


def read_collada(data: bytes, path: Path, textures: TextureStore) -> list[Surface]:
    """Surfaces of a COLLADA file in metres, by material; raises WorldError if it cannot be read."""
    root = parse_xml(data, path)  # refuses entity bombs before lxml sees them
    if root.tag.rpartition("}")[2] != "COLLADA":
        raise WorldError(f"{path} is not a COLLADA mesh that can be read: its root is <{root.tag}>.")
    _refuse_nan(root, path)
    try:
        document = collada.Collada(io.BytesIO(data), ignore=[collada.DaeError])
        unit = float(document.assetInfo.unitmeter or 1.0)
        instances = list(_instances(document))
        surfaces = [surface for instance in instances for surface in _surfaces(instance, unit, path, textures)]
    except (collada.DaeError, KeyError, ValueError, IndexError, AttributeError, TypeError) as error:
        raise WorldError(f"{path} is not a COLLADA mesh that can be read: {error}.") from error
    if not surfaces and document.errors:
        raise WorldError(f"{path} is not a COLLADA mesh that can be read: {document.errors[0]}.")
    return surfaces


def _refuse_nan(root: Element, path: Path) -> None:
    """Raise WorldError for positions that are no numbers; pycollada would turn them into zeros."""
    sources = {}
    positions = set()
    for element in root.iter():
        tag = element.tag.rpartition("}")[2]
        if tag == "source":
            sources["#" + element.get("id", "")] = element
        elif tag == "input" and element.get("semantic") == "POSITION":
            positions.add(element.get("source", ""))
    for name in sorted(positions & set(sources)):
        for array in sources[name]:
            if array.tag.endswith("float_array") and _NO_NUMBER.search(array.text or ""):
                raise WorldError(f"Mesh {path} has NaN or infinite vertices in '{name[1:]}'.")


def _instances(document: Any) -> Iterator[_Instance]:
    if document.scene is None:
        for geometry in document.geometries:
            yield _Instance(geometry, np.eye(4), (geometry.name or "", geometry.id or ""), {})
        return
    for node in document.scene.nodes:
        yield from _walk(node, np.eye(4), (), 0)


def _walk(node: Any, T: FloatArray, names: tuple[str, ...], depth: int) -> Iterator[_Instance]:
    if depth > _DEEPEST_NODE:
        raise ValueError("its nodes are nested too deeply or refer to themselves")
    if isinstance(node, Node):
        here = T @ np.asarray(node.matrix, dtype=np.float64)
        for child in node.children:
            yield from _walk(child, here, (node.name or "", node.id or ""), depth + 1)
    elif isinstance(node, NodeNode):
        yield from _walk(node.node, T, names, depth + 1)
    elif isinstance(node, GeometryNode | ControllerNode):
        geometry = node.geometry if isinstance(node, GeometryNode) else node.controller.geometry
        materials = {bound.symbol: bound.target for bound in node.materials}
        yield _Instance(geometry, T, (*names, geometry.name or "", geometry.id or ""), materials)


def _surfaces(instance: _Instance, unit: float, path: Path, textures: TextureStore) -> Iterator[Surface]:
    for primitive in instance.geometry.primitives:
        triangles = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
        if getattr(triangles, "vertex_index", None) is None or not hasattr(triangles, "ntriangles"):
            continue  # lines
        corners = np.asarray(triangles.vertex_index, dtype=np.int64).reshape(-1, 3)
        normals = None
        if triangles.normal is not None:
            normals = np.asarray(triangles.normal, dtype=np.float64)[triangles.normal_index].reshape(-1, 3, 3)
        uv = np.zeros((len(corners), 3, 2))
        if triangles.texcoordset:
            uv = np.asarray(triangles.texcoordset[0], dtype=np.float64)[triangles.texcoord_indexset[0]]
        surface = Surface(
            np.asarray(triangles.vertex, dtype=np.float64),
            corners,
            uv.reshape(-1, 3, uv.shape[-1])[..., :2],
            normals,
            _material(instance.materials.get(triangles.material), path, textures),
            "\n".join(dict.fromkeys(instance.names)),
        )
        yield surface.transformed(np.diag([unit, unit, unit, 1.0]) @ instance.T)


def _material(target: Any, path: Path, textures: TextureStore) -> Material:
    effect = getattr(target, "effect", None)
    if effect is None:
        return DEFAULT_MATERIAL
    name = f"{path.stem}/{target.name or target.id}"
    emissive = _rgb(effect.emission, (0.0, 0.0, 0.0))
    specular = _rgb(effect.specular, (0.0, 0.0, 0.0))
    alpha = _opacity(effect)
    if isinstance(effect.diffuse, collada.material.Map):
        image = effect.diffuse.sampler.surface.image
        texture = textures.find(image.path, path.parent)
        # Gazebo paints a textured mesh white below its texture.
        shade = (1.0, 1.0, 1.0) if texture is not None else DEFAULT_MATERIAL.diffuse[:3]
        return Material(name, (*shade, alpha), texture, (1.0, 1.0), emissive, specular)
    return Material(
        name, (*_rgb(effect.diffuse, DEFAULT_MATERIAL.diffuse[:3]), alpha), None, (1.0, 1.0), emissive, specular
    )


def _rgb(value: Any, default: tuple[float, float, float]) -> tuple[float, float, float]:
    if value is None or isinstance(value, collada.material.Map):
        return default
    r, g, b = (min(max(float(v), 0.0), 1.0) for v in tuple(value)[:3])
    return r, g, b


def _opacity(effect: Any) -> float:
    """Opacity by COLLADA 1.4's opaque modes; what would be wholly invisible is an exporter's slip and is opaque."""
    transparency = effect.transparency if isinstance(effect.transparency, int | float) else 1.0
    if effect.transparent is None or isinstance(effect.transparent, collada.material.Map):
        return 1.0
    r, g, b, a = (*map(float, effect.transparent), 1.0)[:4]
    if effect.opaque_mode == collada.material.OPAQUE_MODE.RGB_ZERO:
        opacity = 1.0 - transparency * (0.2126 * r + 0.7152 * g + 0.0722 * b)
    else:
        opacity = a * transparency
    return opacity if 0.0 < opacity <= 1.0 else 1.0
