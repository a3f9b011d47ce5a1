"""What is asked of the robot, whatever drives it: waypoints and their order, rounds and rules, units, and the mode.

The words are the paper's: waypoint, sequence, round, task-driven units (D, FoV).
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from taskslam.field_types import Positive
from taskslam.geometry import SE2
from taskslam.mode import Mode as Mode

BUILTIN_PLANNER = "teb"
"""The local planner of a scenario that names none, and of all runs before there was a choice."""

Finite = Annotated[float, Field(allow_inf_nan=False)]
Coordinate = Annotated[float, Field(ge=-1e7, le=1e7)]  # m, as far as a national grid reaches; rad

MOST_ROUNDS, MOST_GOALS = 1000, 10_000
MOST_ARRIVALS = 1_000_000  # rounds times goals


class Part(BaseModel):
    """A part of what people describe: frozen, and no key but its own."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Waypoint(Part):
    """A pose in `map`: metres and radians; theta may lie outside (-pi, pi], as in the published tables.

    It may be written `yaw`, as ROS tools do.
    """

    x: Coordinate
    y: Coordinate
    theta: Coordinate

    @model_validator(mode="before")
    @classmethod
    def _yaw_as_theta(cls, raw: object) -> object:
        if isinstance(raw, dict) and "yaw" in raw and "theta" not in raw:
            return {"theta" if key == "yaw" else key: value for key, value in raw.items()}
        return raw

    @property
    def pose(self) -> SE2:
        """As a pose."""
        return SE2(self.x, self.y, self.theta)


class Sequence(Part):
    """Waypoints and the order of the visit.

    The first entry of `path` is the start and not a goal (protocol 1.1); without a path every waypoint is a goal, in
    the order of the table. Instead of the two tables, the published files `waypoints.txt` and `path*.txt` may be named.
    """

    waypoints: Annotated[tuple[Waypoint, ...], Field(max_length=MOST_GOALS)] = ()
    path: Annotated[tuple[int, ...], Field(max_length=MOST_GOALS + 1)] | None = None
    waypoints_file: str | None = None
    path_file: str | None = None

    @model_validator(mode="before")
    @classmethod
    def _rows_as_lists(cls, raw: object) -> object:
        """Let a waypoint be written `[x, y, theta]`, as a table row."""
        if isinstance(raw, dict) and isinstance(raw.get("waypoints"), list):
            rows = [
                dict(zip(("x", "y", "theta"), row, strict=True)) if isinstance(row, list) and len(row) == 3 else row
                for row in raw["waypoints"]
            ]
            return {**raw, "waypoints": rows}
        return raw

    @model_validator(mode="after")
    def _path_within_the_table(self) -> Sequence:
        for place, row in enumerate(self.path or ()):
            if not 0 <= row < len(self.waypoints):
                raise ValueError(
                    f"path[{place}] is {row}, but the waypoint table has rows 0 to {len(self.waypoints) - 1}"
                )
        return self

    @property
    def goals(self) -> tuple[Waypoint, ...]:
        """The goals in visiting order; a goal's index in results is its place here."""
        if self.path is None:
            return self.waypoints
        return tuple(self.waypoints[row] for row in self.path[1:])


class TaskUnits(Part):
    """The paper's task-driven units: robot diameter D (m) and horizontal field of view FoV (degrees)."""

    robot_diameter: Positive = 0.30
    field_of_view: Positive = 80.0


class OnFailure(StrEnum):
    """What a failed goal does: end the round (the paper), or be skipped."""

    ABORT = "abort"
    SKIP = "skip"


class Protocol(Part):
    """Rounds, pause and failure rule (paper, Sec. III; protocol 1.7). pause: s at each waypoint before the record."""

    rounds: Annotated[int, Field(ge=1, le=MOST_ROUNDS)] = 5
    pause: Annotated[float, Field(ge=0, le=600)] = 5.0
    on_failure: OnFailure = OnFailure.ABORT
    goal_timeout: Positive | None = None
    still_start: Annotated[float, Field(ge=0, le=60)] = 1.0


class GoalTolerance(Part):
    """Within which navigation calls a goal reached: the published values (protocol 3.1, D0.9)."""

    position_m: Positive = 0.20
    heading_rad: Positive = 0.25


class Task(BaseModel):
    """What every robot can be asked, in any world: what the record and the evaluation need to know of a scenario.

    Of a scenario's other keys it knows nothing and passes them over. start, sequence: None in a replay, which is driven
    to no goals, and start where it is not known.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    title: str = ""
    start: Waypoint | None = None
    sequence: Sequence | None = None
    units: TaskUnits = TaskUnits()
    protocol: Protocol = Protocol()

    @property
    def goals(self) -> tuple[SE2, ...]:
        """Every goal in visiting order, in `map`."""
        return () if self.sequence is None else tuple(waypoint.pose for waypoint in self.sequence.goals)
