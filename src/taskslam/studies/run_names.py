"""Which files are runs of the same method, told by their names.

`orb_run0.tum` says that it is a run. A bare number at the end (`stamped_traj_estimate0.txt`, `karto_2.tum`) is a run's
where siblings share what stands before it and count from 0 or 1, and never where the whole is the name of a registered
method: orb_slam2 and orb_slam3 are two methods.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

from taskslam.plugins import registered

METHOD_GROUP = "taskslam.methods"
_SAYS_RUN = re.compile(r"(?:^|[_.-]|(?<=[a-z0-9]))(?:run|round|trial|loop)[_-]?\d+$|^\d+$", re.IGNORECASE)
_NUMBER = re.compile(r"(.*?)[_.-]?(\d+)$", re.DOTALL)


class Grouping(StrEnum):
    """How files become runs of methods: by their names, all of one method, or each a method of its own."""

    BY_NAME = "by-name"
    ONE_METHOD = "one-method"
    APART = "apart"


def method_names(paths: Sequence[Path], grouping: Grouping = Grouping.BY_NAME) -> list[str]:
    """The method of each file. An empty name is one that the file does not tell: its folder may."""
    if grouping is Grouping.APART:
        stems = [path.stem for path in paths]
        return [
            stem if stems.count(stem) == 1 else f"{path.parent.name}/{stem}"
            for stem, path in zip(stems, paths, strict=True)
        ]
    numbered = _numbered([path.stem for path in paths], [path.parent for path in paths])
    names = [numbered.get((path.parent, path.stem), _SAYS_RUN.sub("", path.stem).rstrip("_.-")) for path in paths]
    if grouping is Grouping.ONE_METHOD:
        common = _common_start([name or path.parent.name for name, path in zip(names, paths, strict=True)])
        return [common or "method"] * len(paths)
    return names


def _numbered(stems: Sequence[str], folders: Sequence[Path]) -> dict[tuple[Path, str], str]:
    """What stands before the number of each stem whose number is that of a run."""
    known = registered(METHOD_GROUP)
    siblings: dict[tuple[Path, str], dict[str, int]] = defaultdict(dict)
    for folder, stem in zip(folders, stems, strict=True):
        found = _NUMBER.fullmatch(stem)
        if found and found[1] and not _SAYS_RUN.search(stem) and stem not in known:
            siblings[folder, found[1]][stem] = int(found[2])
    return {
        (folder, stem): before
        for (folder, before), runs in siblings.items()
        if len(runs) > 1 and min(runs.values()) <= 1 and max(runs.values()) <= 2 * len(runs)
        for stem in runs
    }


def _common_start(names: Sequence[str]) -> str:
    """The longest start that all names share, without what separates words at its end."""
    first, last = min(names), max(names)
    length = next(
        (at for at, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last))
    )
    return first[:length].rstrip("_.-0123456789 ") or first[:length]
