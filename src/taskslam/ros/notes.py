"""What is to be said of a node goes into its method's log, a line each that can be told from what the node prints."""

from __future__ import annotations

import sys

FINDING = "[ros] "


def note(words: str) -> None:
    """Into the log."""
    sys.stdout.write(f"{FINDING}{words}\n")
    sys.stdout.flush()
