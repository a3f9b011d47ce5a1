"""`Scenario` and its parts. The words are the paper's: waypoint, sequence, round, task-driven units (D, FoV)."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from taskslam.geometry import SE2

BUILTIN_PLANNER = "teb"

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Waypoint(_Part):
    """A pose in `map`: metres and radians; theta may lie outside (-pi, pi], as in the published tables."""

    x: Finite
    y: Finite
    theta: Finite

    @property
    def pose(self) -> SE2:
        """As a pose."""
        return SE2(self.x, self.y, self.theta)


class Sequence(_Part):
    """Waypoints and the order of the visit.

    The first entry of `path` is the start and not a goal (protocol 1.1); without a path every waypoint is a goal, in
    the order of the table. Instead of the two tables, the published files `waypoints.txt` and `path*.txt` may be named.
    """

    waypoints: tuple[Waypoint, ...] = ()
    path: tuple[int, ...] | None = None
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

    @property
    def goals(self) -> tuple[Waypoint, ...]:
        """The goals in visiting order; a goal's index in results is its place here."""
        if self.path is None:
            return self.waypoints
        return tuple(self.waypoints[row] for row in self.path[1:])


class WorldSource(_Part):
    """Where the world comes from: a registered world by `name`, or a Gazebo `file` of the user's own copy.

    source: the public repository to clone. resource_paths: folders with models, relative to the world file.
    floor_height: z of the floor that the robot drives on, in the world file; the world is lowered by it.
    lidar_geometry: what LiDAR rays meet, visual meshes (Gazebo's GPU sensor) or collision meshes (its CPU sensor).
    """

    name: str | None = None
    file: str | None = None
    source: str = ""
    resource_paths: tuple[str, ...] = ()
    floor_height: Finite = 0.0
    lidar_geometry: Literal["visual", "collision"] = "visual"

    @model_validator(mode="after")
    def _one_of_two(self) -> WorldSource:
        if (self.name is None) == (self.file is None):
            raise ValueError("give either `name` (a registered world) or `file` (a Gazebo world)")
        return self


class FloorPlanSource(_Part):
    """A ROS map_server `map` (yaml), or a plan sliced from the world between two heights (m)."""

    map: str | None = None
    free_205: bool = False
    slice_low: Positive = 0.02
    slice_high: Positive = 0.45
    resolution: Positive = 0.05

    @model_validator(mode="after")
    def _ordered(self) -> FloorPlanSource:
        if self.slice_high <= self.slice_low:
            raise ValueError(f"slice_high {self.slice_high} must be above slice_low {self.slice_low}")
        return self


class TaskUnits(_Part):
    """The paper's task-driven units: robot diameter D (m) and horizontal field of view FoV (degrees)."""

    robot_diameter: Positive = 0.30
    field_of_view: Positive = 80.0


class OnFailure(StrEnum):
    """What a failed goal does: end the round (the paper), or be skipped."""

    ABORT = "abort"
    SKIP = "skip"


class Protocol(_Part):
    """Rounds, pause and failure rule (paper, Sec. III; protocol 1.7). pause: s at each waypoint before the record."""

    rounds: Annotated[int, Field(ge=1, le=1000)] = 5
    pause: Annotated[float, Field(ge=0, le=600)] = 5.0
    on_failure: OnFailure = OnFailure.ABORT
    goal_timeout: Positive | None = None
    still_start: Annotated[float, Field(ge=0, le=60)] = 1.0


class Scenario(_Part):
    """Everything that is held fixed while methods are compared. planner: the local one (`taskslam planners list`)."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")]
    title: str = ""
    world: WorldSource
    floor_plan: FloorPlanSource = FloorPlanSource()
    robot: str = "turtlebot2"
    planner: str = BUILTIN_PLANNER
    start: Waypoint
    sequence: Sequence
    units: TaskUnits = TaskUnits()
    protocol: Protocol = Protocol()
