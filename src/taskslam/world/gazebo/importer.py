"""`import_sdf`: a Gazebo world file as a `World`.

The steps: read the file, expand its includes into models, place models and links (the poses in `<state>` stand above
the definitions), turn every visual and collision into triangles, and say in one sentence what was missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskslam.errors import WholeWorldError, WorldError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.world.gazebo.document import Rgba, colour, named, parse_sdf, read_pose
from taskslam.world.gazebo.frames import Scope
from taskslam.world.gazebo.geometry_element import GeometryReader
from taskslam.world.gazebo.left_out import LeftOut
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

_OF_LINKS = ("collision", "light", "visual")
_AMBIENT, _BACKGROUND = (0.4, 0.4, 0.4, 1.0), (0.7, 0.7, 0.7, 1.0)


def import_sdf(path: Path, resources: Resources) -> World:
    """The world in an SDF file (1.3 to 1.12), named after the file.

    A file with only a model gives a world of that model. What is missing, damaged or not supported becomes a warning.
    Raises WorldError for a file that cannot be read, and where more parts cannot be used than can, or nothing is left.
    """
    left_out = LeftOut()
    root = parse_sdf(resources.read(path), path, left_out, resources.expand)
    worlds = root.findall("world")
    for _ in worlds[1:]:
        left_out.unsupported("<world> after the first")
    try:
        return _Importer(path, resources, left_out).run(worlds[0] if worlds else root)
    except RecursionError as error:
        raise WorldError(f"{path} nests models too deeply to be read.") from error


@dataclass
class _Importer:
    path: Path
    resources: Resources
    left_out: LeftOut
    models: list[str] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)

    def __post_init__(self) -> None:
        textures = TextureStore(self.resources, self.left_out)
        self.expander = Expander(self.resources, self.left_out)
        self.materials = MaterialReader(self.resources, textures, self.left_out)
        library = MeshLibrary(self.resources, textures, self.left_out)
        self.geometry = GeometryReader(self.resources, library, self.left_out)
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
                with self._one_part("model"):
                    T = self._place(model, scope, np.eye(4), state, "")
                    self._add_model(model, T, state, model.name, scales.get(model.name))
        self._add_lights(world, scope, state, deleted)
        self.left_out.refuse_above_share()
        visual, collision = self.visual.build(), self.collision.build()
        if not len(visual) and not len(collision):
            why = self.left_out.sentences() or ["It declares nothing to see or to bump into."]
            what = "no model that could be found" if not self.models else "nothing that could be loaded"
            raise WorldError(f"{self.path} holds {what}; there is nothing to load. {' '.join(why)}")
        return World(
            name=self.path.stem,
            visual=visual,
            collision=collision,
            materials=tuple(self.table.materials),
            models=tuple(self.models),
            lights=tuple(self.lights),
            ambient=self._scene_colour(world, "ambient", _AMBIENT),
            background=self._scene_colour(world, "background", _BACKGROUND),
            warnings=tuple(self.left_out.sentences()),
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
            with self._one_part("link"):
                T_model_link = model.scope.resolve(link.name)
                T_world_link = state.get(f"{path}::{link.name}", T @ T_model_link)
                self._add_link(link, model.scope, T_world_link, invert_se3(T_model_link), scale)
        for child in model.models:
            with self._one_part("model"):
                child_path = f"{path}::{child.name}"
                place = self._place(child, model.scope, T, state, f"{path}::")
                self._add_model(child, place, state, child_path, scale)

    def _add_link(
        self, link: Link, scope: Scope, T_world_link: FloatArray, T_link_model: FloatArray, scale: FloatArray | None
    ) -> None:
        shrink = np.eye(4) if scale is None else np.diag([*scale, 1.0])
        for tag in ("visual", "collision"):
            for name, element in named(link.element, tag):
                where = f"{tag} '{name}' of {link.where}"
                with self._one_part(tag):
                    T = T_world_link @ self._local_pose(element, scope, T_link_model, where) @ shrink
                    self._add_part(element, tag, T, link.folder, where)
        for element in link.element:
            if element.tag not in _OF_LINKS and any(part.tag == "geometry" for part in element.iter()):
                self.left_out.unsupported(f"<{element.tag.rpartition('}')[2]}> of a link")
        for _, element in named(link.element, "light"):
            with self._one_part("light"):
                pose = self._local_pose(element, scope, T_link_model, link.where)
                self._add_light(element, T_world_link @ pose, link.where)

    def _add_part(self, element: Element, tag: str, T: FloatArray, folder: Path, where: str) -> None:
        """A visual or a collision, at its place in the world."""
        shape = element.find("geometry")
        if shape is None:
            raise WorldError(f"{where} has no <geometry>.")
        look = self.materials.read(element, folder, where) if tag == "visual" else None
        builder = self.visual if tag == "visual" else self.collision
        for surface in self.geometry.read(shape, folder, where):
            placed = surface.transformed(T)
            builder.add(look.on(placed) if look is not None else placed, len(self.models) - 1)
        self.left_out.used += 1

    @contextmanager
    def _one_part(self, noun: str) -> Iterator[None]:
        """What is wrong inside costs no more than this part, which is noted."""
        try:
            yield
        except WholeWorldError:
            raise
        except WorldError as error:
            self.left_out.part(noun, error)

    def _local_pose(self, element: Element, scope: Scope, T_link_model: FloatArray, where: str) -> FloatArray:
        """T_link_element: its pose is relative to the link unless it names another frame of the model."""
        pose, relative_to = read_pose(element, where)
        return T_link_model @ scope.resolve(relative_to) @ pose if relative_to else pose

    def _add_lights(self, world: Element, scope: Scope, state: dict[str, FloatArray], deleted: set[str]) -> None:
        where = str(self.path)
        own = [(element, None) for element in world.findall("light")]
        included = [(light.element, light) for light in self.expander.lights]
        for element, light in own + included:
            name = (element.get("name") or "").strip()
            with self._one_part("light"):
                pose, relative_to = (light.pose, light.relative_to) if light else read_pose(element, f"light '{name}'")
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
