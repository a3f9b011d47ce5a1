"""`GfGgSettings`: every constant of `gf_gg` with its source, and the preset `paper`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import Fraction, NonNegative, Positive
from taskslam.slam.option_settings import read_options

Count = Annotated[int, Field(ge=1, le=1000)]


class GfGgSettings(BaseModel):
    """Options of `gf_gg`. Metres, seconds, pixels; distances between descriptors in bits of 256."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: Literal["paper"] = "paper"

    # Settings of the benchmark's authors in Gazebo.
    features: Annotated[int, Field(ge=100, le=4000)] = 800
    levels: Annotated[int, Field(ge=1, le=12)] = 8
    scale: Annotated[float, Field(gt=1, le=2)] = 1.2
    fast_threshold: Annotated[int, Field(ge=1, le=255)] = 20
    lowest_fast_threshold: Annotated[int, Field(ge=1, le=255)] = 7
    close_depth: Positive = 35.0  # in baselines
    good_features: bool = True
    features_wanted: Annotated[int, Field(ge=30, le=4000)] = 400
    queries: Count = 20
    good_graph: bool = True
    graph_threshold: Annotated[int, Field(ge=2, le=200)] = 30
    graph_cap: Annotated[int, Field(ge=2, le=200)] = 60
    virtual_frame_ahead: Annotated[int, Field(ge=0, le=100)] = 15  # frames; 0: without
    odometry_prior: bool = False

    # ORB-SLAM2 (the paper, and the constants of its authors' release).
    match_distance: Annotated[int, Field(ge=1, le=256)] = 100
    strict_distance: Annotated[int, Field(ge=1, le=256)] = 50
    ratio: Fraction = 0.8
    last_frame_radius: Positive = 7.0
    local_map_radius: Positive = 3.0
    local_keyframes: Count = 80
    keyframe_ratio: Fraction = 0.75
    least_inliers: Annotated[int, Field(ge=6, le=1000)] = 30
    least_relocalised: Annotated[int, Field(ge=6, le=1000)] = 50
    close_tracked: Count = 100
    close_untracked: Count = 70
    neighbours: Count = 10
    adjust_iterations: Count = 5
    polish_iterations: Annotated[int, Field(ge=0, le=100)] = 10
    redundant_share: Fraction = 0.9
    loop_closing: bool = True
    loop_matches: Count = 40
    loop_consistency: Count = 3

    # Ours.
    full_frames: Annotated[int, Field(ge=0, le=1000)] = 30  # before good features are chosen
    keyframe_gap: Count = 6  # frames: what ORB-SLAM2's mapping thread, being busy, sees to
    velocity_blend: Fraction = 0.0
    largest_depth: Positive = 40.0
    least_correlation: Fraction = 0.8
    lost_after: NonNegative = 0.2
    candidates: Count = 3
    ransac_draws: Count = 200
    seed: Annotated[int, Field(ge=0)] = 0

    @staticmethod
    def from_options(options: Mapping[str, object]) -> GfGgSettings:
        """Settings of the preset, changed as the options say.

        Raises:
            InputError: an unknown option (with the nearest known name) or a value out of range.
        """
        return read_options(GfGgSettings, "gf_gg", options)
