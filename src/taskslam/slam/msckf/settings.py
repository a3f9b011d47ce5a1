"""`MsckfSettings`: every constant of `msckf`, with the values that the benchmark's authors published."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=1000)]


class MsckfSettings(BaseModel):
    """Options of `msckf`. Metres, radians, seconds; image coordinates are normalised unless they say pixels.

    Published, under the authors' names. The image is divided into grid_row x grid_col cells, each with
    grid_min_feature_num to grid_max_feature_num features. fast_threshold: grey levels; patch_size, pyramid_levels,
    max_iteration, track_precision: of the Lucas-Kanade tracker; ransac_threshold, stereo_threshold: pixels.
    max_cam_state_size: camera poses in the window. gyro_noise, acc_noise: standard deviation of a sample; the biases'
    random walks; feature_noise: standard deviation of an observation. initial_covariance_*: variances.
    rotation_threshold, translation_threshold, tracking_rate_threshold: when the latest pose is no keyframe.
    position_std_threshold: m, at which it is lost. gate: the quantile of the chi-squared test, with one degree less
    than poses; the published one goes with the published noise.

    Ours: observability_constraints: False leaves the linearisation as it is, by which yaw gains information that nobody
    has seen. most_rows: of one update. gravity: m/s^2. still_start: s.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    grid_row: Count = 4
    grid_col: Count = 6
    grid_min_feature_num: Count = 6
    grid_max_feature_num: Count = 10
    fast_threshold: Count = 10
    patch_size: Annotated[int, Field(ge=5, le=51)] = 15
    pyramid_levels: Annotated[int, Field(ge=0, le=6)] = 3
    max_iteration: Count = 30
    track_precision: Positive = 0.01
    ransac_threshold: Positive = 3.0
    stereo_threshold: Positive = 5.0

    max_cam_state_size: Annotated[int, Field(ge=5, le=60)] = 20
    gyro_noise: Positive = 0.00276
    acc_noise: Positive = 0.03924
    gyro_bias_noise: Positive = 3e-4
    acc_bias_noise: Positive = 8e-3
    feature_noise: Positive = 0.035
    initial_covariance_velocity: Positive = 0.25
    initial_covariance_gyro_bias: Positive = 0.01
    initial_covariance_acc_bias: Positive = 0.01
    initial_covariance_extrinsic_rotation: Positive = 3.05e-4
    initial_covariance_extrinsic_translation: Positive = 2.5e-5
    rotation_threshold: Positive = 0.2618
    translation_threshold: Positive = 0.4
    tracking_rate_threshold: Annotated[float, Field(ge=0, le=1)] = 0.5
    position_std_threshold: Positive = 8.0
    gate: Annotated[float, Field(gt=0, lt=1)] = 0.05

    observability_constraints: bool = True
    most_rows: Annotated[int, Field(ge=30)] = 1500
    gravity: Annotated[float, Field(ge=1, le=30)] = 9.81
    still_start: Annotated[float, Field(ge=0.1, le=60)] = 2.0
