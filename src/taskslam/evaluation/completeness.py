"""Completeness: which waypoints were reached every time (eq. (3) of the paper; protocol D0.6, 5.3)."""

from __future__ import annotations

from collections.abc import Iterable


def is_complete(visits: int, rounds: int) -> bool:
    """Whether a waypoint was reached in all M rounds; rounds is M as planned, not as driven (protocol 7.3 #17)."""
    return rounds > 0 and visits == rounds


def completeness(complete: Iterable[bool]) -> float:
    """Complete waypoints over planned waypoints, 0 to 1; over all sequences together when pooled. Eq. (3).

    complete: one flag for every planned waypoint, those never visited included. Raises ValueError for none at all.
    """
    flags = list(complete)
    if not flags:
        raise ValueError("completeness is not defined for a sequence without waypoints")
    return sum(flags) / len(flags)
