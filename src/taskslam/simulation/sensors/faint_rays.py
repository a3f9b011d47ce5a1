"""Rays of a LiDAR as it sees real surfaces: dark ones from nearby only, glass almost never.

What returns of a pulse from a matt surface goes as reflectance times the cosine of the angle of incidence, over the
square of the distance. A maker says how far the LiDAR sees a surface that reflects a tenth; so much is needed. Of a
pane, a narrow cone about its normal is mirrored back and all else goes through: what stands behind is measured.
Reflectance is the linear red of a surface's look, which lies nearest to infrared: black plastic may well be bright at
905 nm, and no world says so. Mirrored rays that hit something else are left out.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from taskslam.robot.imperfections import LidarImperfections
from taskslam.simulation.rendering.shading import LINEAR_OF_BYTE, linear_of_srgb
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import Material, TriangleMesh, World

_GLASS = re.compile(r"glass|window", re.IGNORECASE)
_TENTH = 0.1
Rays = npt.NDArray[np.float32]


class FaintRays:
    """A mesh of a world as a LiDAR with these imperfections meets it."""

    def __init__(self, world: World, mesh: TriangleMesh, rays: RayCaster, wrong: LidarImperfections) -> None:
        self._world, self._mesh, self._rays, self._wrong = world, mesh, rays, wrong
        glass = is_glass(world, mesh) if wrong.glass_angle is not None else np.zeros(len(mesh), bool)
        self._glass = glass
        self._solid = np.flatnonzero(~glass)
        self._behind = RayCaster(mesh.only(self._solid)) if glass.any() else None

    def distances(self, origins: Rays, directions: Rays) -> Rays:
        """(N,) distances that are measured along unit directions, +inf for no return; as `RayCaster.distances`."""
        triangle, distance, uv = self._rays.hits(origins, directions)
        cosine = self._cosine(triangle, directions)
        if self._behind is not None and self._wrong.glass_angle is not None:
            through = (triangle >= 0) & self._glass[triangle] & (cosine < np.cos(self._wrong.glass_angle))
            rays = np.flatnonzero(through)
            found, distance[rays], uv[rays] = self._behind.hits(origins[rays], directions[rays])
            triangle[rays] = np.where(found >= 0, self._solid[found], -1)
            cosine[rays] = self._cosine(triangle[rays], directions[rays])
        if self._wrong.reach_dark is not None:
            seen = reflectance(self._world, self._mesh, triangle, uv) * cosine / _TENTH
            mirrored = (triangle >= 0) & self._glass[triangle]
            faint = ~mirrored & (distance > self._wrong.reach_dark * np.sqrt(seen))
            distance[faint] = np.inf
        return distance

    def _cosine(self, triangle: npt.NDArray[np.int32], directions: Rays) -> npt.NDArray[np.float64]:
        """(N,) of the angles between rays and the normals of what they hit."""
        a, b, c = np.moveaxis(self._mesh.vertices[self._mesh.triangles[triangle]].astype(np.float64), 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        cosine: npt.NDArray[np.float64] = np.abs(np.sum(normal * directions, axis=1)) / np.maximum(length, 1e-12)
        return cosine


def is_glass(world: World, mesh: TriangleMesh) -> npt.NDArray[np.bool_]:
    """(T,) whether a triangle is of glass: it lets light through, or its material or model is named so."""
    materials = [look.diffuse[3] < 1.0 or bool(_GLASS.search(look.name)) for look in world.materials]
    models = [bool(_GLASS.search(name)) for name in world.models]
    glassy = np.array(materials, bool)[mesh.material] if materials else np.zeros(len(mesh), bool)
    return glassy | np.array(models, bool)[mesh.owner] if models else glassy


def reflectance(world: World, mesh: TriangleMesh, triangle: npt.NDArray[np.int32], uv: Rays) -> npt.NDArray[np.float64]:
    """(N,) share of red light, 0..1, that N points of a mesh reflect. triangle: (N,) index; uv: (N, 2) barycentric."""
    red = np.zeros(len(triangle))
    material = mesh.material[triangle]
    for index in np.unique(material[triangle >= 0]):
        here = np.flatnonzero((material == index) & (triangle >= 0))
        weights = np.column_stack([1.0 - uv[here].sum(axis=1), uv[here]])
        at = np.einsum("nk,nkd->nd", weights, mesh.uv[triangle[here]].astype(np.float64))
        red[here] = _red(world.materials[index], at)
    return red


def _red(look: Material, at: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(N,) linear red of a material at texture coordinates (N, 2), v up; the nearest texel."""
    tint = float(linear_of_srgb(np.array(look.diffuse[0])))
    if look.texture is None:
        return np.full(len(at), tint)
    height, width = look.texture.shape[:2]
    scaled = np.nan_to_num(at * np.array(look.texture_scale)) % 1.0
    column = np.minimum((scaled[:, 0] * width).astype(int), width - 1)
    row = np.minimum(((1.0 - scaled[:, 1]) * height).astype(int), height - 1)
    red: npt.NDArray[np.float64] = tint * LINEAR_OF_BYTE[look.texture[row, column, 0]]
    return red
