"""`SvoSettings`: every constant of `svo` with its source."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import Fraction, NonNegative, Positive

Count = Annotated[int, Field(ge=1, le=10_000)]


class SvoSettings(BaseModel):
    """Options of `svo`. Metres, degrees, seconds, pixels of the finest level, grey levels of 0..255."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    # Settings of the benchmark's authors.
    cell: Annotated[int, Field(ge=8, le=200)] = 24

    # Defaults of the method's authors for stereo.
    features: Count = 180
    keyframes: Annotated[int, Field(ge=2, le=50)] = 10
    reprojected_keyframes: Annotated[int, Field(ge=1, le=50)] = 5
    keyframe_upper: Count = 140
    keyframe_lower: Count = 100
    keyframe_distance: NonNegative = 0.1
    keyframe_angle: NonNegative = 20.0
    keyframe_disparity: NonNegative = 40.0
    align_coarsest: Annotated[int, Field(ge=1, le=6)] = 4
    align_finest: Annotated[int, Field(ge=0, le=6)] = 2
    pose_error: Positive = 2.0
    fast_threshold: Annotated[int, Field(ge=1, le=100)] = 10
    edgelet_gradient: Positive = 200.0
    lost_features: Count = 40

    # Ours.
    align_iterations: Count = 10
    feature_iterations: Count = 10
    pose_iterations: Count = 10
    corner_levels: Annotated[int, Field(ge=1, le=5)] = 3
    least_score: Positive = 10.0
    least_correlation: Fraction = 0.8
    disparity_deviation: Positive = 0.5
    pixel_deviation: Positive = 1.0
    most_failures: Count = 5
    min_depth: Positive = 0.2
    max_depth: Positive = 50.0
    gain: bool = True
    velocity_blend: Fraction = 0.5
    reinit: bool = True
    lost_after: NonNegative = 0.2
    reinit_after: NonNegative = 1.0
