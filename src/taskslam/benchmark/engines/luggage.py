"""The files behind a tour, packed so that a machine without them can drive it: world, models, textures and map.

What is packed is what reading them has read, no more; the name of a parcel is the hash of what is in it, so that it
travels to a machine once, and arrives whole or is refused.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

from taskslam.benchmark.spec import Drive, RunSpec
from taskslam.benchmark.stage import find_file
from taskslam.errors import InfrastructureError, InputError, RecordError
from taskslam.files import cache_folder
from taskslam.processes.patience import Patience
from taskslam.reading import LARGEST_WORLD_FILE, read_bytes
from taskslam.record.place import whole_folder
from taskslam.user_files import read_mapping
from taskslam.world.gazebo.importer import import_sdf
from taskslam.world.gazebo.resources import Resources, search_roots

_PATIENCE_S = 60.0  # with another task that lays out the same parcel
_LOOKING_S = 0.05


@dataclass(frozen=True)
class Parcel:
    """Files of a tour by their paths below a root.

    folders: below the root, in which a spec's files are found; hollow: those that must be there though nothing in them
    was read.
    """

    files: dict[str, bytes]
    folders: tuple[str, ...]
    hollow: tuple[str, ...]

    @property
    def name(self) -> str:
        """SHA-256 of what is in it."""
        sha = hashlib.sha256(repr((self.folders, self.hollow)).encode())
        for path, content in sorted(self.files.items()):
            sha.update(f"{path}\0{len(content)}\0".encode())
            sha.update(content)
        return sha.hexdigest()


def pack(spec: RunSpec, folders: Sequence[Path]) -> Parcel | None:
    """What a spec's tour needs of the files in these folders; None where it needs none.

    Raises:
        InputError: a file is not there, or cannot be read.
    """
    assert isinstance(spec.task, Drive)
    scenario = spec.task.scenario
    read: set[Path] = set()
    named: list[tuple[Path, str]] = []
    hollow: list[Path] = []
    if scenario.world is not None and scenario.world.file is not None:
        world = _found(scenario.world.file, folders, spec)
        hollow = [Path(os.path.normpath(world.parent / path)) for path in scenario.world.resource_paths]
        resources = Resources(search_roots(world, hollow))
        import_sdf(world, resources)
        read |= {Path(stamp.path) for stamp in resources.stamps()} | {world}
        named.append((world, scenario.world.file))
    if scenario.floor_plan.map is not None:
        plan = _found(scenario.floor_plan.map, folders, spec)
        described = read_mapping(plan, "map", InputError, "those of map_server")
        read |= {plan, Path(os.path.normpath(plan.parent / str(described.get("image", ""))))}
        named.append((plan, scenario.floor_plan.map))
    if not named:
        return None
    root = Path(os.path.commonpath([*(path.parent for path in read), *hollow]))
    return Parcel(
        {path.relative_to(root).as_posix(): read_bytes(path, "file", InputError, LARGEST_WORLD_FILE) for path in read},
        tuple(_above(path, name).relative_to(root).as_posix() for path, name in named),
        tuple(path.relative_to(root).as_posix() for path in hollow),
    )


def unpack(parcel: Parcel) -> tuple[Path, ...]:
    """Lay a parcel's files into the cache of this machine, unless they lie there; the folders in which they are found.

    Raises InfrastructureError: the cache cannot be written.
    """
    place = cache_folder() / "parcels" / parcel.name
    patience = Patience(_PATIENCE_S)
    while not place.is_dir():
        try:
            _lay_out(parcel, place)
        except (OSError, RecordError) as error:
            if place.is_dir():
                break  # another task of this machine was faster
            if isinstance(error, OSError) or not patience.look():
                raise
            time.sleep(_LOOKING_S)  # another one is at it
    return tuple(place / folder for folder in parcel.folders)


def _lay_out(parcel: Parcel, place: Path) -> None:
    with whole_folder(place) as folder:
        for name in parcel.hollow:
            (folder / name).mkdir(parents=True, exist_ok=True)
        for name, content in parcel.files.items():
            if PurePath(name).is_absolute() or ".." in PurePath(name).parts:
                raise InfrastructureError(f"a parcel of files names '{name}'; expected places below its root")
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)


def _found(name: str, folders: Sequence[Path], spec: RunSpec) -> Path:
    path = find_file(name, folders)
    if path is None:
        raise InputError(f"{spec.title}: the file '{name}' lies in none of the folders")
    return Path(os.path.normpath(path.absolute()))


def _above(path: Path, name: str) -> Path:
    """The folder from which `name` leads to `path`, or the one that holds it."""
    parts = PurePath(name).parts
    return path.parents[len(parts) - 1] if path.parts[-len(parts) :] == parts else path.parent
