"""Failures as the page shows them: what happened, where, and what led to it."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from taskslam.evaluation import RunMetrics
from taskslam.evaluation.metrics_file import Failure
from taskslam.measurements import NANOSECONDS
from taskslam.record import GoalFailed, RunRecord
from taskslam.report.page.failure_story import Step, failure_story
from taskslam.report.page.last_seconds_figure import last_seconds_figure
from taskslam.report.page.story_figure import story_figure
from taskslam.report.tracks import Tracks
from taskslam.world import FloorPlan

_LEAD_S = 10.0  # so long before a failure its replay begins


@dataclass(frozen=True)
class FailureView:
    """One failed goal with its story. off_m: from where SLAM put the robot to where it was; None where unknown.

    place: the map around it; last_seconds: speed and error. replay_round: index of its round among those that began;
    replay_at_s: seconds from the round's beginning, a little before the failure.
    """

    failure: Failure
    off_m: float | None
    steps: tuple[Step, ...]
    place: Markup | None
    last_seconds: Markup | None
    replay_round: int
    replay_at_s: float


def failure_views(
    record: RunRecord, metrics: RunMetrics, plan: FloorPlan | None, tracks: Tracks
) -> tuple[FailureView, ...]:
    """All failures of a run, in the order of the journal."""
    manifest = record.manifest
    tolerance = manifest.goal_tolerance.position_m
    events = [event for event in record.events if isinstance(event, GoalFailed)]
    began = {start.round: (index, start.t) for index, start in enumerate(record.rounds())}
    views = []
    for failure, event in zip(metrics.failures, events, strict=True):
        story = failure_story(event, record.events, tracks, tolerance)
        index, since = began.get(event.round, (0, 0))
        views.append(
            FailureView(
                failure=failure,
                off_m=event.truth.distance_to(event.estimate) if event.truth and event.estimate else None,
                steps=story.steps,
                place=story_figure(plan, event, story, manifest.robot_diameter),
                last_seconds=last_seconds_figure(story, tolerance),
                replay_round=index,
                replay_at_s=max((event.t - since) / NANOSECONDS - _LEAD_S, 0.0),
            )
        )
    return tuple(views)
