"""`Manifest`: what was run, with what, and on what. The one file of a run that may hold wall-clock values."""

from __future__ import annotations

from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.task import BUILTIN_PLANNER, MOST_ARRIVALS, MOST_ROUNDS, GoalTolerance, Task
from taskslam.user_files import complaint

MANIFEST_FILE = "run.json"
RUN_FORMAT: Literal["taskslam-run/1"] = "taskslam-run/1"


Seconds = Annotated[float, Field(ge=0, le=1e12)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class DrivenBy(StrEnum):
    """What a record's measurements came from."""

    SIMULATOR = "simulator"
    RECORDING = "recording"
    ROBOT = "robot"
    UNKNOWN = "unknown"


class Manifest(_Part):
    """The content of run.json.

    source: where the record comes from: driven in the loop of our `simulation`, an open-loop `replay` of a dataset
    (which has no goals), `measured` on a robot with tags and cameras, or an `import` of somebody else's results;
    driven_by: what the measurements came from;
    scenario: the whole configuration as used, robot: the robot's description, where it is known, and scenario_hash the
    content hash of both, world included; spec_hash: of all that could change the result, and behaviour: the version of
    this package's code as far as results go (None of runs that were not driven here, or before there was one);
    rounds: those that count (M), without the priming round; latency: fixed, measured or zero (design D3); complete:
    every goal of every round was reached; failure: in a sentence, what ended the run early; simulated_s: simulated time
    of the whole run, wall_s: what that took on this machine, compute_s: the method's own share of it;
    sealed: whether its noise could not be guessed, salt: with which it is repeated; stop_failures: how the method
    failed when it was stopped after its work; method_cpu_s: processor time of all its processes, of all its starts;
    method_peak_bytes: most memory resident in the method's processes, of all its starts; own_peak_bytes: in the
    benchmark's, since that began.
    truth_frame: `map`, or `waypoint` if true poses are in a frame of each waypoint's own, whose place in `map` is not
    known: then arrivals compare with one another, but not with the goal or with an estimate. unjudged: goals that leave
    all denominators, with the reason, such as those that no camera watched. files: SHA-256 of journal and trajectories
    by their paths in the run directory; empty in older records.
    """

    format: Literal["taskslam-run/1"] = RUN_FORMAT
    source: Literal["simulation", "replay", "measured", "import"] = "simulation"
    driven_by: DrivenBy = DrivenBy.UNKNOWN
    scenario_name: str
    scenario: dict[str, Any]
    scenario_hash: str
    spec_hash: str | None = None
    behaviour: int | None = None
    robot: dict[str, Any] | None = None
    method: str
    method_card: dict[str, Any]
    method_options: dict[str, Any] = Field(default_factory=dict)
    mode: Mode
    seed: int
    sealed: bool = False
    salt: str | None = Field(default=None, max_length=64)
    rounds: int = Field(ge=1, le=MOST_ROUNDS)
    latency: str
    goal_tolerance: GoalTolerance = GoalTolerance()
    versions: dict[str, str] = Field(default_factory=dict)
    machine: dict[str, Any] = Field(default_factory=dict)
    started_utc: str
    wall_s: Seconds
    simulated_s: Seconds
    compute_s: Seconds = 0.0
    method_peak_bytes: int | None = Field(default=None, ge=0)
    method_cpu_s: Seconds | None = None
    stop_failures: tuple[str, ...] = ()
    own_peak_bytes: int | None = Field(default=None, ge=0)
    complete: bool
    failure: str | None = None
    truth_frame: Literal["map", "waypoint"] = "map"
    unjudged: dict[int, str] = Field(default_factory=dict)
    files: dict[str, str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _scenario_holds_a_sequence(self) -> Manifest:
        if self.task.sequence is None:
            if self.source == "replay":
                return self
            raise ValueError("scenario.sequence: Field required")
        if not self.goals:
            raise ValueError("scenario.sequence holds no goal")
        if self.rounds * len(self.goals) > MOST_ARRIVALS:
            raise ValueError(f"{self.rounds} rounds of {len(self.goals)} goals are more than {MOST_ARRIVALS} arrivals")
        for goal in self.unjudged:
            if not 0 <= goal < len(self.goals):
                raise ValueError(f"unjudged names goal {goal} of {len(self.goals)}")
        return self

    @cached_property
    def task(self) -> Task:
        """What was asked of the robot, as far as the scenario says it."""
        try:
            return Task.model_validate(self.scenario)
        except ValidationError as error:
            raise ValueError(f"scenario.{complaint(error, Task)}") from None

    @cached_property
    def goals(self) -> tuple[SE2, ...]:
        """Every goal of the sequence in visiting order, in `map`; none in a replay, which is not driven to goals."""
        return self.task.goals

    @property
    def start(self) -> SE2 | None:
        """Where the robot starts, in `map`."""
        return None if self.task.start is None else self.task.start.pose

    @property
    def planner(self) -> str | None:
        """The local planner that drove; None where it is not known, as of a robot that was only measured."""
        return self.scenario.get("planner", BUILTIN_PLANNER if self.source == "simulation" else None)

    @property
    def robot_name(self) -> str | None:
        """The preset's or file's name of the robot, without folder and suffix; None where it is not known."""
        robot = self.scenario.get("robot")
        return Path(robot).stem if isinstance(robot, str) else None

    @property
    def is_reference(self) -> bool:
        """Whether the method is told the truth: it shows what navigation alone does, and competes with nobody."""
        return self.method_card.get("kind") == "reference"

    @property
    def title(self) -> str:
        """The scenario's title, or its name."""
        return self.task.title or self.scenario_name

    @property
    def robot_diameter(self) -> float:
        """D in metres, the paper's unit of position (protocol 5.5)."""
        return self.task.units.robot_diameter

    @property
    def field_of_view(self) -> float:
        """FoV in degrees, the paper's unit of orientation (protocol 5.5)."""
        return self.task.units.field_of_view
