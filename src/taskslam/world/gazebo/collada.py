"""COLLADA meshes, as Gazebo reads them: units applied, up-axis not.

Gazebo scales by `<unit meter>` and ignores `<up_axis>` (gazebo-classic issue 1305), so worlds are made for meshes taken
as they are: the AWS hospital's meshes are marked Y_UP and stand along z.

Geometries and materials are read by pycollada, which leaves out without a word what it cannot read. The scene, which
says what is shown and where, is walked here, so that a geometry that is shown and not there is named, and a broken
material costs no more than the look.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import collada
import numpy as np
import numpy.typing as npt
from collada.polylist import Polylist

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray
from taskslam.world.gazebo.document import parse_xml
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.polygons import polygon_corners
from taskslam.world.gazebo.surfaces import DEFAULT_MATERIAL, Surface
from taskslam.world.gazebo.textures import TextureStore
from taskslam.world.world import Material

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_DEEPEST_NODE = 64
_MOST_INSTANCES = 100_000  # nodes that instantiate others twice over grow without bound
_READ_BY_PYCOLLADA = ("asset", "library_geometries", "library_images", "library_effects", "library_materials")
_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_NO_NUMBER = re.compile("nan|inf|#", re.IGNORECASE)  # also the 1.#QNAN of some exporters


@dataclass(frozen=True)
class _Instance:
    """A geometry that the scene shows. geometry: its id; names: of its node and itself; materials: id by symbol."""

    geometry: str
    T: FloatArray
    names: tuple[str, ...]
    materials: dict[str, str]


def read_collada(data: bytes, path: Path, textures: TextureStore, left_out: LeftOut) -> list[Surface]:
    """Surfaces of a COLLADA file in metres, by material; geometries that cannot be read are noted.

    Raises WorldError if none can be.
    """
    root = parse_xml(data, path)  # refuses entity bombs before lxml sees them
    if root.tag.rpartition("}")[2] != "COLLADA":
        raise WorldError(f"{path} is not a COLLADA mesh that can be read: its root is <{root.tag}>.")
    _refuse_nan(root, path)
    try:
        instances = list(_instances(root))
        document = _libraries(root)
        unit = float(document.assetInfo.unitmeter or 1.0)
        surfaces: list[Surface] = []
        lost: dict[str, int] = {}
        for instance in instances:
            geometry = document.geometries.get(instance.geometry)
            if geometry is None:
                lost[instance.geometry] = lost.get(instance.geometry, 0) + 1
            else:
                surfaces += _surfaces(geometry, instance, document, unit, path, textures)
        _note_lost_primitives(root, document, lost)
        for name in sorted({name for instance in instances for name in instance.materials.values()}):
            if name not in document.materials:
                left_out.damaged("material", f"{name} of {path.name}")
    except (collada.DaeError, KeyError, ValueError, IndexError, AttributeError, TypeError) as error:
        raise WorldError(f"{path} is not a COLLADA mesh that can be read: {error}.") from error
    why = f" ({document.errors[0]})" if document.errors else ""
    if not surfaces and (document.errors or lost):
        raise WorldError(f"{path} is not a COLLADA mesh that can be read: no geometry is whole{why}.")
    for name in lost:
        left_out.damaged("part of a mesh", f"geometry '{name}' of {path.name}{why}")
    return surfaces


def _libraries(root: Element) -> Any:
    """Geometries and looks, as pycollada reads them."""
    only = ET.Element(root.tag, root.attrib)
    only.extend(child for child in root if _tag(child) in _READ_BY_PYCOLLADA)
    return collada.Collada(io.BytesIO(ET.tostring(only)), ignore=[collada.DaeError])


def _note_lost_primitives(root: Element, document: Any, lost: dict[str, int]) -> None:
    """Add geometries of which pycollada delivers fewer primitives than they declare, or holes that it does not read."""
    for element in root.iter():
        geometry = document.geometries.get(element.get("id", "")) if _tag(element) == "geometry" else None
        if geometry is None:
            continue
        declared = [part for mesh in element for part in mesh if _tag(part) in _PRIMITIVES]
        loaded = [part for part in geometry.primitives if isinstance(part, Polylist) or hasattr(part, "ntriangles")]
        holes = any(_tag(part) == "ph" for primitive in declared for part in primitive)
        if len(loaded) < len(declared) or holes:
            lost.setdefault(geometry.id, 1)


def _tag(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


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


def _instances(root: Element) -> Iterator[_Instance]:
    """All geometries that the file's scene shows, or all that there are where it has no scene."""
    ids = {element.get("id"): element for element in root.iter() if element.get("id")}
    shown = [_target(element) for element in root.iter() if _tag(element) == "instance_visual_scene"]
    if shown and shown[0] in ids:
        yield from _walk(ids[shown[0]], ids, np.eye(4), (), [0])
        return
    for element in root.iter():
        if _tag(element) == "geometry":
            yield _Instance(element.get("id", ""), np.eye(4), (element.get("name", ""), element.get("id", "")), {})


def _walk(
    node: Element, ids: dict[str | None, Element], T: FloatArray, above: tuple[Element, ...], count: list[int]
) -> Iterator[_Instance]:
    if len(above) > _DEEPEST_NODE or node in above:
        raise ValueError("its nodes are nested too deeply or refer to themselves")
    for child in node:
        kind = _tag(child)
        if kind in _TRANSFORMS:
            T = T @ _TRANSFORMS[kind](np.array([float(word) for word in (child.text or "").split()]))
        elif kind in ("lookat", "skew"):
            raise ValueError(f"it places a node by <{kind}>, which is not read")
    for child in node:
        kind, target = _tag(child), _target(child)
        count[0] += 1
        if count[0] > _MOST_INSTANCES:
            raise ValueError(f"its scene comes to more than {_MOST_INSTANCES} nodes")
        if kind == "node":
            yield from _walk(child, ids, T, (*above, node), count)
        elif kind == "instance_node":
            if target not in ids:
                raise ValueError(f"its scene shows the node '{target}', which is not there")
            yield from _walk(ids[target], ids, T, (*above, node), count)
        elif kind in ("instance_geometry", "instance_controller"):
            skins = [_target(part, "source") for part in _parts(ids.get(target), "skin")]
            target = skins[0] if kind == "instance_controller" and skins else target
            names = (
                node.get("name", ""),
                node.get("id", ""),
                ids[target].get("name", "") if target in ids else "",
                target,
            )
            bound = {part.get("symbol", ""): _target(part, "target") for part in _parts(child, "instance_material")}
            yield _Instance(target, T, names, bound)


def _parts(element: Element | None, tag: str) -> Iterator[Element]:
    return (part for part in (() if element is None else element.iter()) if _tag(part) == tag)


def _target(element: Element, attribute: str = "url") -> str:
    return element.get(attribute, "").removeprefix("#")


def _matrix(values: FloatArray) -> FloatArray:
    return values.reshape(4, 4)


def _translation(values: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, 3] = values
    return T


def _rotation(values: FloatArray) -> FloatArray:
    """By degrees about an axis (Rodrigues); no axis is no rotation."""
    x, y, z, degrees = (float(value) for value in values)
    T, length = np.eye(4), math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / length
        T[:3, :3] += math.sin(math.radians(degrees)) * K + (1.0 - math.cos(math.radians(degrees))) * K @ K
    return T


def _scaling(values: FloatArray) -> FloatArray:
    x, y, z = values
    return np.diag([x, y, z, 1.0])


_TRANSFORMS = {"matrix": _matrix, "translate": _translation, "rotate": _rotation, "scale": _scaling}


def _surfaces(
    geometry: Any, instance: _Instance, document: Any, unit: float, path: Path, textures: TextureStore
) -> Iterator[Surface]:
    for primitive in geometry.primitives:
        if primitive.vertex_index is None or not (isinstance(primitive, Polylist) or hasattr(primitive, "ntriangles")):
            continue  # lines, or nothing
        vertices = np.asarray(primitive.vertex, dtype=np.float64)
        index = np.asarray(primitive.vertex_index, dtype=np.int64).ravel()
        corners = np.arange(len(index)).reshape(-1, 3) if not isinstance(primitive, Polylist) else _filled(primitive)
        normals = None
        if primitive.normal is not None:
            normals = np.asarray(primitive.normal, dtype=np.float64)[np.ravel(primitive.normal_index)][corners]
        uv = np.zeros((len(corners), 3, 2))
        if primitive.texcoordset:
            flat = np.asarray(primitive.texcoordset[0], dtype=np.float64)[np.ravel(primitive.texcoord_indexset[0])]
            uv = flat[corners]
        surface = Surface(
            vertices,
            index[corners],
            uv[..., :2],
            normals,
            _material(document.materials.get(instance.materials.get(primitive.material, "")), path, textures),
            "\n".join(dict.fromkeys(instance.names)),
        )
        yield surface.transformed(np.diag([unit, unit, unit, 1.0]) @ instance.T)


def _filled(polygons: Any) -> npt.NDArray[np.int64]:
    """(T, 3) corners of the triangles that fill a list of polygons."""
    counts = np.asarray(polygons.vcounts, dtype=np.int64)
    points = np.asarray(polygons.vertex, dtype=np.float64)[np.ravel(polygons.vertex_index)]
    if counts.min(initial=0) < 0 or counts.sum() > len(points):
        raise ValueError("its polygons have more corners than it lists")
    return polygon_corners(points[: counts.sum()], counts)


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
