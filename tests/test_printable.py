"""Text from outside is shown without what it could do to a screen, a page or its reader."""

import time
import xml.etree.ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.printable import in_markdown, one_line, printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("naïve 机器人 🤖 Δ °", "naïve 机器人 🤖 Δ °"),
        ("a\tb\nc", "a\tb\nc"),
        ("\x1b[31mred\x1b[0m", "red"),
        ("\x1b[38;2;1;2;3mrgb", "rgb"),
        ("\x9b31mred", "red"),
        ("\x1b]0;owned\x07title", "title"),
        ("\x1b]8;;http://evil\x1b\\link\x1b]8;;\x1b\\", "link"),
        ("\x9d0;owned\x9ctitle", "title"),
        ("\x1bPq#0\x1b\\sixel", "sixel"),
        ("\x1bc reset", " reset"),
        ("\x1b(B set", " set"),
        ("end\x1b", "end"),
        ("\x1b]0;never ended", "0;never ended"),
        ("50 %\r100 %\r\n", "50 %\n100 %\n"),
        ("a\x00b\x08c\x7fd\x85e", "abcde"),
        ("\u202egnp.exe\u2066\u200f", "gnp.exe"),
        ("\ud800 \udcff", "\ufffd \ufffd"),
        ("\ufffe\uffff", ""),
    ],
)
def test_what_acts_on_a_terminal_is_left_out_and_the_rest_stays(text, shown):
    assert printable(text) == shown


@given(st.text(st.characters(codec=None, exclude_categories=())))
def test_any_text_becomes_text_that_utf_8_and_xml_can_hold(text):
    shown = printable(text)
    assert not any(letter < " " and letter not in "\t\n" for letter in shown)
    assert printable(shown) == shown
    element = ET.Element("a", text=shown)
    element.text = shown
    ET.fromstring(ET.tostring(element).decode("utf-8"))


def test_a_length_is_kept_to_and_the_cut_is_seen():
    assert printable("abcdef", 4) == "abc…"
    assert printable("abcd", 4) == "abcd"
    assert one_line(" a \n\n b\x1b[2J c ", 5) == "a b c"


@pytest.mark.parametrize("part", ["\x1b]", "\x90", "\x1b[", "\x9d", "\x1bP\x1b"])
def test_a_million_openings_without_an_end_take_no_time(part):
    begin = time.perf_counter()
    printable(part * 500_000 + "\x1b")
    assert time.perf_counter() - begin < 3


def test_markdown_begins_nothing_in_foreign_text():
    assert in_markdown("a|b <img> [x](y) `c` \\|\n# d") == "a\\|b &lt;img> \\[x](y) \\`c\\` \\\\\\| # d"
