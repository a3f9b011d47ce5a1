"""`KartoSettings`: slam_toolbox's parameters under their published names, with the benchmark's published values.

Sources: protocol 1.3 (the authors' closedloop_mapping.yaml); where that file is silent, slam_toolbox's own defaults.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import Fraction, NonNegative, Positive
from taskslam.slam.option_settings import read_options


class KartoSettings(BaseModel):
    """Options of `karto`. Metres, radians, seconds; responses are fractions of 1.

    Three values differ from the published file, each for a reason given in `methods/karto.py`:
    minimum_travel_distance (published 0.0: every scan), reuse_keyframes and refine_match (not in OpenKarto).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_laser_range: Positive = 10.0
    minimum_time_interval: NonNegative = 0.05
    minimum_travel_distance: NonNegative = 0.2
    minimum_travel_heading: NonNegative = 0.1
    deskew: bool = True

    scan_buffer_size: Annotated[int, Field(ge=1, le=100)] = 10
    scan_buffer_maximum_scan_distance: Positive = 10.0
    link_match_minimum_response_fine: Fraction = 0.1
    link_scan_maximum_distance: NonNegative = 1.5

    do_loop_closing: bool = True
    loop_search_maximum_distance: NonNegative = 3.0
    loop_match_minimum_chain_size: Annotated[int, Field(ge=1)] = 10
    loop_match_maximum_variance_coarse: Positive = 3.0
    loop_match_minimum_response_coarse: Fraction = 0.35
    loop_match_minimum_response_fine: Fraction = 0.45

    correlation_search_space_dimension: Positive = 0.5
    correlation_search_space_resolution: Positive = 0.01
    correlation_search_space_smear_deviation: Positive = 0.1
    loop_search_space_dimension: Positive = 2.0
    loop_search_space_resolution: Positive = 0.05
    loop_search_space_smear_deviation: Positive = 0.03

    distance_variance_penalty: Positive = 0.5
    angle_variance_penalty: Positive = 1.0
    minimum_distance_penalty: Fraction = 0.5
    minimum_angle_penalty: Fraction = 0.9
    fine_search_angle_offset: Positive = 0.00349
    coarse_search_angle_offset: Positive = 0.349
    coarse_angle_resolution: Positive = 0.0349
    use_response_expansion: bool = True

    reuse_keyframes: bool = True
    refine_match: bool = True

    @staticmethod
    def from_options(options: dict[str, object]) -> KartoSettings:
        """Settings from keyword options.

        Raises:
            InputError: an unknown option (with the nearest known name) or a value out of range.
        """
        return read_options(KartoSettings, "karto", options)
