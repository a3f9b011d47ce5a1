"""The cache of imported worlds: one file per world, never stale, rebuilt without a word when damaged.

A cached world is one `.npz` archive of plain arrays (nothing pickled) with a JSON text among them. That text lists
every file that the import read, with size, modification time and SHA-256, and every place where it looked in vain. A
world is taken from the cache only if all of that is still so: sizes and times are compared first, contents where they
differ.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import WorldError
from taskslam.reading import LARGEST_CACHED_WORLD, LARGEST_WORLD_FILE, Arrays, read_arrays, read_bytes
from taskslam.world import gazebo
from taskslam.world.gazebo.resources import FileStamp, Resources, list_scripts
from taskslam.world.world import Light, Material, TriangleMesh, World

_FORMAT = 1
_DAMAGE = (WorldError, OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)


def cache_file(cache_dir: Path, world_file: Path, roots: Sequence[Path]) -> Path:
    """Where a world is cached: by its path, the folders searched, and the code that imports it."""
    identity = json.dumps([_FORMAT, _code_digest(), str(world_file), [str(root) for root in roots]])
    return cache_dir / "worlds" / f"{world_file.stem}-{hashlib.sha256(identity.encode()).hexdigest()[:16]}.npz"


def _code_digest() -> str:
    """SHA-256 over the importer's source, so that a change of the importer makes old entries unused."""
    digest = hashlib.sha256()
    for source in sorted(Path(next(iter(gazebo.__path__))).glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def load_cached(file: Path) -> World | None:
    """The cached world, or None if there is none, it is damaged, or anything that it was made from has changed."""
    try:
        arrays = read_arrays(file, "cached world", WorldError, LARGEST_CACHED_WORLD)
        header = json.loads(arrays["header"].tobytes())
        return _unpack(header["world"], arrays) if _still_true(header["sources"]) else None
    except _DAMAGE:
        return None


def save_cached(file: Path, world: World, resources: Resources) -> None:
    """Write a world to the cache, whole or not at all; a cache that cannot be written is no error."""
    arrays, description = _pack(world)
    sources = {
        "files": [asdict(stamp) for stamp in resources.stamps()],
        "absent": resources.absent(),
        "scripts": resources.listings(),
    }
    header = json.dumps({"world": description, "sources": sources}).encode()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.stem}-", suffix=".npz")
        try:
            with os.fdopen(handle, "wb") as out:
                np.savez(out, allow_pickle=False, header=np.frombuffer(header, np.uint8), **arrays)
            Path(name).replace(file)
        finally:
            Path(name).unlink(missing_ok=True)
    except OSError:
        return


def _still_true(sources: dict[str, Any]) -> bool:
    return (
        all(_unchanged(FileStamp(**stamp)) for stamp in sources["files"])
        and not any(os.path.exists(path) for path in sources["absent"])  # noqa: PTH110 - many and quick
        and all(list_scripts(Path(folder)) == found for folder, found in sources["scripts"].items())
    )


def _unchanged(stamp: FileStamp) -> bool:
    status = os.stat(stamp.path)  # noqa: PTH116 - many and quick
    if status.st_size != stamp.size:
        return False
    if status.st_mtime_ns == stamp.modified_ns:
        return True
    data = read_bytes(Path(stamp.path), "file of a world", WorldError, LARGEST_WORLD_FILE)
    return hashlib.sha256(data).hexdigest() == stamp.digest


def _pack(world: World) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Any]]:
    arrays: dict[str, npt.NDArray[Any]] = {}
    for kind, mesh in (("visual", world.visual), ("collision", world.collision)):
        for column in fields(TriangleMesh):
            arrays[f"{kind}_{column.name}"] = getattr(mesh, column.name)
    textures: dict[int, int] = {}
    materials = []
    for material in world.materials:
        entry = {f.name: getattr(material, f.name) for f in fields(Material) if f.name != "texture"}
        if material.texture is not None:
            number = textures.setdefault(id(material.texture), len(textures))
            arrays[f"texture_{number}"] = material.texture
            entry["texture"] = number
        materials.append(entry)
    lights = []
    for number, light in enumerate(world.lights):
        arrays[f"light_{number}"] = light.pose
        lights.append({f.name: getattr(light, f.name) for f in fields(Light) if f.name != "pose"})
    description = {
        "name": world.name,
        "materials": materials,
        "models": world.models,
        "lights": lights,
        "ambient": world.ambient,
        "background": world.background,
        "warnings": world.warnings,
    }
    return arrays, description


def _unpack(description: dict[str, Any], archive: Arrays) -> World:
    meshes = {
        kind: TriangleMesh(**{column.name: archive[f"{kind}_{column.name}"] for column in fields(TriangleMesh)})
        for kind in ("visual", "collision")
    }
    textures: dict[int, npt.NDArray[np.uint8]] = {}
    materials = []
    for entry in description["materials"]:
        number = entry.pop("texture", None)
        if number is not None and number not in textures:
            textures[number] = archive[f"texture_{number}"]
        texture = None if number is None else textures[number]
        materials.append(Material(texture=texture, **{key: _tuples(value) for key, value in entry.items()}))
    lights = [
        Light(pose=archive[f"light_{number}"], **{key: _tuples(value) for key, value in entry.items()})
        for number, entry in enumerate(description["lights"])
    ]
    return World(
        name=description["name"],
        visual=meshes["visual"],
        collision=meshes["collision"],
        materials=tuple(materials),
        models=tuple(description["models"]),
        lights=tuple(lights),
        ambient=_tuples(description["ambient"]),
        background=_tuples(description["background"]),
        warnings=tuple(description["warnings"]),
    )


def _tuples(value: Any) -> Any:
    """JSON's lists as the tuples that they were."""
    return tuple(value) if isinstance(value, list) else value
