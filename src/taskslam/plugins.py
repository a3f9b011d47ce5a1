"""What this package and anyone else's register under a group of entry points: methods, worlds, planners (design D9)."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points


def registered(group: str) -> dict[str, EntryPoint]:
    """The entry points of a group by name, sorted; nothing is imported.

    Of two packages that register the same name the one that is found first counts, as for imports.
    """
    found: dict[str, EntryPoint] = {}
    for entry in entry_points(group=group):
        found.setdefault(entry.name, entry)
    return dict(sorted(found.items()))
