"""One look at a station, measured: a pose in the station's own frame, or the reason why there is none.

A station is what belongs to a waypoint and stays where it is: a camera over it, in whose floor frame poses are given,
or a bundle of tags on the ceiling. The frame does not matter for precision; for accuracy its place in `map` must be
known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from taskslam.geometry import SE2, FloatArray
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.looks import Look


class Fault(StrEnum):
    """Why a look gives no pose."""

    NO_TAG = "no tag"
    CUT = "cut"
    TWICE = "twice"
    RESIDUAL = "residual"
    PROBLEM = "problem"


@dataclass(frozen=True, eq=False, slots=True)
class Sighting:
    """A pose measured from one image. pose: of the robot's base in the station's frame; covariance: (3, 3) of the same.

    residual_px: how well the corners fit. margin_px: how far inside the image they lie. other_heading: rad, a second
    opinion.
    """

    pose: SE2
    covariance: FloatArray
    residual_px: float
    margin_px: float
    other_heading: float | None = None


@dataclass(frozen=True, slots=True)
class NoSighting:
    """Why an image gives no pose: the kind, and a sentence part without the image's name."""

    fault: Fault
    reason: str


@dataclass(frozen=True, eq=False)
class Station:
    """What watches some goals, or hangs over one.

    name: for messages, such as `camera east`. goals: indices from 0. looks: of its camera, by time, the station's tags
    only. camera: that took them; clock: its name. place: T_map_station, if known. measure: the pose that one look
    gives, by its place in `looks`.
    """

    name: str
    goals: tuple[int, ...]
    looks: Sequence[Look]
    camera: Camera
    clock: str
    place: SE2 | None
    measure: Callable[[int], Sighting | NoSighting]
