"""What a world names and does not get: missing, damaged and unsupported parts, counted and named in a few sentences."""

from __future__ import annotations

from dataclasses import dataclass, field

from taskslam.errors import WorldError
from taskslam.skipped import too_many

_PLURALS = {"part of a mesh": "parts of meshes", "mesh": "meshes", "kind of element": "kinds of element"}
_EACH = {"model": "instances"}
_MISSING, _DAMAGED, _UNSUPPORTED = "Missing and left out", "Damaged and left out", "Not supported and left out"


@dataclass
class LeftOut:
    """Collects, while a world is imported, what does not become part of it. used: visuals and collisions that do."""

    used: int = 0
    broken: int = 0
    reasons: list[str] = field(default_factory=list)
    notes: dict[str, None] = field(default_factory=dict)
    _names: dict[tuple[str, str], dict[str, int]] = field(default_factory=dict)

    def missing(self, noun: str, name: str) -> None:
        """A model, mesh, texture or material that is nowhere to be found."""
        self._count(_MISSING, noun, name)

    def damaged(self, noun: str, name: str) -> None:
        """A file, or a part of one, that is there and cannot be used."""
        self._count(_DAMAGED, noun, name)

    def unsupported(self, element: str) -> None:
        """A kind of element that is not read."""
        self._count(_UNSUPPORTED, "kind of element", element)

    def part(self, noun: str, error: WorldError) -> None:
        """A visual, a collision or a model that is left out for what is wrong with it."""
        self.broken += 1
        if str(error) not in self.reasons:
            self.reasons.append(str(error))
        self._count(_DAMAGED, noun, "")

    def note(self, sentence: str) -> None:
        """Something that was guessed, or read otherwise than it was written."""
        self.notes[sentence] = None

    def refuse_above_share(self) -> None:
        """Raise WorldError with the first reason where more parts are broken than not."""
        parts = self.used + self.broken
        if too_many(self.broken, parts):
            others = f" ({self.broken} of {parts} parts cannot be used.)" if parts > 1 else ""
            raise WorldError(self.reasons[0] + others)

    def what_is_missing(self) -> str:
        """One sentence that counts and names everything that was not found; empty if nothing is missing."""
        return self._sentence(_MISSING)

    def sentences(self) -> list[str]:
        """What was left out, then what was guessed."""
        told = [self._sentence(_MISSING), self._sentence(_DAMAGED), self._sentence(_UNSUPPORTED)]
        return [sentence for sentence in told if sentence] + list(self.notes)

    def _count(self, how: str, noun: str, name: str) -> None:
        names = self._names.setdefault((how, noun), {})
        names[name] = names.get(name, 0) + 1

    def _sentence(self, how: str) -> str:
        parts = [_counted(noun, names) for (kind, noun), names in self._names.items() if kind == how]
        if not parts:
            return ""
        first = f" First: {self.reasons[0]}" if how == _DAMAGED and self.reasons else ""
        return f"{how}: {'; '.join(parts)}.{first}"


def _counted(noun: str, names: dict[str, int]) -> str:
    """`2 models (5 instances): a, b`; parts without names are only counted."""
    total = sum(names.values())
    if set(names) == {""}:
        return f"{total} {noun if total == 1 else _plural(noun)}"
    repeated = f" ({total} {_EACH.get(noun, 'uses')})" if total > len(names) else ""
    return f"{len(names)} {noun if len(names) == 1 else _plural(noun)}{repeated}: {', '.join(sorted(names))}"


def _plural(noun: str) -> str:
    return _PLURALS.get(noun, f"{noun}s")
