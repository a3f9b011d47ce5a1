"""How wide the tables of a paper may be, and which columns they have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from taskslam.report.tables.columns import FAILURES, REAL_TIME, SEEDS, Column, columns_named, quantity_columns


@dataclass(frozen=True)
class Layout:
    """columns: of the table of methods, None for all; intervals: whether values have theirs beside them.

    waypoints: columns of the table of waypoints, further ones go below; width: inches that it must fit into, 0 for any.
    """

    columns: tuple[Column, ...] | None = None
    intervals: bool = True
    waypoints: int = 8
    width: float = 0.0

    @property
    def of_methods(self) -> Sequence[Column]:
        """The columns of the table of methods."""
        return [SEEDS, *quantity_columns(), FAILURES, REAL_TIME] if self.columns is None else self.columns

    def with_columns(self, names: Sequence[str]) -> Layout:
        """The same with these columns, where any are named. Raises InputError for one that there is not."""
        return replace(self, columns=tuple(columns_named(names))) if names else self


def presets() -> Mapping[str, Layout]:
    """By name: one column and both columns of an IEEE page."""
    narrow = Layout(tuple(columns_named(("C", "E", "e", "N-AUC"))), intervals=False, waypoints=2, width=3.5)
    wide = Layout(tuple(columns_named(("C", "E", "e", "Δ", "δ", "N-AUC"))), intervals=True, waypoints=8, width=7.16)
    return MappingProxyType({"ieee-column": narrow, "ieee-wide": wide})
