"""Names that fit into figures and tables."""

from __future__ import annotations

from collections.abc import Sequence

from taskslam.printable import one_line


def short_names(names: Sequence[str], most: int) -> list[str]:
    """Each name within `most` letters, its middle left out where it is longer; names that differ stay different."""
    short: list[str] = []
    for name in map(one_line, names):
        text = name if len(name) <= most else f"{name[: most - most // 3 - 1]}…{name[-(most // 3) :]}"
        number = 2
        while text in short:
            tail = f"…{number}"
            text = name[: most - len(tail)] + tail
            number += 1
        short.append(text)
    return short
