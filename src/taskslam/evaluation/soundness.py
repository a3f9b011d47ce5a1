"""Whether the journal of a run can belong to its manifest, and says anything about the method."""

from __future__ import annotations

from taskslam.errors import RecordError
from taskslam.record import Arrival, GoalFailed, RoundEnded, RunRecord

FARTHEST = 1e7
"""Metres. What lies farther away than the pole from the equator is no place, and its square is soon no number."""


def check_record(record: RunRecord) -> None:
    """Raise RecordError where the journal cannot belong to this manifest."""
    manifest, where, goals = record.manifest, record.directory, len(record.manifest.goals)
    if manifest.source == "replay":
        raise RecordError(
            f"{where}: an open-loop replay has no goals: `taskslam evaluate-trajectories` judges it per frame"
        )
    numbers = [start.round for start in record.rounds()]
    if len(set(numbers)) != len(numbers):
        raise RecordError(f"{where}: the journal starts a round twice; expected every round number once")
    planned = sum(not start.priming for start in record.rounds())
    if planned > manifest.rounds:
        raise RecordError(f"{where}: the journal has {planned} rounds, run.json says {manifest.rounds}")
    seen = set()
    for event in record.events:
        if isinstance(event, Arrival | GoalFailed):
            if event.goal >= goals:
                raise RecordError(f"{where}: goal {event.goal} in the journal; the sequence has {goals}")
            if event.round not in numbers:
                raise RecordError(f"{where}: goal {event.goal} ended in round {event.round}, which never began")
        if isinstance(event, Arrival):
            for pose in (event.target, event.truth, event.estimate):
                if pose is not None and max(abs(pose.x), abs(pose.y)) > FARTHEST:
                    raise RecordError(
                        f"{where}: goal {event.goal} in round {event.round}: a pose at ({pose.x:g}, {pose.y:g}) m; "
                        f"expected one within {FARTHEST:g} m"
                    )
            if (event.round, event.goal) in seen:
                raise RecordError(f"{where}: two arrivals at goal {event.goal} in round {event.round}; expected one")
            seen.add((event.round, event.goal))
        if isinstance(event, GoalFailed | RoundEnded) and event.outcome.blames == "infrastructure":
            raise RecordError(f"{where}: ended by {event.outcome}, which says nothing about the method: run it again")
