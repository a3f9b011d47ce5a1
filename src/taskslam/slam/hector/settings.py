"""`HectorSettings`: hector_mapping's parameters under their published names, with the benchmark's published values."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import NonNegative, Positive


class HectorSettings(BaseModel):
    """Options of `hector`. Metres, radians, seconds. Source: protocol 1.3; iterations: hector_mapping's own.

    map_size: cells of the finest level a side that the map may grow to; hits beyond are passed over. predict_motion:
    begin an alignment where the motion between the last two scans leads, not at the last pose. lost_score, lost_after:
    see `mapper.py`. These three are ours.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    map_resolution: Annotated[float, Field(ge=0.005, le=1.0)] = 0.05
    map_size: Annotated[int, Field(ge=256, le=16384)] = 4096
    map_multi_res_levels: Annotated[int, Field(ge=1, le=6)] = 2
    map_update_distance_thresh: NonNegative = 0.4
    map_update_angle_thresh: NonNegative = 0.06
    update_factor_free: Annotated[float, Field(gt=0, lt=0.5)] = 0.4
    update_factor_occupied: Annotated[float, Field(gt=0.5, lt=1)] = 0.9
    laser_max_dist: Positive = 10.0
    iterations_coarse: Annotated[int, Field(ge=1, le=100)] = 4
    iterations_fine: Annotated[int, Field(ge=1, le=100)] = 6
    predict_motion: bool = True

    lost_score: Annotated[float, Field(ge=0, le=1)] = 0.5
    lost_after: NonNegative = 1.0
