"""Whether rounds share a map: the two ways in which the paper drives every tour (Sec. III)."""

from __future__ import annotations

from enum import StrEnum


class Mode(StrEnum):
    """Whether rounds share a map."""

    WITHOUT_MAP = "without-map"
    WITH_MAP = "with-map"

    @property
    def words(self) -> str:
        """In a sentence: `without map`."""
        return self.value.replace("-", " ")

    @property
    def short(self) -> str:
        """In a narrow column: `w/o` or `w/`."""
        return "w/" if self is Mode.WITH_MAP else "w/o"
