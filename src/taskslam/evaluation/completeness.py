"""Completeness: which waypoints were reached every time (eq. (3) of the paper; protocol D0.6, 5.3).

How sure is it? Completeness counts waypoints that were reached in all M rounds, so one failure can take many of them
away, and a resample of rounds either holds that failure or does not: a bootstrap has nothing to say. What was sampled
are the legs: drives from one goal to the next. From f failures in n legs follows an interval for the chance h that a
leg fails, and from h the completeness that the protocol leads to, as if all legs were equally hard.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.special import betaincinv

LEVEL = 0.95


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


def failure_chance(failures: float, legs: float, level: float = LEVEL) -> tuple[float, float]:
    """Interval for the chance that one leg fails: Jeffreys', with 0 or 1 as its end where all legs ended alike.

    Brown, Cai, DasGupta: Interval Estimation for a Binomial Proportion, Statistical Science 16 (2001). Without a leg
    nothing is known: (0, 1). Of legs that hang together there may be fewer than were driven, and no whole number.
    """
    if not 0 <= failures <= legs:
        raise ValueError(f"{failures:g} failures in {legs:g} legs; expected at most one each")
    if legs == 0:
        return 0.0, 1.0
    tail = (1 - level) / 2
    low = float(betaincinv(failures + 0.5, legs - failures + 0.5, tail)) if failures else 0.0
    high = float(betaincinv(failures + 0.5, legs - failures + 0.5, 1 - tail)) if failures < legs else 1.0
    return low, high


def expected_completeness(
    failure: float, waypoints: int, rounds: int, *, on_failure: str = "abort", with_map: bool = False
) -> float:
    """Completeness to expect of N waypoints in M rounds if every leg fails with this chance, independently.

    on_failure `abort`, without map: a failure ends its round, so waypoint i (from 1) needs i M legs to go well. With
    map it ends the run: a priming round, M - 1 rounds and i legs. `skip`: only the waypoint's own M legs.
    """
    index = np.arange(1, waypoints + 1)
    if on_failure == "skip":
        needed = np.full(waypoints, rounds)
    elif with_map:
        needed = rounds * waypoints + index
    else:
        needed = rounds * index
    return float(((1.0 - failure) ** needed).mean())
