"""The `<geometry>` element: which surfaces it stands for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskslam.errors import WorldError
from taskslam.world.gazebo import primitives
from taskslam.world.gazebo.document import is_true, numbers, text_of, vector
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.meshes import MeshLibrary
from taskslam.world.gazebo.resources import Resources
from taskslam.world.gazebo.surfaces import Surface, check_surface
from taskslam.world.gazebo.textures import grey_image

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_IGNORED = ("empty",)


@dataclass
class GeometryReader:
    """Turns `<geometry>` into surfaces, and notes meshes that are missing and shapes that are not supported."""

    resources: Resources
    meshes: MeshLibrary
    left_out: LeftOut

    def read(self, geometry: Element, folder: Path, where: str) -> list[Surface]:
        """Checked surfaces in the frame of the visual or collision.

        Raises WorldError for sizes that make no sense, and for a shape that has no area or is not there at all.
        """
        if not len(geometry):
            raise WorldError(f"The <geometry> of {where} holds no shape.")
        surfaces: list[Surface] = []
        contours = geometry.findall("polyline")
        if contours:
            surfaces += self._polylines(contours, where)
        for shape in geometry:
            if shape.tag == "mesh":
                surfaces += self._mesh(shape, folder, where)
            elif shape.tag == "heightmap":
                surfaces += self._heightmap(shape, folder, where)
            elif shape.tag in _PRIMITIVES:
                surfaces += _PRIMITIVES[shape.tag](shape, f"<{shape.tag}> in {where}")
            elif shape.tag not in ("polyline", *_IGNORED):
                self.left_out.unsupported(f"<{shape.tag}>")
        checked = [check_surface(surface, where) for surface in surfaces]
        if surfaces and not any(len(surface.triangles) for surface in checked):
            raise WorldError(f"The <geometry> of {where} has no area.")
        return checked

    def _mesh(self, mesh: Element, folder: Path, where: str) -> list[Surface]:
        uri = text_of(mesh, "uri") or text_of(mesh, "filename")
        if not uri:
            raise WorldError(f"A <mesh> in {where} has no <uri>.")
        path = self.resources.find(uri, folder, where)
        if path is None or path.is_dir():
            self.left_out.missing("mesh", uri)
            return []
        submesh = mesh.find("submesh")
        if submesh is None:
            surfaces = self.meshes.load(path)
        else:
            surfaces = self.meshes.submesh(path, text_of(submesh, "name"), is_true(submesh, "center"))
        if not any(len(surface.triangles) for surface in surfaces):
            raise WorldError(f"Mesh {path} holds no triangle that has an area.")
        scale = vector(mesh, "scale", (1.0, 1.0, 1.0), where)
        if scale == [1.0, 1.0, 1.0]:
            return surfaces
        T = np.diag([*scale, 1.0])
        return [surface.transformed(T) for surface in surfaces]

    def _heightmap(self, shape: Element, folder: Path, where: str) -> list[Surface]:
        """Terrain from a grey image; a digital elevation model, which is none, cannot be read."""
        uri = text_of(shape, "uri")
        path = self.resources.find(uri, folder, where) if uri else None
        if path is None or path.is_dir():
            self.left_out.missing("heightmap", uri)
            return []
        heights = grey_image(self.resources.read(path), f"Heightmap {path}")
        size = vector(shape, "size", (1.0, 1.0, 1.0), where)
        return [primitives.terrain(heights, size, np.array(vector(shape, "pos", (0.0, 0.0, 0.0), where)))]

    def _polylines(self, contours: list[Element], where: str) -> list[Surface]:
        height = _positive(contours[0], "height", where)
        rings = []
        for contour in contours:
            points = [numbers(p.text, 2, f"<point> in {where}") for p in contour.findall("point")]
            rings.append(np.array(points).reshape(-1, 2))
        return primitives.extruded_polylines(rings, height)


def _positive(shape: Element, tag: str, where: str, default: float = -1.0) -> float:
    """A child that is above 0; where it is absent, what SDF says of it (none for the height of a polyline)."""
    value = vector(shape, tag, (default,), where)[0]
    if value <= 0.0:
        raise WorldError(f"{where} needs a <{tag}> above 0; it has {text_of(shape, tag, 'none')}.")
    return value


def _not_negative(values: list[float], tag: str, where: str) -> list[float]:
    if min(values) < 0.0:
        raise WorldError(f"{where} needs a <{tag}> of 0 or more; it has {' '.join(f'{v:g}' for v in values)}.")
    return values


def _box(shape: Element, where: str) -> list[Surface]:
    x, y, z = _not_negative(vector(shape, "size", (1.0, 1.0, 1.0), where), "size", where)
    return primitives.box(x, y, z)


def _sphere(shape: Element, where: str) -> list[Surface]:
    radius = _positive(shape, "radius", where, 1.0)
    return primitives.ellipsoid(radius, radius, radius)


def _ellipsoid(shape: Element, where: str) -> list[Surface]:
    rx, ry, rz = vector(shape, "radii", (1.0, 1.0, 1.0), where)
    if min(rx, ry, rz) <= 0.0:
        raise WorldError(f"{where} needs <radii> above 0; it has {text_of(shape, 'radii')}.")
    return primitives.ellipsoid(rx, ry, rz)


def _cylinder(shape: Element, where: str) -> list[Surface]:
    return primitives.cylinder(_positive(shape, "radius", where, 1.0), _positive(shape, "length", where, 1.0))


def _cone(shape: Element, where: str) -> list[Surface]:
    return primitives.cylinder(_positive(shape, "radius", where, 1.0), _positive(shape, "length", where, 1.0), 0.0)


def _capsule(shape: Element, where: str) -> list[Surface]:
    return primitives.capsule(_positive(shape, "radius", where, 0.5), _positive(shape, "length", where, 1.0))


def _plane(shape: Element, where: str) -> list[Surface]:
    width, height = _not_negative(vector(shape, "size", (100.0, 100.0), where), "size", where)
    return primitives.plane(np.array(vector(shape, "normal", (0.0, 0.0, 1.0), where)), width, height)


_PRIMITIVES = {
    "box": _box,
    "sphere": _sphere,
    "ellipsoid": _ellipsoid,
    "cylinder": _cylinder,
    "cone": _cone,
    "capsule": _capsule,
    "plane": _plane,
}
