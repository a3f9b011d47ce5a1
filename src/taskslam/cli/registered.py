"""What packages register under a group of entry points, as a table."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def registered_table(entries: Mapping[str, EntryPoint]) -> Table:
    """A row for each name, with what makes it."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    table.add_column("name", style="bold")
    table.add_column("made by")
    for name, entry in entries.items():
        table.add_row(name, entry.value)
    return table
