"""A command rewrites its part of a page and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from taskslam.errors import RecordError
from taskslam.report.tables.marked_part import replace_marked

PAGE = "# Mine\n\nBefore.\n\n<!-- tables of paper -->\nold\n<!-- end of tables of paper -->\n\nAfter.\n"


def test_what_is_between_the_marks_is_replaced_and_again_gives_the_same(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    replace_marked(page, "paper", "| new |\n")
    once = page.read_text()
    assert once == PAGE.replace("old\n", "\n| new |\n\n")
    replace_marked(page, "paper", "| new |\n")
    assert page.read_text() == once


SWAPPED = "<!-- end of tables of paper -->\n<!-- tables of paper -->\n"


@pytest.mark.parametrize(
    "text", ["", PAGE + PAGE, PAGE.replace("end of ", ""), SWAPPED, PAGE.replace("paper", "other")]
)
def test_a_page_without_its_marks_is_left_as_it_is(tmp_path: Path, text: str) -> None:
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(RecordError, match="expected one line '<!-- tables of paper -->'"):
        replace_marked(page, "paper", "new")
    assert page.read_text() == text
