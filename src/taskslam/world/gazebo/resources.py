"""Where Gazebo finds things: models, meshes, material scripts and textures, through URIs and resource paths.

Everything that an import reads goes through `Resources`, which notes each file that was read and each place where
nothing was found. That list is what makes the cache of loaded worlds exact (`taskslam.world.cache`).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from taskslam.errors import LeavesFolderError, WorldError
from taskslam.reading import LARGEST_WORLD_FILE, MOST_ENTRIES, open_file
from taskslam.world.gazebo.document import NEWEST_SDF, parse_version, parse_xml
from taskslam.world.gazebo.macros import expanded, xacro_program

FUEL_VARIABLES = ("GZ_FUEL_CACHE_PATH", "IGN_FUEL_CACHE_PATH")
PATH_VARIABLES = ("GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "GAZEBO_RESOURCE_PATH")


@dataclass(frozen=True)
class FileStamp:
    """A file as it was when read: absolute path, size in bytes, modification time and SHA-256."""

    path: str
    size: int
    modified_ns: int
    digest: str


def search_roots(world_file: Path, resource_paths: Sequence[Path]) -> tuple[Path, ...]:
    """Folders to search, in order: the caller's, Gazebo's environment variables, the world's own neighbourhood.

    The neighbourhood is what the public worlds need without any setting: the world's folder and its parent, and a
    folder `models` in either of them or one level below the world.
    """
    from_environment = [Path(p) for name in PATH_VARIABLES for p in os.environ.get(name, "").split(os.pathsep) if p]
    folder = world_file.parent
    near = [folder, folder / "models", folder.parent, folder.parent / "models", *sorted(folder.glob("*/models"))]
    roots: dict[str, Path] = {}
    for root in [*resource_paths, *from_environment, *near]:
        absolute = os.path.normpath(Path(root).expanduser().absolute())
        if absolute not in roots and Path(absolute).is_dir():
            roots[absolute] = Path(absolute)
    return tuple(roots.values())


class Resources:
    """Look-up and reading of the files behind one world."""

    def __init__(self, roots: Sequence[Path]) -> None:
        self.roots = tuple(roots)
        self._stamps: dict[str, FileStamp] = {}
        self._absent: set[str] = set()
        self._listings: dict[str, list[str]] = {}

    def stamps(self) -> list[FileStamp]:
        """Every file read so far, by path."""
        return [self._stamps[path] for path in sorted(self._stamps)]

    def absent(self) -> list[str]:
        """Every path looked for in vain so far, sorted."""
        return sorted(self._absent)

    def listings(self) -> dict[str, list[str]]:
        """Every folder searched for material scripts, with the scripts found."""
        return {folder: self._listings[folder] for folder in sorted(self._listings)}

    def scripts_in(self, folder: Path) -> list[Path]:
        """The Ogre material scripts in a folder and below, in order of their paths."""
        files = list_scripts(folder)
        self._listings[str(folder)] = files
        return [Path(file) for file in files]

    def read(self, path: Path) -> bytes:
        """Content of a file; raises WorldError naming it if it cannot be read."""
        with open_file(path, "file of a world", WorldError, LARGEST_WORLD_FILE) as file:
            status = os.fstat(file.fileno())
            data = file.read()
        digest = hashlib.sha256(data).hexdigest()
        self._stamps[str(path)] = FileStamp(str(path), status.st_size, status.st_mtime_ns, digest)
        return data

    def expand(self, path: Path) -> bytes | None:
        """The file without xacro's macros; None where xacro is not installed. Raises WorldError if it cannot."""
        program = xacro_program()
        if program is None:
            return None
        content, included = expanded(program, path)
        for file in included:
            self.read(file)
        return content

    def digest(self, path: Path) -> str:
        """SHA-256 of a file that has been read."""
        return self._stamps[str(path)].digest

    def find(self, uri: str, folder: Path, where: str) -> Path | None:
        """The file or folder that a URI means, or None if there is none.

        `model://` and `package://` are searched in the roots; `file://` and plain paths beside the referring file
        (in `folder`) and then in the roots; web addresses in the Fuel caches, and by the model's name in the roots (one
        that was downloaded by hand). Raises WorldError if the path leaves the folder that it is relative to.
        """
        uri = uri.strip()
        scheme, separator, rest = uri.partition("://")
        path = unquote(rest if separator else uri).replace("\\", "/")
        if separator and scheme not in ("model", "package", "file"):
            return self._from_fuel(fuel_name(uri)) if fuel_name(uri).name else None
        if Path(path).is_absolute():
            return self._first([Path(os.path.normpath(path))])
        if scheme in ("model", "package") and separator:
            _refuse_escape(path, uri, where)
            return self._first(self._model_places(path))
        beside = Path(os.path.normpath(folder / path))
        if not any(beside.is_relative_to(root) for root in (folder.parent, *self.roots)):
            raise LeavesFolderError(f"'{uri}' in {where} leads out of its folder; expected a path inside it.")
        return self._first([beside, *(p for root in self.roots if (p := _inside(root, path)))])

    def find_texture(self, name: str, folder: Path) -> Path | None:
        """The image that a mesh or script in `folder` calls `name`.

        Gazebo's order: the path as written, `materials/textures` beside the folder of meshes, and then by file name
        in the resource paths, their `materials/textures` and, for the AWS worlds, their `photos`.
        """
        name = unquote(name.strip()).replace("\\", "/")
        if name.startswith(("model://", "package://")):
            return self.find(name, folder, str(folder))
        name = name.removeprefix("file://")
        base = name.rsplit("/", 1)[-1]
        if not base:
            return None
        candidates = [_inside(folder.parent, os.path.join(folder.name, name))]  # noqa: PTH118 - keeps ".." for the check
        candidates += [
            folder / base,
            folder.parent / "materials" / "textures" / base,
            folder.parent / "textures" / base,
        ]
        for root in self.roots:
            candidates += [root / base, root / "materials" / "textures" / base, root / "photos" / base]
        return self._first((c for c in candidates if c is not None), files_only=True)

    def model_sdf(self, folder: Path) -> Path | None:
        """The SDF file of a model folder: the newest version in `model.config` that is known, else the oldest."""
        for config in (folder / "model.config", folder / "manifest.xml"):
            if self.exists(config):
                listed = [
                    (parse_version(sdf.get("version")) or (0, 0), (sdf.text or "").strip())
                    for sdf in parse_xml(self.read(config), config).iter("sdf")
                ]
                known = sorted((entry for entry in listed if entry[0] <= NEWEST_SDF), reverse=True)
                newer = sorted(entry for entry in listed if entry[0] > NEWEST_SDF)
                for _, name in known + newer:
                    _refuse_escape(name, name, str(config))
                    if name and self.exists(folder / name):
                        return folder / name
        return self._first([folder / "model.sdf"])

    def exists(self, path: Path) -> bool:
        """Whether a path exists; a vain look is noted."""
        found = os.path.exists(path)  # noqa: PTH110 - half the time of Path.exists, over thousands of looks
        if not found:
            self._absent.add(str(path))
        return found

    def _from_fuel(self, model: FuelName) -> Path | None:
        """A model's folder, or a file in it: in a cache as SERVER/owner/models/name/VERSION, or by its name."""
        caches = [*self.roots, *(root / "fuel" for root in self.roots), *_fuel_caches()] if model.server else []
        places: list[Path] = []
        for cache in caches:
            folder = cache / model.server / model.owner.lower() / model.kind / model.name.lower()
            if model.version:
                places.append(folder / model.version)
            elif self.exists(folder) and folder.is_dir():
                versions = sorted((int(path.name) for path in folder.iterdir() if path.name.isdecimal()), reverse=True)
                self.exists(folder / str(versions[0] + 1 if versions else 1))  # so that a newer one is noticed
                places += [folder / str(version) for version in versions]
        places += [root / model.name for root in self.roots]
        return self._first(place / model.file if model.file else place for place in places)

    def _model_places(self, path: str) -> Iterator[Path]:
        name, _, rest = path.partition("/")
        for root in self.roots:
            yield root / path
            if root.name == name:
                yield root / rest if rest else root

    def _first(self, candidates: Iterable[Path], files_only: bool = False) -> Path | None:
        for candidate in candidates:
            if self.exists(candidate) and not (files_only and candidate.is_dir()):
                return candidate
        return None


@dataclass(frozen=True)
class FuelName:
    """What an address on a Fuel server says: server/1.0/owner/models/name[/version[/files/file]].

    kind: `models` or `worlds`. Of any other address only `name` is there, its last part.
    """

    name: str
    server: str = ""
    owner: str = ""
    kind: str = ""
    version: str = ""
    file: str = ""


def fuel_name(uri: str) -> FuelName:
    """The parts of a web address; see `FuelName`."""
    server, *parts = unquote(uri.partition("://")[2]).rstrip("/").split("/")
    safe = all(part not in ("", ".", "..") for part in parts)
    kind = next((at for at, part in enumerate(parts) if part in ("models", "worlds") and 0 < at < len(parts) - 1), 0)
    if not kind or not safe:
        return FuelName(parts[-1] if parts and safe else "")
    name, *rest = parts[kind + 1 :]
    version = rest[0] if rest and rest[0].isdecimal() else ""
    file = "/".join(rest[rest.index("files") + 1 :]) if "files" in rest else ""
    return FuelName(name, server, parts[kind - 1], parts[kind], version, file)


def _fuel_caches() -> list[Path]:
    """Where gz and its elder brother keep what they downloaded."""
    named = [os.environ[name] for name in FUEL_VARIABLES if os.environ.get(name)]
    home = Path.home()
    return [*map(Path, named), home / ".gz" / "fuel", home / ".ignition" / "fuel"]


def list_scripts(folder: Path) -> list[str]:
    """Paths of the `*.material` files in a folder and below, sorted. Raises WorldError if that holds a whole disk."""
    found, seen = [], 0
    for place, folders, files in os.walk(folder):
        seen += len(folders) + len(files)
        if seen > MOST_ENTRIES:
            raise WorldError(f"{folder} holds more than {MOST_ENTRIES} files; expected a folder of material scripts.")
        found += [str(Path(place) / name) for name in files if name.endswith(".material")]
    return sorted(found)


def _refuse_escape(path: str, uri: str, where: str) -> None:
    normal = os.path.normpath(path)
    if normal.startswith("..") or Path(normal).is_absolute():
        raise LeavesFolderError(f"'{uri}' in {where} leads out of its folder; expected a path inside it.")


def _inside(root: Path, path: str) -> Path | None:
    """The path below root if it stays there, else None; judged by its text, so that symbolic links may lead on."""
    joined = Path(os.path.normpath(root / path))
    return joined if joined.is_relative_to(root) else None
