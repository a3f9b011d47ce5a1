"""Expanding includes: from SDF elements to a tree of models whose parts know the file that they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray
from taskslam.world.gazebo.document import named, parse_sdf, read_pose, text_of, vector
from taskslam.world.gazebo.frames import Scope
from taskslam.world.gazebo.resources import Resources
from taskslam.world.gazebo.stock_models import STOCK_MODELS

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_NOT_SUPPORTED = ("actor", "population", "road")
_DEEPEST_NESTING = 32
_MOST_PARTS = 40_000  # files that include others twice over grow without bound


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

    Models that no resource path has are counted in `missing` and left out; lights that have files of their own are put
    in `lights`.
    """

    resources: Resources
    missing: dict[str, int] = field(default_factory=dict)
    unsupported: dict[str, int] = field(default_factory=dict)
    lights: list[IncludedLight] = field(default_factory=list)
    _documents: dict[Path, Element] = field(default_factory=dict)
    _count: int = 0

    def models_in(self, parent: Element, file: Path, scope: Scope, chain: Sequence[str]) -> list[Model]:
        """Models defined in or included by an element, in document order; their frames are added to the scope."""
        models = []
        for child in parent:
            if child.tag == "model":
                model = self._model(child, file, chain)
            elif child.tag == "include" and child.get("merge", "") not in ("1", "true"):
                included = self._include(child, file, scope.where, chain)
                if included is None:
                    continue
                model = included
            else:
                if child.tag in _NOT_SUPPORTED:
                    self._leave_out(f"<{child.tag}>")
                continue
            scope.add_model(model.name, model.scope, model.pose, model.relative_to, model.placement)
            models.append(model)
        return models

    def _included_element(
        self, include: Element, file: Path, where: str, chain: Sequence[str]
    ) -> tuple[Element, Path, tuple[str, ...]] | None:
        """What an `<include>` brings (model, light or actor), its file and the chain of files to it; None if missing.

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
            name = uri.rstrip("/").rsplit("/", 1)[-1]
            if name in STOCK_MODELS:
                stock = Path(f"stock model {name}")
                return parse_sdf(STOCK_MODELS[name].encode(), stock)[0], file, (*chain, str(stock))
            self.missing[name] = self.missing.get(name, 0) + 1
            return None
        if str(path) in chain:
            raise WorldError(
                f"{path} includes itself: {' -> '.join(Path(p).parent.name for p in [*chain, str(path)])}."
            )
        if len(chain) > _DEEPEST_NESTING:
            raise WorldError(f"{path} is included more than {_DEEPEST_NESTING} files deep.")
        if path not in self._documents:
            self._documents[path] = parse_sdf(self.resources.read(path), path)
        for element in self._documents[path]:
            if element.tag in ("model", "light", "actor"):
                return element, path, (*chain, str(path))
        raise WorldError(f"{path} holds no <model>, so that it cannot be included.")

    def _one_more(self, chain: Sequence[str]) -> None:
        """Count a model, an include or a part of a model. Raises WorldError where they become too many."""
        self._count += 1
        if self._count > _MOST_PARTS:
            raise WorldError(f"{chain[0]} comes to more than {_MOST_PARTS} models and parts with all that it includes.")

    def _leave_out(self, what: str) -> None:
        self.unsupported[what] = self.unsupported.get(what, 0) + 1

    def _include(self, include: Element, file: Path, where: str, chain: Sequence[str]) -> Model | None:
        found = self._included_element(include, file, where, chain)
        if found is None:
            return None
        element, path, inner_chain = found
        if element.tag == "light":
            source = include if include.find("pose") is not None else element
            self.lights.append(IncludedLight(element, *read_pose(source, f"<include> in {where}")))
            return None
        if element.tag == "actor":
            self._leave_out("<actor>")
            return None
        model = self._model(element, path, inner_chain)
        model.name = text_of(include, "name", model.name)
        model.placement = text_of(include, "placement_frame", model.placement)
        if include.find("pose") is not None:
            model.pose, model.relative_to = read_pose(include, f"<include> of '{model.name}' in {where}")
        elif element.find("pose") is not None:
            model.relative_to = ""
        return model

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
        nested = self.models_in(element, file, scope, chain)
        for child in nested:
            model.models.append(child)
        for include in element.findall("include"):
            if include.get("merge", "") in ("1", "true"):
                self._merge(model, include, file, chain, base)

    def _merge(self, model: Model, include: Element, file: Path, chain: Sequence[str], base: str) -> None:
        """`<include merge="true">`: the included model's parts become parts of this one."""
        found = self._included_element(include, file, f"model '{model.name}' in {file}", chain)
        if found is None or found[0].tag != "model":
            return
        element, path, inner_chain = found
        source = include if include.find("pose") is not None else element
        pose, relative_to = read_pose(source, f"<include> in model '{model.name}'")
        proxy = f"__merged_{len(model.scope.where)}_{len(model.links)}_{element.get('name')}"
        model.scope.add(proxy, pose, relative_to or base)
        self._fill(model, element, path, inner_chain, base=proxy)


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
