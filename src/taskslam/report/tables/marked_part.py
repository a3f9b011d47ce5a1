"""The part of a written page that a command makes: between two marks, so that all else on it stays a person's."""

from __future__ import annotations

from pathlib import Path

from taskslam.errors import RecordError
from taskslam.files import write_whole
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text


def replace_marked(page: Path, name: str, text: str) -> None:
    """Put `text` between `<!-- tables of NAME -->` and `<!-- end of tables of NAME -->`; what was there goes.

    Raises RecordError: the page cannot be read, or has not each mark once, in this order; DiskFullError.
    """
    begin, end = f"<!-- tables of {name} -->\n", f"<!-- end of tables of {name} -->"
    content = read_text(page, "page", RecordError, LARGEST_WRITTEN_BY_HAND)
    before, began, rest = content.partition(begin)
    _, ended, after = rest.partition(end)
    if not began or not ended or content.count(begin) > 1 or content.count(end) > 1:
        raise RecordError(f"{page}: expected one line '{begin.strip()}' and one line '{end}' behind it")
    write_whole(page, f"{before}{begin}\n{text.strip()}\n\n{end}{after}")
