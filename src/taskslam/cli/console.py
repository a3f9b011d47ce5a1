"""Where tables and sentences are printed: one way out for each stream, through which no text acts on a terminal.

Text comes from methods, journals and foreign files, so none of it is markup, and escape sequences are left out.
"""

from __future__ import annotations

import os
import sys
from functools import cache
from typing import TYPE_CHECKING, Any

import typer

from taskslam.printable import printable

if TYPE_CHECKING:
    from rich.console import Console

_UNWATCHED = 190  # columns; a pipe or the log of a CI has no edge, and rich would assume 80 and cut names off


def say(text: str, err: bool = False) -> None:
    """Print a sentence, on standard output or on standard error."""
    typer.echo(printable(text), err=err)


def standard_output() -> Console:
    """Standard output, as wide as its terminal, or `COLUMNS`, or any table where it is no terminal."""
    watched = sys.stdout.isatty() or "COLUMNS" in os.environ
    return _console()(highlight=False, markup=False, width=None if watched else _UNWATCHED)


def standard_error() -> Console:
    """Standard error, where progress is shown and notices are printed."""
    return _console()(highlight=False, markup=False, stderr=True)


@cache
def _console() -> type[Console]:
    """The class of both; rich is imported when something is shown."""
    from collections.abc import Iterable

    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.text import Text

    class PrintableConsole(Console):
        def render_str(self, text: str, **how: Any) -> Text:
            return super().render_str(printable(text), **how)

        def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
            for segment in super().render(renderable, options):
                yield segment if segment.control else segment._replace(text=printable(segment.text))

    return PrintableConsole
