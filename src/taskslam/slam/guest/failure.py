"""How a method's failure travels: one exception with the outcome that goes into the results (design D6)."""

from __future__ import annotations

from taskslam.errors import TaskSlamError
from taskslam.outcomes import Outcome


class MethodFailedError(TaskSlamError):
    """A SLAM method crashed, hung or said something that is not a pose.

    outcome: `CRASHED`, `STALLED` or `INVALID_OUTPUT`. detail: one sentence that says what happened.
    """

    exit_status = 1

    def __init__(self, outcome: Outcome, detail: str) -> None:
        super().__init__(detail)
        self.outcome = outcome
        self.detail = detail
