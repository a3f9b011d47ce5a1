"""Named frames of SDF: what `relative_to`, `<frame attached_to>` and `placement_frame` mean.

Source: the SDFormat specification's "Pose frame semantics". Every world and model is a scope of names; names in a
nested model are reached by `child::name`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray, invert_se3


@dataclass(frozen=True)
class _Frame:
    pose: FloatArray
    relative_to: str
    placement: tuple[Scope, str] | None = None


class Scope:
    """The names that one `<world>` or `<model>` defines, each with a pose in terms of another.

    where: how errors call this scope, for example `model 'table' in house.world`.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self._frames: dict[str, _Frame] = {}
        self._children: dict[str, Scope] = {}
        self._resolved: dict[str, FloatArray] = {}

    def add(self, name: str, pose: FloatArray, relative_to: str = "") -> None:
        """Define a frame by its pose relative to another one of this scope (`""`: the scope's own root)."""
        self._frames.setdefault(name, _Frame(pose, relative_to))

    def add_model(self, name: str, scope: Scope, pose: FloatArray, relative_to: str, placement: str) -> None:
        """Define a nested model; with a placement frame, `pose` is where that frame of the model comes to stand."""
        self._frames.setdefault(name, _Frame(pose, relative_to, (scope, placement) if placement else None))
        self._children.setdefault(name, scope)

    def resolve(self, name: str) -> FloatArray:
        """(4, 4) pose of a frame in this scope's root frame.

        Raises WorldError for a name that is not defined and for poses that depend on themselves.
        """
        return self._resolve(name, ())

    def _resolve(self, name: str, chain: tuple[str, ...]) -> FloatArray:
        if name in ("", "__model__", "__root__", "world"):
            return np.eye(4)
        if name in self._resolved:
            return self._resolved[name]
        if name in chain:
            circle = [*chain[chain.index(name) :], name]
            raise WorldError(f"Poses in {self.where} depend on themselves: {' -> '.join(circle)}.")
        frame = self._frames.get(name)
        if frame is None:
            child, _, rest = name.partition("::")
            if child not in self._children or not rest:
                raise WorldError(f"A pose in {self.where} is relative to '{name}', but there is no such frame.")
            T = self._resolve(child, (*chain, name)) @ self._children[child].resolve(rest)
        else:
            T = self._resolve(frame.relative_to, (*chain, name)) @ frame.pose
            if frame.placement is not None:
                scope, placement = frame.placement
                T = T @ invert_se3(scope.resolve(placement))
        self._resolved[name] = T
        return T
