"""How one goal, or one round, ended: reached, or the name of the failure (design D6)."""

from __future__ import annotations

from enum import StrEnum


class Outcome(StrEnum):
    """`reached`, or why not. Only infrastructure failures are never counted against a method."""

    REACHED = "reached"
    NO_PLAN = "no_plan"
    NO_CONTROL = "no_control"
    OSCILLATION = "oscillation"
    BUMPED = "bumped"
    GOAL_TIMEOUT = "goal_timeout"
    CRASHED = "crashed"
    STALLED = "stalled"
    LOST = "lost"
    INVALID_OUTPUT = "invalid_output"
    HOST_FAILED = "host_failed"
    SIMULATOR_FAILED = "simulator_failed"
    DISK_FULL = "disk_full"
    UNRECORDED = "unrecorded"
    NOT_SEEN = "not_seen"

    @property
    def blames(self) -> str:
        """`nobody`, `navigation`, `method` or `infrastructure`."""
        return _BLAMES[self]


_BLAMES = {
    Outcome.REACHED: "nobody",
    Outcome.NO_PLAN: "navigation",
    Outcome.NO_CONTROL: "navigation",
    Outcome.OSCILLATION: "navigation",
    Outcome.BUMPED: "navigation",
    Outcome.GOAL_TIMEOUT: "navigation",
    Outcome.CRASHED: "method",
    Outcome.STALLED: "method",
    Outcome.LOST: "method",
    Outcome.INVALID_OUTPUT: "method",
    Outcome.HOST_FAILED: "infrastructure",
    Outcome.SIMULATOR_FAILED: "infrastructure",
    Outcome.DISK_FULL: "infrastructure",
    Outcome.NOT_SEEN: "method",  # it said that it had arrived, and no tag shows it there
    Outcome.UNRECORDED: "nobody",  # imported results that do not say why
}
