"""`MsckfSettings`: every constant of `msckf` with its source, and the preset `paper`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import Fraction, NonNegative, Positive

Count = Annotated[int, Field(ge=1, le=1000)]


class MsckfSettings(BaseModel):
    """Options of `msckf`. Metres, radians, seconds; image coordinates are normalised unless they say pixels.

    Published, under the authors' names. The image is divided into grid_row x grid_col cells, each with
    grid_min_feature_num to grid_max_feature_num features. fast_threshold: grey levels; patch_size, pyramid_levels,
    max_iteration, track_precision: of the Lucas-Kanade tracker; ransac_threshold, stereo_threshold: pixels.
    max_cam_state_size: camera poses in the window. gyro_noise, acc_noise: standard deviation of a sample; the biases'
    random walks, per root second; feature_noise: standard deviation of an observation. gate: the quantile of the
    chi-squared test, with one degree less than poses; a low one goes with the published noise, which is high.
    initial_covariance_*: variances. rotation_threshold, translation_threshold, tracking_rate_threshold: when the latest
    pose is no keyframe. position_std_threshold: at which all certainty is given up, and the window. most_rows: of one
    update.

    Ours. observability_constraints: False leaves the linearisation as it is, by which yaw gains information that nobody
    has seen. gravity: m/s^2. still_start: seconds of standstill. least_correlation: of the windows about a feature in
    both pictures; of noise one in ten reaches 0.25. A pair is a measurement if of the features before at least
    least_share, and least_features, were found again within farthest_found pixels of where disparity and IMU have
    them, and features are seen in least_cells cells. lost_after, reinit_after: seconds without a measurement until it
    is lost, and until it begins with new features (`slam/vision/vigil.py`). least_believed: share of the latest
    landmarks that pass the gate; 0.56 to 1 on our drives, 0.4 and less with a lens that is five percent off. imu_gap:
    seconds of silence, after which the robot is taken to go on as it went.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: Literal["paper"] = "paper"

    # Settings of the benchmark's authors in Gazebo.
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
    tracking_rate_threshold: Fraction = 0.5
    position_std_threshold: Positive = 8.0

    # Constants of the method's authors.
    gate: Annotated[float, Field(gt=0, lt=1)] = 0.05
    most_rows: Annotated[int, Field(ge=30, le=10_000)] = 1500

    # Ours.
    observability_constraints: bool = True
    ransac_draws: Count = 20
    gravity: Annotated[float, Field(ge=1, le=30)] = 9.81
    still_start: Annotated[float, Field(ge=0.1, le=60)] = 2.0
    least_correlation: Fraction = 0.25
    least_share: Fraction = 0.2
    farthest_found: Positive = 20.0
    least_features: Annotated[int, Field(ge=3, le=1000)] = 15
    least_cells: Annotated[int, Field(ge=1, le=1000)] = 4
    lost_after: NonNegative = 0.2
    reinit_after: NonNegative = 0.5
    least_believed: Fraction = 0.45
    imu_gap: Positive = 0.1
