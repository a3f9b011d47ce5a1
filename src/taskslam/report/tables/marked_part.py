"""The part of a written page that a command makes: between two marks, so that all else on it stays a person's."""

from __future__ import annotations

import textwrap
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.files import write_whole
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text

_COLUMNS = 120


def replace_marked(page: Path, name: str, text: str) -> None:
    """Put `text` between `<!-- tables of NAME -->` and `<!-- end of tables of NAME -->`; what was there goes.

    Lines that are none of a table are broken, as a person would.

    Raises RecordError: the page cannot be read, or has not each mark once, in this order; DiskFullError.
    """
    begin, end = f"<!-- tables of {name} -->\n", f"<!-- end of tables of {name} -->"
    content = read_text(page, "page", RecordError, LARGEST_WRITTEN_BY_HAND)
    before, began, rest = content.partition(begin)
    _, ended, after = rest.partition(end)
    if not began or not ended or content.count(begin) > 1 or content.count(end) > 1:
        raise RecordError(f"{page}: expected one line '{begin.strip()}' and one line '{end}' behind it")
    lines = [line if line.startswith("|") else _broken(line) for line in text.strip().splitlines()]
    write_whole(page, "\n".join([f"{before}{begin}", *lines, "", f"{end}{after}"]))


def _broken(line: str) -> str:
    return textwrap.fill(line, _COLUMNS, break_long_words=False, break_on_hyphens=False)
