"""Worlds of public repositories: which load, and why the rest does not, as the tables of docs/public_worlds.md.

    python tools/public_worlds.py OWNER/NAME@COMMIT=FOLDER ...

FOLDER holds the files of the repository at that commit. What it keeps elsewhere (Fuel, other packages) counts as
missing. Nothing of these worlds becomes part of this project.
"""

from __future__ import annotations

import re
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from taskslam.errors import TaskSlamError
from taskslam.world.loading import load_world

NOT_WORLDS = {"models", "model", "meshes"}  # folders whose SDF files are models


@dataclass(frozen=True)
class Row:
    """One world. triangles: of the visual and of the collision mesh; said: warnings, or why it is refused."""

    world: str
    triangles: tuple[int, int] | None
    seconds: float
    said: tuple[str, ...]

    @property
    def kind(self) -> str:
        """Whole, in part (something that it names is not there), or refused."""
        if self.triangles is None:
            return "refused"
        return "in part" if any(words.startswith(("Missing", "Damaged")) for words in self.said) else "whole"


def worlds_in(folder: Path) -> list[Path]:
    found = [path for kind in ("*.world", "*.sdf") for path in folder.rglob(kind)]
    return sorted(
        path
        for path in found
        if not NOT_WORLDS & set(path.relative_to(folder).parts[:-1]) and not path.name.startswith("model")
    )


def row(path: Path, folder: Path) -> Row:
    name, begin = str(path.relative_to(folder)), time.process_time()
    models = [place for place in (folder / "models", folder / "model") if place.is_dir()]
    models += sorted({place for place in folder.glob("*/models") if place.is_dir()})
    try:
        world = load_world(path, [*models, folder.parent], use_cache=False)
    except TaskSlamError as error:
        why = str(error).replace(f"{folder}/", "").partition("; there is nothing to load. ")
        return Row(name, None, time.process_time() - begin, (why[2] or why[0],))
    said = tuple(words.replace(f"{folder}/", "") for words in world.warnings)
    return Row(name, (len(world.visual), len(world.collision)), time.process_time() - begin, said)


def table(source: str, rows: list[Row]) -> str:
    name, _, commit = source.partition("@")
    kinds = [each.kind for each in rows]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("whole", "in part", "refused") if kind in kinds)
    lines = [f"## {name}", "", f"At `{commit}`: {len(rows)} worlds, {counts}.", ""]
    lines += ["| world | triangles seen, bumped into | what is missing |", "|---|---|---|"]
    for each in rows:
        triangles = "refused" if each.triangles is None else "{:,}, {:,}".format(*each.triangles)
        words = " ".join(each.said) if each.triangles is None else next(iter(each.said), "")
        words = re.sub(r"/(?:home|opt)/\S*/", "…/", words)  # somebody else's machine
        words = words if len(words) <= 140 else f"{words[:139].rsplit(' ', 1)[0]} …"
        lines.append(f"| `{each.world}` | {triangles} | {words.replace('|', ' ')} |")
    return "\n".join([*lines, ""])


def main() -> None:
    for argument in sys.argv[1:]:
        source, _, folder = argument.partition("=")
        place = Path(folder).resolve()
        print(table(source, [row(path, place) for path in worlds_in(place)]), flush=True)


if __name__ == "__main__":
    main()
