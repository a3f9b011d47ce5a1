"""Who may watch a run: progress on a terminal, or nobody. Watching never changes a result."""

from __future__ import annotations


class Observer:
    """The null observer: hears everything, does nothing. Progress displays override what they show."""

    def stage(self, text: str) -> None:
        """A step of the preparation begins: loading, slicing, starting the method."""

    def round_begins(self, number: int, total: int, priming: bool) -> None:
        """A round begins."""

    def heading_for(self, goal: int, goals: int) -> None:
        """The robot sets off to a goal."""

    def ticked(self, now: int) -> None:
        """Simulated time reached `now` ns."""

    def notice(self, text: str) -> None:
        """Something worth a line: a failed goal, a method's jump, a retry."""
