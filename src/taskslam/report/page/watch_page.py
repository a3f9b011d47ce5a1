"""The page of `taskslam watch`, and what it asks the program that serves it (`loopback.py`).

The page asks again and again, so little is said each time: the list of the runs when it has changed, otherwise a letter
for each; all about one run, the one that a person has chosen or that is being driven.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from markupsafe import Markup
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from taskslam.benchmark.campaign.state import State
from taskslam.benchmark.campaign.watching import Closer, Look, Seen, Watched
from taskslam.errors import RecordError
from taskslam.record.events import Arrival, GoalFailed
from taskslam.report import words
from taskslam.report.floor import floor_plan
from taskslam.report.page.plan_drawing import begin_plan, plan_pictures, plan_view
from taskslam.report.page.shell import render
from taskslam.report.watch_words import counts_in_words, happened, outlook_in_words, where_in_words
from taskslam.user_files import complaint

_MOST_TOLD = 40  # events of a run that the page lists
_LETTERS = {State.UNDER_WAY: "u", State.INTERRUPTED: "i", State.NOT_DRIVEN: "n", State.WAITING: "w"}


class _Question(BaseModel):
    """known: of the list of runs that the page has; run: number of the one that it shows, None for any under way."""

    model_config = ConfigDict(extra="forbid")

    known: str = Field(default="", max_length=64)
    run: int | None = Field(default=None, ge=0)


class WatchPage:
    """A folder that is watched, as a page."""

    def __init__(self, watched: Watched) -> None:
        self._watched = watched

    def page(self) -> str:
        """The page, which then asks for all that it shows."""
        return render(
            "watch.html", [], [], [], served_by="watch",
            title=self._watched.folder.name, folder=str(self._watched.folder),
        )  # fmt: skip

    @property
    def acts(self) -> Mapping[str, Callable[[bytes], Mapping[str, Any]]]:
        """What the page may ask for, by name."""
        return {"look": self.look, "plan": self.plan}

    def look(self, said: bytes) -> Mapping[str, Any]:
        """How far all is, and one run from close by. Raises RecordError if what is said is no question."""
        question = _question(said)
        look = self._watched.look()
        names = [[run.scenario, run.way, words.mode(run.mode), run.seed] for run in look.runs]
        known = hashlib.sha256(json.dumps(names).encode()).hexdigest()[:16]
        chosen = _chosen(look, question.run if question.known == known else None)
        return {
            "known": known,
            **({} if question.known == known else {"runs": names}),
            "states": "".join(_letter(run) for run in look.runs),
            "done": {str(n): round(run.done, 3) for n, run in enumerate(look.runs) if 0.0 < run.done < 1.0},
            "why": {str(n): run.detail for n, run in enumerate(look.runs) if run.detail},
            "counts": counts_in_words(look),
            "outlook": outlook_in_words(look),
            "chosen": chosen,
            "run": None if chosen is None else _told(self._watched.closer(look.runs[chosen])),
        }

    def plan(self, said: bytes) -> Mapping[str, Any]:
        """The drawing on which a run is shown. Raises RecordError if what is said is no question."""
        question, runs = _question(said), self._watched.look().runs
        if question.run is None or question.run >= len(runs):
            raise RecordError(f"the question: there is no run {question.run}")
        closer = self._watched.closer(runs[question.run])
        plan = floor_plan(closer.seen.files)
        places = [place.array()[:2] for place in ([] if closer.start is None else [closer.start])]
        places += [goal.array()[:2] for goal in closer.goals]
        if plan is None and not places:
            return {"drawing": None}
        view = plan_view(plan, [np.array(places)] if places else [])
        drawing = begin_plan(plan, view, "Floor plan with goals, robot and scan").markup()
        return {
            "drawing": (plan_pictures([plan]) if plan is not None else Markup()) + drawing,
            "whole": plan is not None,
            "view": {"left": view.left, "top": view.top, "scale": view.scale},
        }


def _question(said: bytes) -> _Question:
    try:
        return _Question.model_validate_json(said)
    except ValidationError as error:
        raise RecordError(f"the question: {complaint(error, _Question)}") from None


def _chosen(look: Look, run: int | None) -> int | None:
    """The run that is shown: that which is asked for, else the first under way, else the last that has ended."""
    if run is not None and run < len(look.runs):
        return run
    for state in (State.UNDER_WAY, State.INTERRUPTED):
        for number, seen in enumerate(look.runs):
            if seen.state is state:
                return number
    finished = [number for number, seen in enumerate(look.runs) if seen.state is State.FINISHED]
    return max(finished, key=lambda number: look.runs[number].written_ns, default=None)


def _letter(run: Seen) -> str:
    """c: complete, m: a goal was missed, others by their state."""
    if run.state is State.FINISHED:
        return "c" if run.complete else "m"
    return _LETTERS[run.state]


def _told(closer: Closer) -> dict[str, Any]:
    seen, newest = closer.seen, closer.newest
    return {
        "title": f"{seen.scenario} · {seen.way}",
        "setting": f"{words.mode(seen.mode)} · seed {seen.seed}",
        "where": where_in_words(closer),
        "goals": [[goal.x, goal.y, goal.theta] for goal in closer.goals],
        "start": None if closer.start is None else [closer.start.x, closer.start.y, closer.start.theta],
        "heading": closer.heading,
        "reached": _of_the_round(closer, Arrival),
        "failed": _of_the_round(closer, GoalFailed),
        "newest": None if newest is None else newest.model_dump(mode="json"),
        "happened": [asdict(told) for told in happened(closer)[:_MOST_TOLD]],
    }


def _of_the_round(closer: Closer, kind: type[Arrival | GoalFailed]) -> list[int]:
    """Goals that were reached, or not, in the round that is shown."""
    return [event.goal for event in closer.events if isinstance(event, kind) and event.round == closer.round]
