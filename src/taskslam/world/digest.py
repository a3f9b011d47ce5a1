"""What a world and a floor plan are, as one number: two that differ in anything that a run can feel differ here."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, fields

import numpy as np
import numpy.typing as npt

from taskslam.world.floor_plan import FloorPlan
from taskslam.world.world import Material, TriangleMesh, World


def world_digest(world: World) -> str:
    """SHA-256 over geometry, surfaces and lights. Not over names of files and models, nor over warnings."""
    digest = hashlib.sha256()
    for mesh in (world.visual, world.collision):
        for column in fields(TriangleMesh):
            if column.name != "owner":
                _add(digest, getattr(mesh, column.name))
    for material in world.materials:
        _say(digest, {f.name: getattr(material, f.name) for f in fields(Material) if f.name not in ("name", "texture")})
        if material.texture is not None:
            _add(digest, material.texture)
    for light in world.lights:
        content = asdict(light)
        _add(digest, content.pop("pose"))
        _say(digest, {key: value for key, value in content.items() if key != "name"})
    _say(digest, [world.ambient, world.background])
    return digest.hexdigest()


def plan_digest(plan: FloorPlan) -> str:
    """SHA-256 over a floor plan's cells, resolution and place."""
    digest = hashlib.sha256()
    _add(digest, plan.cells)
    _say(digest, [plan.resolution, plan.origin.x, plan.origin.y, plan.origin.theta])
    return digest.hexdigest()


def _add(digest: hashlib._Hash, array: npt.NDArray[np.generic]) -> None:
    _say(digest, [array.dtype.str, array.shape])
    digest.update(np.ascontiguousarray(array).data)


def _say(digest: hashlib._Hash, content: object) -> None:
    digest.update(json.dumps(content, sort_keys=True, default=float).encode())
