"""What the published evaluation code computes differently, each deviation under a name (protocol 5.9).

Given to an evaluation, a deviation reproduces the published number; without any, the paper's definitions hold.
Of the protocol's list, h and i concern open-loop trajectories (`trajectory_precision.py`); g, k and l are crashes and
no numbers; j concerns quantities that no published figure shows.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from enum import StrEnum
from typing import TypeAlias

from taskslam.errors import InputError, did_you_mean


class Deviation(StrEnum):
    """One way in which the published code leaves the paper; the value is its name on the command line."""

    UNNORMALISED_HEADING = "unnormalised-heading"
    """a) Delta against a mean direction that is not normalised: about 1.62 times too large at five visits."""

    UNCLIPPED_ARCCOS = "unclipped-arccos"
    """b) Angles by arccos of a cosine that is not clipped: one that rounds above 1 is NaN and leaves the mean."""

    PRIMING_ROUND = "priming-round"
    """c) With map, simulation: rounds 0 to M - 1 count, so the priming round is in and the last one out."""

    DOUBLE_SKIP = "double-skip"
    """d) With map, real robot: the first round is taken out twice, so M - 1 rounds count. c) goes before it."""

    VISITING_ORDER = "visiting-order"
    """e) The n-th arrival of a round is taken for goal n, also after a goal that was skipped."""

    MISSING_SEQUENCE = "missing-sequence"
    """f) A sequence without a result leaves the denominators of the pooled numbers."""


Deviations: TypeAlias = Collection[Deviation]

NONE: Deviations = frozenset()
ALL: Deviations = frozenset(Deviation)


def parse_deviations(names: str) -> Deviations:
    """`all`, or names separated by commas. Raises InputError for a name that is not one."""
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    if wanted == ["all"]:
        return ALL
    known = [deviation.value for deviation in Deviation]
    for name in wanted:
        if name not in known:
            raise InputError(
                f"--deviations {name}: unknown; expected all, or some of {', '.join(known)}.{did_you_mean(name, known)}"
            )
    if not wanted:
        raise InputError(f"--deviations: no name given; expected all, or some of {', '.join(known)}")
    return frozenset(map(Deviation, wanted))


def names_of(deviations: Iterable[Deviation]) -> tuple[str, ...]:
    """Their names, in the order of the list."""
    chosen = set(deviations)
    return tuple(deviation.value for deviation in Deviation if deviation in chosen)
