"""Expanding includes: from SDF elements to a tree of models whose parts know the file that they came from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskslam.errors import WholeWorldError, WorldError, WorldTooLargeError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.world.gazebo.document import named, parse_sdf, read_pose, text_of, vector
from taskslam.world.gazebo.frames import Scope
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.resources import Resources, fuel_name
from taskslam.world.gazebo.stock_models import STOCK_MODELS

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_NOT_SUPPORTED = ("actor", "population", "road")
_READ = ("frame", "gui", "joint", "light", "link", "plugin", "state")
_SOLID = ("collision", "include", "link", "model", "visual")
_DEEPEST_NESTING = 32
_MOST_PARTS = 20_000  # files that include others twice over grow without bound


@dataclass(frozen=True)
class Link:
    """A `<link>`: its element, the folder that its relative URIs mean, and where errors say that it stands."""

    name: str
    element: Element
    folder: Path
    where: str


@dataclass
class Model:
    """A model with everything included resolved. pose: T_parent_model, relative to the frame `relative_to`."""

    name: str
    pose: FloatArray
    relative_to: str
    placement: str
    scope: Scope
    links: list[Link] = field(default_factory=list)
    models: list[Model] = field(default_factory=list)


@dataclass(frozen=True)
class IncludedLight:
    """A `<light>` that an `<include>` brought; pose: T_scope_light, relative to the frame `relative_to`."""

    element: Element
    pose: FloatArray
    relative_to: str


@dataclass
class Expander:
    """Builds models from elements.

    Models that no resource path has, and those that cannot be read, are noted and left out; lights that have files of
    their own are put in `lights`.
    """

    resources: Resources
    left_out: LeftOut
    lights: list[IncludedLight] = field(default_factory=list)
    _documents: dict[Path, Element] = field(default_factory=dict)
    _count: int = 0

    def models_in(self, parent: Iterable[Element], file: Path, scope: Scope, chain: Sequence[str]) -> list[Model]:
        """Models defined in or included by an element, in document order; their frames are added to the scope.

        An `<include merge="true">` brings the models of a whole world (SDF 1.10), or a model as any other include.
        """
        models: list[Model] = []
        for child in parent:
            try:
                if child.tag == "model":
                    found = [self._model(child, file, chain)]
                elif child.tag == "include":
                    found = self._include(child, file, scope, chain)
                else:
                    self._pass_over(child)
                    continue
            except WholeWorldError:
                raise
            except WorldError as error:
                self.left_out.part("model", error)
                continue
            for model in found:
                scope.add_model(model.name, model.scope, model.pose, model.relative_to, model.placement)
            models += found
        return models

    def _pass_over(self, element: Element) -> None:
        """Note an element that is not read although it holds something to see or to bump into."""
        unread = element.tag not in _READ and any(part.tag in _SOLID for part in element.iter())
        if unread or element.tag in _NOT_SUPPORTED:
            self.left_out.unsupported(f"<{element.tag.rpartition('}')[2]}>")

    def _included_element(
        self, include: Element, file: Path, where: str, chain: Sequence[str]
    ) -> tuple[Element, Path, tuple[str, ...]] | None:
        """What an `<include>` brings (model, light, actor or world), its file and the files to it; None if missing.

        Raises WorldError for files that include themselves.
        """
        self._one_more(chain)
        uri = text_of(include, "uri")
        if not uri:
            raise WorldError(f"An <include> in {where} has no <uri>.")
        path = self.resources.find(uri, file.parent, where)
        if path is not None and path.is_dir():
            path = self.resources.model_sdf(path)
        if path is None:
            on_the_web = uri.startswith(("http://", "https://"))
            name = fuel_name(uri).name if on_the_web else uri.rstrip("/").rsplit("/", 1)[-1]
            stock = name.lower().replace(" ", "_")
            if stock in STOCK_MODELS:
                place = Path(f"stock model {stock}")
                return parse_sdf(STOCK_MODELS[stock].encode(), place, self.left_out)[0], file, (*chain, str(place))
            self.left_out.missing("model", name)
            if on_the_web:
                self.left_out.note(f"To get {name}: gz fuel download -u '{uri}'")
            return None
        if str(path) in chain:
            raise WorldError(
                f"{path} includes itself: {' -> '.join(Path(p).parent.name for p in [*chain, str(path)])}."
            )
        if len(chain) > _DEEPEST_NESTING:
            raise WorldTooLargeError(f"{path} is included more than {_DEEPEST_NESTING} files deep.")
        if path not in self._documents:
            self._documents[path] = parse_sdf(self.resources.read(path), path, self.left_out, self.resources.expand)
        for element in self._documents[path]:
            if element.tag in ("model", "light", "actor") or (element.tag == "world" and is_merge(include)):
                return element, path, (*chain, str(path))
        raise WorldError(f"{path} holds no <model>, so that it cannot be included.")

    def _one_more(self, chain: Sequence[str]) -> None:
        """Count a model, an include or a part of a model. Raises WorldError where they become too many."""
        self._count += 1
        if self._count > _MOST_PARTS:
            raise WorldTooLargeError(
                f"{chain[0]} comes to more than {_MOST_PARTS} models and parts with all that it includes."
            )

    def _include(self, include: Element, file: Path, scope: Scope, chain: Sequence[str]) -> list[Model]:
        where = scope.where
        found = self._included_element(include, file, where, chain)
        if found is None:
            return []
        element, path, inner_chain = found
        if element.tag == "light":
            source = include if include.find("pose") is not None else element
            self.lights.append(IncludedLight(element, *read_pose(source, f"<include> in {where}")))
            return []
        if element.tag == "actor":
            self.left_out.unsupported("<actor>")
            return []
        if element.tag == "world":
            return self._merged_world(include, element, path, scope, inner_chain)
        model = self._model(element, path, inner_chain)
        model.name = text_of(include, "name", model.name)
        model.placement = text_of(include, "placement_frame", model.placement)
        if include.find("pose") is not None:
            model.pose, model.relative_to = read_pose(include, f"<include> of '{model.name}' in {where}")
        elif element.find("pose") is not None:
            model.relative_to = ""
        return [model]

    def _merged_world(
        self, include: Element, world: Element, file: Path, scope: Scope, chain: Sequence[str]
    ) -> list[Model]:
        """The models of a world that is merged into another, its frames and lights with them; a pose moves them all."""
        T, relative_to = read_pose(include, f"<include> in {scope.where}")
        T = scope.resolve(relative_to) @ T
        inner = scope_of_world(world, str(file))
        models = self.models_in(world, file, inner, chain)
        for model in models:
            model.pose, model.relative_to = T @ inner.resolve(model.relative_to) @ model.pose, ""
        for light in world.findall("light"):
            pose, frame = read_pose(light, f"<light> in {file}")
            self.lights.append(IncludedLight(light, T @ inner.resolve(frame) @ pose, ""))
        for name, _ in named(world, "frame"):
            scope.add(name, T @ inner.resolve(name))
        return models

    def _model(self, element: Element, file: Path, chain: Sequence[str]) -> Model:
        self._one_more(chain)
        name = (element.get("name") or "").strip()
        where = f"model '{name}' in {file}"
        pose, relative_to = read_pose(element, where)
        model = Model(name, pose, relative_to, (element.get("placement_frame") or "").strip(), Scope(where))
        self._fill(model, element, file, chain, base="")
        return model

    def _fill(self, model: Model, element: Element, file: Path, chain: Sequence[str], base: str) -> None:
        """Add an element's parts to a model; poses that name no frame are relative to `base`."""
        scope, where = model.scope, f"model '{model.name}' in {file}"
        for name, link in named(element, "link"):
            pose, relative_to = read_pose(link, f"link '{name}' of {where}")
            self._one_more(chain)
            scope.add(name, pose, relative_to or base)
            model.links.append(Link(name, link, file.parent, f"link '{name}' of {where}"))
        for name, frame in named(element, "frame"):
            self._one_more(chain)
            pose, relative_to = read_pose(frame, f"frame '{name}' of {where}")
            scope.add(name, pose, relative_to or (frame.get("attached_to") or "").strip() or base)
        for name, joint in named(element, "joint"):
            self._one_more(chain)
            pose, relative_to = read_pose(joint, f"joint '{name}' of {where}")
            scope.add(name, pose, relative_to or text_of(joint, "child") or base)
        own = [child for child in element if not (child.tag == "include" and is_merge(child))]
        model.models += self.models_in(own, file, scope, chain)
        for include in element.findall("include"):
            if is_merge(include):
                self._merge(model, include, file, chain, base)

    def _merge(self, model: Model, include: Element, file: Path, chain: Sequence[str], base: str) -> None:
        """`<include merge="true">`: the included model's parts become parts of this one."""
        found = self._included_element(include, file, f"model '{model.name}' in {file}", chain)
        if found is None:
            return
        element, path, inner_chain = found
        if element.tag != "model":
            self.left_out.unsupported(f"<{element.tag}> merged into a model")
            return
        source = include if include.find("pose") is not None else element
        pose, relative_to = read_pose(source, f"<include> in model '{model.name}'")
        placement = text_of(include, "placement_frame", (element.get("placement_frame") or "").strip())
        if placement:
            pose = pose @ invert_se3(self._model(element, path, inner_chain).scope.resolve(placement))
        proxy = f"__merged_{len(model.scope.where)}_{len(model.links)}_{element.get('name')}"
        model.scope.add(proxy, pose, relative_to or base)
        self._fill(model, element, path, inner_chain, base=proxy)


def is_merge(include: Element) -> bool:
    """Whether an `<include>` asks for its content to become part of what includes it."""
    return include.get("merge", "") in ("1", "true")


def scope_of_world(element: Element, where: str) -> Scope:
    """Scope of a `<world>` with its own `<frame>`s; models are added as they are expanded."""
    scope = Scope(where)
    for name, frame in named(element, "frame"):
        pose, relative_to = read_pose(frame, f"frame '{name}' of {where}")
        scope.add(name, pose, relative_to or (frame.get("attached_to") or "").strip())
    return scope


def state_poses(world: Element, where: str) -> dict[str, FloatArray]:
    """(4, 4) world poses in `<state>`, by `model` and `model::link`; they stand above the poses of the definitions.

    Gazebo writes every pose of a state in the world frame, also those of links and of nested models.
    """
    poses: dict[str, FloatArray] = {}

    def collect(parent: Element, prefix: str) -> None:
        for tag in ("model", "link", "light"):
            for name, child in named(parent, tag):
                path = f"{prefix}{name}"
                if child.find("pose") is not None:
                    poses[path] = read_pose(child, f"<state> of '{path}' in {where}")[0]
                if tag == "model":
                    collect(child, f"{path}::")

    for state in world.findall("state"):
        collect(state, "")
    return poses


def state_scales(world: Element, where: str) -> dict[str, FloatArray]:
    """(3,) scales of models in `<state>`, by name; only those that are not 1 1 1."""
    scales = {}
    for state in world.findall("state"):
        for name, model in named(state, "model"):
            scale = vector(model, "scale", (1.0, 1.0, 1.0), f"<state> of '{name}' in {where}")
            if scale != [1.0, 1.0, 1.0]:
                scales[name] = np.array(scale)
    return scales
