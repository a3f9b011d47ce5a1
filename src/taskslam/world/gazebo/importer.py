"""`import_sdf`: a Gazebo world file as a `World`.

The steps: read the file, expand its includes into models, place models and links (the poses in `<state>` stand above
the definitions), turn every visual and collision into triangles, and say in one sentence what was missing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.world.gazebo.document import Rgba, colour, named, parse_sdf, read_pose
from taskslam.world.gazebo.frames import Scope
from taskslam.world.gazebo.geometry_element import GeometryReader
from taskslam.world.gazebo.lights import read_light
from taskslam.world.gazebo.materials import MaterialReader
from taskslam.world.gazebo.meshes import MeshLibrary
from taskslam.world.gazebo.models import Expander, Link, Model, scope_of_world, state_poses, state_scales
from taskslam.world.gazebo.resources import Resources
from taskslam.world.gazebo.surfaces import MaterialTable, MeshBuilder
from taskslam.world.gazebo.textures import TextureStore
from taskslam.world.world import Light, World

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_AMBIENT, _BACKGROUND = (0.4, 0.4, 0.4, 1.0), (0.7, 0.7, 0.7, 1.0)


def import_sdf(path: Path, resources: Resources) -> World:
    """The world in an SDF file (1.4 to 1.11), named after the file.

    A file with only a model gives a world of that model. Raises WorldError for files that cannot be read, are malformed
    or reach out of their folders; models, meshes and textures that are merely absent become a warning.
    """
    root = parse_sdf(resources.read(path), path)
    world = root.find("world")
    try:
        return _Importer(path, resources).run(root if world is None else world)
    except RecursionError as error:
        raise WorldError(f"{path} nests models too deeply to be read.") from error


@dataclass
class _Importer:
    path: Path
    resources: Resources
    models: list[str] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.textures = TextureStore(self.resources)
        self.expander = Expander(self.resources)
        self.materials = MaterialReader(self.resources, self.textures)
        self.geometry = GeometryReader(self.resources, MeshLibrary(self.resources, self.textures))
        table = MaterialTable()
        self.table = table
        self.visual, self.collision = MeshBuilder(table), MeshBuilder(table)

    def run(self, world: Element) -> World:
        """Import everything in a `<world>` element (or in `<sdf>` itself)."""
        where = str(self.path)
        scope = scope_of_world(world, where)
        chain = (str(self.path),)
        state = state_poses(world, where)
        scales = state_scales(world, where)
        models = self.expander.models_in(world, self.path, scope, chain)
        for inserted in world.findall("state/insertions"):
            models += self.expander.models_in(inserted, self.path, scope, chain)
        deleted = {(name.text or "").strip() for name in world.findall("state/deletions/name")}
        for model in models:
            if model.name not in deleted:
                self.models.append(model.name)
                T = self._place(model, scope, np.eye(4), state, "")
                self._add_model(model, T, state, model.name, scales.get(model.name))
        self._add_lights(world, scope, state, deleted)
        if not self.models:
            raise WorldError(f"{self.path} holds no model that could be found; there is nothing to load.{self._hint()}")
        return World(
            name=self.path.stem,
            visual=self.visual.build(),
            collision=self.collision.build(),
            materials=tuple(self.table.materials),
            models=tuple(self.models),
            lights=tuple(self.lights),
            ambient=self._scene_colour(world, "ambient", _AMBIENT),
            background=self._scene_colour(world, "background", _BACKGROUND),
            warnings=tuple(self._warnings()),
        )

    def _place(
        self, model: Model, scope: Scope, T_world_parent: FloatArray, state: dict[str, FloatArray], prefix: str
    ) -> FloatArray:
        path = f"{prefix}{model.name}"
        if path in state:
            return state[path]
        pose = T_world_parent @ scope.resolve(model.relative_to) @ model.pose
        return pose @ invert_se3(model.scope.resolve(model.placement)) if model.placement else pose

    def _add_model(
        self, model: Model, T: FloatArray, state: dict[str, FloatArray], path: str, scale: FloatArray | None
    ) -> None:
        for link in model.links:
            T_model_link = model.scope.resolve(link.name)
            T_world_link = state.get(f"{path}::{link.name}", T @ T_model_link)
            self._add_link(link, model.scope, T_world_link, invert_se3(T_model_link), scale)
        for child in model.models:
            child_path = f"{path}::{child.name}"
            self._add_model(child, self._place(child, model.scope, T, state, f"{path}::"), state, child_path, scale)

    def _add_link(
        self, link: Link, scope: Scope, T_world_link: FloatArray, T_link_model: FloatArray, scale: FloatArray | None
    ) -> None:
        owner = len(self.models) - 1
        shrink = np.eye(4) if scale is None else np.diag([*scale, 1.0])
        for tag in ("visual", "collision"):
            for name, element in named(link.element, tag):
                where = f"{tag} '{name}' of {link.where}"
                shape = element.find("geometry")
                if shape is None:
                    raise WorldError(f"{where} has no <geometry>.")
                T = T_world_link @ self._local_pose(element, scope, T_link_model, where) @ shrink
                look = self.materials.read(element, link.folder, where) if tag == "visual" else None
                builder = self.visual if tag == "visual" else self.collision
                for surface in self.geometry.read(shape, link.folder, where):
                    placed = surface.transformed(T)
                    builder.add(look.on(placed) if look is not None else placed, owner)
        for _, element in named(link.element, "light"):
            self._add_light(
                element, T_world_link @ self._local_pose(element, scope, T_link_model, link.where), link.where
            )

    def _local_pose(self, element: Element, scope: Scope, T_link_model: FloatArray, where: str) -> FloatArray:
        """T_link_element: its pose is relative to the link unless it names another frame of the model."""
        pose, relative_to = read_pose(element, where)
        return T_link_model @ scope.resolve(relative_to) @ pose if relative_to else pose

    def _add_lights(self, world: Element, scope: Scope, state: dict[str, FloatArray], deleted: set[str]) -> None:
        where = str(self.path)
        own = [(element, *read_pose(element, f"<light> in {where}")) for element in world.findall("light")]
        included = [(light.element, light.pose, light.relative_to) for light in self.expander.lights]
        for element, pose, relative_to in own + included:
            name = (element.get("name") or "").strip()
            if name not in deleted:
                self._add_light(element, state.get(name, scope.resolve(relative_to) @ pose), where)

    def _add_light(self, element: Element, T_world_light: FloatArray, where: str) -> None:
        light = read_light(element, T_world_light, where)
        if light is not None:
            self.lights.append(light)

    def _scene_colour(self, world: Element, tag: str, default: Rgba) -> tuple[float, float, float]:
        scene = world.find("scene")
        r, g, b = (default if scene is None else colour(scene, tag, default, f"<scene> of {self.path}"))[:3]
        return r, g, b

    def _hint(self) -> str:
        missing = self._missing()
        return f" {missing}" if missing else ""

    def _missing(self) -> str:
        """One sentence that counts and names everything that was not found; empty if nothing is missing."""
        parts = [
            _counted("model", self.expander.missing, "instances"),
            _counted("mesh", self.geometry.missing_meshes, "uses", plural="meshes"),
            _counted("texture", dict.fromkeys(self.textures.missing, 1), "uses"),
            _counted("material", self.materials.missing, "uses"),
        ]
        return f"Missing and left out: {'; '.join(part for part in parts if part)}." if any(parts) else ""

    def _warnings(self) -> list[str]:
        unsupported = {**self.expander.unsupported, **self.geometry.unsupported}
        damaged = _counted("texture", dict.fromkeys(self.textures.damaged, 1), "uses")
        strange = _counted("kind of element", unsupported, "uses", plural="kinds of element")
        sentences = [
            self._missing(),
            f"Damaged and left out: {damaged}." if damaged else "",
            f"Not supported and left out: {strange}." if strange else "",
        ]
        return [sentence for sentence in sentences if sentence]


def _counted(noun: str, names: dict[str, int], each: str, plural: str = "") -> str:
    """`2 models (5 instances): a, b`, or an empty string."""
    if not names:
        return ""
    total = sum(names.values())
    repeated = f" ({total} {each})" if total > len(names) else ""
    return f"{len(names)} {noun if len(names) == 1 else plural or noun + 's'}{repeated}: {', '.join(sorted(names))}"
