"""Worlds made ready for rendering, kept from process to process: one file each in the user's cache folder.

A file is known by the world's content and by the code that made it, so it is never stale; what cannot be read is made
again without a word. Only large worlds are kept, the others are made as fast as they are read.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import WorldError
from taskslam.files import cache_folder
from taskslam.reading import LARGEST_CACHED_WORLD, Arrays, read_arrays, read_bytes
from taskslam.simulation.rendering.baked_light import BakedLight
from taskslam.simulation.rendering.prepared_world import PreparedWorld, prepare
from taskslam.simulation.rendering.texture_atlas import TextureAtlas
from taskslam.simulation.rendering.triangle_blocks import TriangleBlocks
from taskslam.world import World
from taskslam.world.digest import world_digest

_WORTH_KEEPING = 20_000  # triangles
_MOST_KEPT = 6  # files; the oldest go
_PARTS = {"blocks": TriangleBlocks, "atlas": TextureAtlas, "light": BakedLight}
_DAMAGE = (WorldError, OSError, KeyError, ValueError)
_LARGEST_SOURCE = 1 << 20


def prepared(world: World, color: bool) -> PreparedWorld:
    """As `prepare` makes it, the same arrays, from the cache where it was made before."""
    if len(world.visual) < _WORTH_KEEPING:
        return prepare(world, color)
    file = _file(world, color)
    found = load_prepared(file)
    if found is None:
        found = prepare(world, color)
        save_prepared(file, found)
    return found


def load_prepared(file: Path) -> PreparedWorld | None:
    """What was kept there, None if that is nothing or damaged."""
    try:
        arrays = read_arrays(file, "prepared world", WorldError, LARGEST_CACHED_WORLD)
        return _unpacked(arrays)
    except _DAMAGE:
        return None


def save_prepared(file: Path, ready: PreparedWorld) -> None:
    """Keep it, whole or not at all; a cache that cannot be written is no error."""
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.stem}-", suffix=".partial")
        try:
            with os.fdopen(handle, "wb") as out:
                np.savez(out, allow_pickle=False, **dict(_packed("", ready)))
            Path(name).replace(file)
        finally:
            Path(name).unlink(missing_ok=True)
        by_age = sorted(file.parent.glob("*.npz"), key=lambda kept: kept.stat().st_mtime)
        for old in by_age[:-_MOST_KEPT]:
            old.unlink(missing_ok=True)


def _file(world: World, color: bool) -> Path:
    identity = f"{_code()} {np.__version__} {world_digest(world)} {color}"
    return cache_folder() / "scenes" / f"{hashlib.sha256(identity.encode()).hexdigest()[:32]}.npz"


@cache
def _code() -> str:
    """SHA-256 over this folder's source: whoever changes how worlds are made ready leaves old files unused."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(read_bytes(source, "source file", WorldError, _LARGEST_SOURCE))
    return digest.hexdigest()


def _packed(prefix: str, value: Any) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """The arrays and numbers of a dataclass, and of those in it, by their names."""
    for field in fields(value):
        one = getattr(value, field.name)
        if is_dataclass(one):
            yield from _packed(f"{prefix}{field.name}_", one)
        else:
            yield prefix + field.name, np.asarray(one)


def _unpacked(arrays: Arrays) -> PreparedWorld:
    found: dict[str, Any] = {name: array if array.ndim else array.item() for name, array in arrays.items()}
    parts: dict[str, Any] = {
        name: kind(**{field.name: found[f"{name}_{field.name}"] for field in fields(kind)})
        for name, kind in _PARTS.items()
    }
    rest = {field.name: found[field.name] for field in fields(PreparedWorld) if field.name not in parts}
    return PreparedWorld(**parts, **rest)
