"""`load_world`: a world by file or by name, from the cache where nothing has changed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.metadata import EntryPoint
from pathlib import Path

from taskslam.errors import WorldError, did_you_mean
from taskslam.files import cache_folder
from taskslam.plugins import registered
from taskslam.reading import is_file, is_folder, is_there
from taskslam.world.cache import cache_file, load_cached, save_cached
from taskslam.world.gazebo.resources import Resources, search_roots
from taskslam.world.world import World

WORLD_GROUP = "taskslam.worlds"
WORLD_SUFFIXES = (".world", ".sdf")


def registered_worlds() -> dict[str, EntryPoint]:
    """Worlds built in code, by name: entry points of the group `taskslam.worlds`, each a callable `() -> World`."""
    return registered(WORLD_GROUP)


def load_world(
    reference: str | Path,
    resource_paths: Sequence[Path] = (),
    cache_dir: Path | None = None,
    use_cache: bool = True,
) -> World:
    """Load a world: the path of a Gazebo world (`.world`, `.sdf`) or the name of a registered world.

    resource_paths: folders to search for models and textures before `GZ_SIM_RESOURCE_PATH`, `GAZEBO_MODEL_PATH` and
    `GAZEBO_RESOURCE_PATH`; the `models` and `photos` folders beside the world are found without them. cache_dir: by
    default `TASKSLAM_CACHE`, `$XDG_CACHE_HOME/taskslam` or `~/.cache/taskslam`.

    The arrays are the same on every load. Raises WorldError if there is no such world or it cannot be read; what is
    merely missing from it is told in `World.warnings`.
    """
    path = Path(reference).expanduser()
    if path.suffix.lower() not in WORLD_SUFFIXES and not is_file(path):
        return _registered(str(reference))
    if not is_file(path):
        raise WorldError(f"World file {path} does not exist; expected a Gazebo world (.world or .sdf).")
    path = _canonical(path)
    missing = [str(folder) for folder in resource_paths if not is_folder(Path(folder).expanduser())]
    if missing:
        raise WorldError(f"Resource path {missing[0]} is not a folder.")
    roots = search_roots(path, resource_paths)
    if not use_cache:
        return _import(path, Resources(roots))
    file = cache_file(cache_dir if cache_dir is not None else cache_folder(), path, roots)
    world = load_cached(file)
    if world is None:
        resources = Resources(roots)
        world = _import(path, resources)
        save_cached(file, world, resources)
    return world


def _canonical(path: Path) -> Path:
    """Absolute path without `..`; symbolic links stay, because the models may lie beside the link."""
    plain = Path(os.path.normpath(path.absolute()))
    return plain if is_there(plain) and plain.samefile(path) else path.resolve()


def _import(path: Path, resources: Resources) -> World:
    from taskslam.world.gazebo.importer import import_sdf  # mesh readers are heavy, and a cached world needs none

    return import_sdf(path, resources)


def _registered(name: str) -> World:
    known = registered_worlds()
    if name not in known:
        looks_like_file = "/" in name or "\\" in name
        expected = f"a file (.world or .sdf) or one of: {', '.join(known) or 'none is registered'}"
        problem = f"'{name}' does not exist" if looks_like_file else f"There is no world '{name}'"
        raise WorldError(f"{problem}; expected {expected}.{did_you_mean(name, known)}")
    try:
        build = known[name].load()
    except (ImportError, AttributeError) as error:
        raise WorldError(f"World '{name}' ({known[name].value}) cannot be imported: {error}.") from error
    world = build()
    if not isinstance(world, World):
        raise WorldError(f"World '{name}' ({known[name].value}) gave {type(world).__name__}; expected a World.")
    return world
