"""Text from outside as it may be shown: nothing in it moves a cursor, starts a tag or turns the reading direction.

What a method says when it dies, a name in a file, a journal: whoever shows such text passes it through here.
"""

from __future__ import annotations

import re

# ECMA-48: CSI with parameters and a final byte; OSC, DCS, SOS, PM and APC up to their terminator; other escapes.
_SEQUENCE = re.compile(
    "(?:\x1b\\[|\x9b)[0-?]*[ -/]*[@-~]"
    "|(?:\x1b[]PX^_]|[\x90\x98\x9d-\x9f])[^\x07\x1b\x90\x98\x9c-\x9f]*(?:\x07|\x1b\\\\|\x9c)"
    "|\x1b[ -/]*[0-~]?"
)
# C0 and C1 but tab and line end, delete, directions (UAX 9), line and paragraph separators, what XML 1.0 forbids.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")
_SURROGATE = re.compile("[\ud800-\udfff]")


def printable(text: str, longest: int | None = None) -> str:
    """Text without escape sequences, control characters, turns of direction and lone surrogates.

    Tabs and line ends stay. A lone surrogate becomes the replacement character; a bare carriage return a line end.
    longest: letters that are kept, with an ellipsis where there were more.
    """
    text = _SEQUENCE.sub("", text).replace("\r\n", "\n").replace("\r", "\n")
    text = _SURROGATE.sub("\ufffd", _CONTROL.sub("", text))
    return text if longest is None or len(text) <= longest else f"{text[: max(longest - 1, 0)]}…"


def one_line(text: str, longest: int | None = None) -> str:
    """The same in one line, with single blanks."""
    return printable(" ".join(printable(text).split()), longest)


def in_markdown(text: str, longest: int | None = None) -> str:
    """The same in one line in which Markdown begins no cell of a table, no tag, no link and no code."""
    return re.sub(r"([\\|\[`])", r"\\\1", one_line(text, longest)).replace("<", "&lt;")
