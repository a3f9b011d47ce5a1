"""`FastLio2Settings`: every constant of `fast_lio2`, and the two presets."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from taskslam.field_types import Fraction, NonNegative, Positive

_INDOOR = {
    "point_filter_num": 2,
    "blind": 0.5,
    "filter_size_surf": 0.2,
    "filter_size_map": 0.2,
    "neighbour_distance": 1.0,
    "map_point": "first",
    "weakest_direction": 0.04,
}


class FastLio2Settings(BaseModel):
    """Options of `fast_lio2`. Metres, seconds, and the units of a filter's variances.

    preset: `paper`, the authors' published configuration for a Velodyne, as the paper's runs had it; `indoor`, what
    suits rooms of a few metres: the settings that follow it replace the defaults, and every one can be set by itself.

    Published, under the authors' names:
    point_filter_num: every so-manieth point of a scan is used. blind: points nearer than this are not.
    filter_size_surf: side of the voxels whose centroids stand for a scan. filter_size_map: side of the map's voxels,
    each of which keeps one point. max_iteration: passes of the iterated filter after the first. acc_cov, gyr_cov,
    b_acc_cov, b_gyr_cov: variances that one IMU sample adds, per s^2 of its duration. extrinsic_est_en: whether the
    LiDAR's pose in the IMU is estimated.

    Constants in the authors' program: gravity: m/s^2, to which the accelerometer is scaled at rest. neighbours: of the
    map, for a plane. neighbour_distance: the farthest of them. plane_tolerance: the farthest that one of them may lie
    off the plane. match_score: 1 - 0.9 |r| / sqrt(range) must exceed it, r being the distance from the plane.
    point_cov: variance of that distance, m^2. converged: the largest component of a step that ends the iteration.

    Ours: still_start: seconds of standstill for gravity and gyro bias. map_point: which of its points a voxel keeps,
    the `nearest` to its centre (the paper's Sec. V-C) or the `first`. deskew, refresh_neighbours: False leaves out the
    back-propagation, or the second search for neighbours once the estimate has converged, so that what they bring can
    be seen. least_points, least_matched, least_fit, largest_correction, largest_turn, weakest_direction,
    largest_deviation, imu_gap: when it is lost, see `verdict.py`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: Literal["paper", "indoor"] = "paper"

    point_filter_num: Annotated[int, Field(ge=1, le=100)] = 4
    blind: NonNegative = 2.0
    filter_size_surf: Annotated[float, Field(ge=0.02, le=5)] = 0.5
    filter_size_map: Annotated[float, Field(ge=0.02, le=5)] = 0.5
    max_iteration: Annotated[int, Field(ge=1, le=20)] = 3
    acc_cov: Positive = 0.1
    gyr_cov: Positive = 0.1
    b_acc_cov: Positive = 1e-4
    b_gyr_cov: Positive = 1e-4
    extrinsic_est_en: bool = False

    gravity: Annotated[float, Field(ge=1, le=30)] = 9.81
    neighbours: Annotated[int, Field(ge=3, le=20)] = 5
    neighbour_distance: Annotated[float, Field(gt=0, le=10)] = 5.0**0.5
    plane_tolerance: Positive = 0.1
    match_score: Fraction = 0.9
    point_cov: Positive = 1e-3
    converged: Positive = 1e-3

    still_start: Annotated[float, Field(ge=0.1, le=60)] = 1.0
    map_point: Literal["nearest", "first"] = "nearest"
    deskew: bool = True
    refresh_neighbours: bool = True
    least_points: Annotated[int, Field(ge=6)] = 30
    least_matched: Fraction = 0.1
    least_fit: Fraction = 0.8
    largest_correction: Positive = 0.3
    largest_turn: Positive = 0.2
    weakest_direction: NonNegative = 0.0
    largest_deviation: Positive = 0.3
    imu_gap: Positive = 0.1

    @model_validator(mode="before")
    @classmethod
    def _preset_under_the_options(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("preset") == "indoor":
            return {**_INDOOR, **given}
        return given
