"""One bad row, message or part of a world costs no more than itself: skipped, counted, the first one named.

The one place of that rule, for every reader. Above a share of what was read the input is refused instead: then it is
no slip but another kind of file, or a unit or order that was taken wrongly.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

LARGEST_SHARE = 0.5
ENOUGH_TO_TELL = 10  # of a stream, before its share says something


@dataclass
class Skipped:
    """What was left out of an input. counts: by a word for it; first: what was wrong with the first of each."""

    counts: Counter[str] = field(default_factory=Counter)
    first: dict[str, str] = field(default_factory=dict)

    def add(self, what: str, why: str = "", count: int = 1) -> None:
        """Note that so many are left out; `why` is kept of the first: a sentence, or where it stands."""
        self.counts[what] += count
        if why:
            self.first.setdefault(what, why)

    def __bool__(self) -> bool:
        """Whether anything was left out."""
        return bool(self.counts)

    def sentences(self) -> list[str]:
        """`3 scans that cannot be read (first: ...)`, one for each kind, in the order of their words."""
        return [f"{count} {what}{self._first(what)}" for what, count in sorted(self.counts.items())]

    def _first(self, what: str) -> str:
        return f" (first: {self.first[what]})" if what in self.first else ""


def too_many(skipped: int, seen: int, at_least: int = 0) -> bool:
    """Whether so many of all that were seen mean that the input itself is wrong. at_least: below it, never."""
    return skipped > max(LARGEST_SHARE * seen, at_least)
