"""The wall around one method: what is opened for it beyond what every guest has, and what is closed to it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from taskslam.processes.guest import METHOD_VARIABLES
from taskslam.processes.wall import Wall, working_folder
from taskslam.slam.base import MethodCard
from taskslam.slam.registry import find_method, is_local


def wall_of(method: str, card: MethodCard | None, named: Iterable[Path], closed: Iterable[Path]) -> Wall:
    """The wall around a method. card: as it was described, None where nothing is known; named: files in its options.

    With a file that is named come those beside it that differ in the suffix alone, as a map's YAML and its image do.
    closed: folders of results. The folder that holds the code of a method in the user's own stays open in these. Files
    that the user names in variables meant for methods are open too.
    """
    here = working_folder() if is_local(method) else None
    described_by = find_method(method).file
    local = (*(() if here is None else (here,)), *(() if described_by is None else (described_by,)))
    places = tuple(Path(place) for place in card.reads) if card is not None else ()
    told = (Path(value) for key, value in os.environ.items() if key.startswith(METHOD_VARIABLES) and "/" in value)
    read = (*local, *places, *(place.absolute() for name in (*named, *told) for place in _with_namesakes(name)))
    keep = (*read, *(Path(entry) for entry in sys.path if entry))
    loopback, shared_memory = card is not None and card.loopback, card is not None and card.shared_memory
    return Wall(read, tuple(_beside_code(closed, here)), keep, loopback, shared_memory)


def _with_namesakes(named: Path) -> Iterator[Path]:
    yield named
    with suppress(OSError):
        yield from (entry for entry in named.parent.iterdir() if named.is_file() and entry.stem == named.stem)


def _beside_code(closed: Iterable[Path], here: Path | None) -> Iterator[Path]:
    """The same, but where results lie in the very folder that the method's code is in: those of this scenario."""
    folders = [folder.resolve() for folder in closed]
    for folder in folders:
        if folder != here:
            in_the_way = here in folders and folder.is_relative_to(here)
            yield here / folder.relative_to(here).parts[0] if in_the_way and here is not None else folder
