"""Where tables and sentences are printed."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

_UNWATCHED = 160  # columns; a pipe or the log of a CI has no edge, and rich would assume 80 and cut names off


def standard_output() -> Console:
    """Standard output, as wide as its terminal, or `COLUMNS`, or any table where it is no terminal."""
    from rich.console import Console

    watched = sys.stdout.isatty() or "COLUMNS" in os.environ
    return Console(highlight=False, width=None if watched else _UNWATCHED)
