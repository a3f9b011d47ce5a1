"""`World`: what stands around the robot. Visual triangles with materials, collision triangles, lights.

All coordinates are in the world frame, which is also the floor plan's frame `map` (protocol 2.1): metres, z up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from taskslam.errors import WorldError, did_you_mean

FloatColumns = npt.NDArray[np.float32]


@dataclass(frozen=True)
class TriangleMesh:
    """Triangles with a material each.

    vertices: (V, 3) float32 m; triangles: (T, 3) int32 vertex indices; material: (T,) int32 index into
    `World.materials`; uv: (T, 3, 2) float32 texture coordinates per corner (v up, as in OpenGL and COLLADA);
    normals: (T, 3, 3) float32 unit shading normals per corner; owner: (T,) int32 index into `World.models`.
    """

    vertices: FloatColumns
    triangles: npt.NDArray[np.int32]
    material: npt.NDArray[np.int32]
    uv: FloatColumns
    normals: FloatColumns
    owner: npt.NDArray[np.int32]

    def __len__(self) -> int:
        """Number of triangles."""
        return len(self.triangles)

    def only(self, kept: npt.NDArray[np.int64]) -> TriangleMesh:
        """Some of the triangles, by index, over the same vertices."""
        return replace(
            self, triangles=self.triangles[kept], material=self.material[kept], uv=self.uv[kept],
            normals=self.normals[kept], owner=self.owner[kept],
        )  # fmt: skip

    def corners(self) -> FloatColumns:
        """(T, 3, 3) float32 corner positions of every triangle."""
        return self.vertices[self.triangles]


@dataclass(frozen=True)
class Material:
    """Surface look. Colours are RGB(A) in 0..1.

    texture: (H, W, 3) or (H, W, 4) uint8 sRGB, row 0 at the top (v = 1).
    """

    name: str
    diffuse: tuple[float, float, float, float] = (0.8, 0.8, 0.8, 1.0)
    texture: npt.NDArray[np.uint8] | None = None
    texture_scale: tuple[float, float] = (1.0, 1.0)
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    specular: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Light:
    """A light: `directional`, `point` or `spot`.

    pose: (4, 4) T_world_light; it shines along `direction`, given in the light's frame.
    """

    name: str
    type: str
    pose: npt.NDArray[np.float64]
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    diffuse: tuple[float, float, float] = (1.0, 1.0, 1.0)
    attenuation_range: float = 10.0
    attenuation: tuple[float, float, float] = (1.0, 0.0, 0.0)  # constant, linear, quadratic


@dataclass(frozen=True)
class World:
    """A loaded world. `models` names what `TriangleMesh.owner` points at; `warnings` says what could not be loaded."""

    name: str
    visual: TriangleMesh
    collision: TriangleMesh
    materials: tuple[Material, ...]
    models: tuple[str, ...]
    lights: tuple[Light, ...] = ()
    ambient: tuple[float, float, float] = (0.4, 0.4, 0.4)
    background: tuple[float, float, float] = (0.7, 0.7, 0.7)
    warnings: tuple[str, ...] = field(default=())

    def without(self, names: Sequence[str]) -> World:
        """The same world without some models, by name; raises WorldError for one that it does not have."""
        for name in names:
            if name not in self.models:
                known = ", ".join(sorted(set(self.models))[:10])
                raise WorldError(
                    f"World {self.name} has no model '{name}' to exclude; it has {known}."
                    f"{did_you_mean(name, self.models)}"
                )
        if not names:
            return self
        gone = [index for index, name in enumerate(self.models) if name in names]
        return replace(self, visual=_without(self.visual, gone), collision=_without(self.collision, gone))

    def lowered(self, height: float) -> World:
        """The same world `height` metres lower: a floor that stood at that height comes to lie at z = 0."""
        if height == 0.0:
            return self
        down = np.array([0.0, 0.0, -height])
        lights = tuple(replace(light, pose=_moved(light.pose, down)) for light in self.lights)
        visual = replace(self.visual, vertices=(self.visual.vertices + down).astype(np.float32))
        collision = replace(self.collision, vertices=(self.collision.vertices + down).astype(np.float32))
        return replace(self, visual=visual, collision=collision, lights=lights)

    def bounds(self) -> npt.NDArray[np.float64]:
        """(2, 3) lowest and highest corner over visual and collision vertices, metres."""
        points = np.concatenate([self.visual.vertices, self.collision.vertices])
        return np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)


def _without(mesh: TriangleMesh, owners: list[int]) -> TriangleMesh:
    return mesh.only(np.flatnonzero(~np.isin(mesh.owner, owners)))


def _moved(pose: npt.NDArray[np.float64], by: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    moved = pose.copy()
    moved[:3, 3] += by
    return moved
