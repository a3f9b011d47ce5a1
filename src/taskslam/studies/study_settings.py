"""How a study is evaluated, in the words of the command line, of `settings:` in a study file, and of Python."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from taskslam.errors import did_you_mean
from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.evaluation.trajectory_association import DEFAULT_MAX_DIFFERENCE_NS, FRAME_TOLERANCE_NS
from taskslam.evaluation.trajectory_pairs import DeltaUnit
from taskslam.evaluation.trajectory_preparation import Plane, Preparation
from taskslam.geometry import pose_from_xyz_rpy
from taskslam.measurements import NANOSECONDS
from taskslam.record.number_table import StampUnit

_UNITS: dict[str, StampUnit] = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
_LARGEST_OFFSET_S = 4e9  # from 1970 to today, for stamps that count from a start


def _one_of(*names: str) -> BeforeValidator:
    def chosen(value: object) -> object:
        if value is not None and value not in names:
            raise ValueError(f"expected one of {', '.join(names)}.{did_you_mean(str(value), names)}")
        return value

    return BeforeValidator(chosen)


def _offset(value: object) -> object:
    if value == "auto":
        return value
    try:
        seconds = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        seconds = math.nan
    if isinstance(value, bool) or not abs(seconds) < _LARGEST_OFFSET_S:
        raise ValueError("expected seconds, or auto")
    return seconds


def _seconds(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 3600:
        raise ValueError("expected seconds, from 0 to 3600")
    return value


def _length(value: object) -> object:
    delta_of(str(value))
    return value


def _lengths(value: object) -> object:
    return [value] if isinstance(value, str) else value


def _six_numbers(value: object) -> object:
    try:
        numbers = [float(part) for part in (value.split(",") if isinstance(value, str) else value)]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        numbers = []
    if value is not None and (len(numbers) != 6 or not all(map(math.isfinite, numbers))):
        raise ValueError("expected x,y,z,roll,pitch,yaw in metres and radians")
    return None if value is None else numbers


def delta_of(text: str) -> tuple[float, DeltaUnit]:
    """A length of relative errors: `1m`, `5s`, `30deg`, `20frames`. Raises ValueError."""
    number = text.rstrip("abcdefghijklmnopqrstuvwxyz ")
    try:
        return float(number), DeltaUnit(text[len(number) :].strip())
    except ValueError:
        raise ValueError("expected a number and a unit, such as 1m, 5s, 30deg or 20frames") from None


def _names(kind: type[StrEnum]) -> BeforeValidator:
    return _one_of(*kind)


Seconds = Annotated[float, BeforeValidator(_seconds)]
Length = Annotated[str, BeforeValidator(_length)]
Six = tuple[float, float, float, float, float, float]


class Settings(BaseModel):
    """How a study is evaluated.

    align: of methods that say nothing; n_to_align: poses from the start that determine it, None for all;
    max_difference: between a pose and its ground truth (s); frame_tolerance: between stamps of two runs that mean the
    same frame (s); rpe: over what, each in turn; time_unit: of stamps in text files, None to tell it from them;
    time_offset: added to the stamps of every run (s), or `auto` to find each run's own; t_start, t_end: of the ground
    truth that counts (s); downsample: poses that are kept; plane: into which both are projected; body_sensor: x, y, z,
    roll, pitch, yaw (m, rad) of the runs' sensor on the ground truth's body.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    align: Annotated[Alignment, _names(Alignment)] = Alignment.SE3
    n_to_align: int | None = Field(default=None, ge=1)
    max_difference: Seconds = DEFAULT_MAX_DIFFERENCE_NS / NANOSECONDS
    frame_tolerance: Seconds = FRAME_TOLERANCE_NS / NANOSECONDS
    rpe: Annotated[tuple[Length, ...], BeforeValidator(_lengths)] = ()
    time_unit: Annotated[Literal["s", "ms", "us", "ns"] | None, _one_of(*_UNITS)] = None
    time_offset: Annotated[float | Literal["auto"], BeforeValidator(_offset)] = 0.0
    t_start: float | None = None
    t_end: float | None = None
    downsample: int | None = Field(default=None, ge=1)
    plane: Annotated[Plane | None, _names(Plane)] = None
    body_sensor: Annotated[Six | None, BeforeValidator(_six_numbers)] = None
    upstream_compat: bool = False

    @property
    def max_difference_ns(self) -> int:
        """As stamps have it."""
        return round(self.max_difference * NANOSECONDS)

    @property
    def frame_tolerance_ns(self) -> int:
        """As stamps have it."""
        return round(self.frame_tolerance * NANOSECONDS)

    @property
    def deltas(self) -> list[tuple[float, DeltaUnit]]:
        """The lengths of relative errors, each once."""
        return list(dict.fromkeys(delta_of(text) for text in self.rpe))

    @property
    def stamp_unit(self) -> StampUnit | None:
        """As the readers have it."""
        return None if self.time_unit is None else _UNITS[self.time_unit]

    @property
    def preparation(self) -> Preparation:
        """What is done to trajectories besides."""
        six = self.body_sensor
        T_body_sensor = None if six is None else pose_from_xyz_rpy(six[:3], six[3:])
        return Preparation(self.t_start, self.t_end, self.downsample, T_body_sensor, self.plane)

    def written(self) -> dict[str, Any]:
        """What was said, as a study file has it."""
        return self.model_dump(mode="json", exclude_unset=True, exclude_none=True)
