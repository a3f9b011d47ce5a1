"""`DsolSettings`: every constant of `dsol` with its source, and the presets `paper` and `indoor`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import Fraction, NonNegative, Positive
from taskslam.slam.option_settings import read_options

Count = Annotated[int, Field(ge=1, le=100)]

_PRESETS: dict[str, dict[str, Any]] = {"paper": {}, "indoor": {"keyframe_ratio": 0.8}}


class DsolSettings(BaseModel):
    """Options of `dsol`. Metres, seconds, pixels of the finest level, grey levels of 0..255."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: Literal["paper", "indoor"] = "paper"

    # Settings of the benchmark's authors in Gazebo.
    cell: Annotated[int, Field(ge=8, le=200)] = 20
    keyframes: Annotated[int, Field(ge=2, le=20)] = 5
    levels: Annotated[int, Field(ge=2, le=8)] = 4
    keyframe_ratio: Fraction = 0.4
    min_depth: Positive = 0.1
    gyro: bool = True
    reinit: bool = True

    # Defaults of the method's authors.
    velocity_blend: Fraction = 0.5
    align_iterations: Count = 8
    c2: Positive = 2.0
    nu: Positive = 4.0
    outlier: Positive = 1.5
    patch_outliers: Annotated[int, Field(ge=0, le=4)] = 1
    least_gradient: Annotated[float, Field(ge=2, le=32)] = 8.0
    least_correlation: Fraction = 0.8
    adjust: bool = True
    adjust_level: Annotated[int, Field(ge=0, le=7)] = 2
    adjust_iterations: Count = 5

    # Ours.
    gain: bool = True
    max_depth: Positive = 50.0
    lost_share: Fraction = 0.35
    lost_area: Fraction = 0.05
    lost_after: NonNegative = 0.2
    reinit_after: NonNegative = 1.0

    @staticmethod
    def from_options(options: Mapping[str, object]) -> DsolSettings:
        """Settings of the preset that the options name, changed as the others say.

        Raises:
            InputError: an unknown option (with the nearest known name) or a value out of range.
        """
        preset = _PRESETS.get(str(options.get("preset", "paper")), {})
        return read_options(DsolSettings, "dsol", {**preset, **options})
