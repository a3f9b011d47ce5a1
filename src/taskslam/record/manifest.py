"""`Manifest`: what was run, with what, and on what. The one file of a run that may hold wall-clock values."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from taskslam.outcomes import Outcome

RUN_FORMAT: Literal["taskslam-run/1"] = "taskslam-run/1"


class Units(BaseModel):
    """What the task measures itself by: robot diameter D and camera field of view (protocol 5.5)."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    diameter_m: float = Field(default=0.30, gt=0)
    field_of_view_deg: float = Field(default=80.0, gt=0)


class GoalTolerance(BaseModel):
    """Within which navigation calls a goal reached (protocol D0.9)."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    position_m: float = Field(default=0.20, gt=0)
    heading_rad: float = Field(default=0.25, gt=0)


class Manifest(BaseModel):
    """The content of run.json.

    scenario_name: short name; scenario: the whole configuration as used, and scenario_hash its content hash; goals:
    every goal of the sequence in order, x, y in metres and theta in radians, frame `map`; rounds: those that count
    (M), without the priming round; latency: fixed, measured or zero (design D3); outcome: `reached` if the run was
    driven to its end, else what ended it, and failure says it in a sentence; simulated_s: simulated time of the whole
    run, wall_s: what that took on this machine.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["taskslam-run/1"] = RUN_FORMAT
    scenario_name: str
    scenario: dict[str, Any]
    scenario_hash: str
    goals: tuple[tuple[float, float, float], ...] = Field(min_length=1)
    method: str
    method_card: dict[str, Any]
    method_options: dict[str, Any] = Field(default_factory=dict)
    mode: Literal["without-map", "with-map"]
    seed: int
    rounds: int = Field(ge=1)
    latency: str
    units: Units = Units()
    goal_tolerance: GoalTolerance = GoalTolerance()
    versions: dict[str, str] = Field(default_factory=dict)
    machine: dict[str, Any] = Field(default_factory=dict)
    started_utc: str
    wall_s: float = Field(ge=0)
    simulated_s: float = Field(ge=0)
    outcome: Outcome = Outcome.REACHED
    failure: str | None = None
