"""The virtual lab as one YAML file: which cameras hang where, which tags, how bad the pictures are.

Waypoints are counted from 1 in visiting order; lengths are metres, angles degrees, as in the setup files of a real
measurement, whose parts are used where they are the same.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from taskslam.errors import InputError
from taskslam.field_types import Positive
from taskslam.geometry import FloatArray
from taskslam.lab.robot import Sway
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.cameras.recording import HEARTBEAT
from taskslam.realworld.setup_file import BundleGrid, CameraMount, Degrees, Metres, Place, RobotTag, Waypoints
from taskslam.realworld.tags.tag_family import DEFAULT_FAMILY
from taskslam.user_files import Shipped

_LABS = Shipped("lab", "taskslam.lab", "labs", InputError)

Share = Annotated[float, Field(ge=0, lt=1)]
Seconds = Annotated[float, Field(ge=0, le=600)]
Height = Annotated[float, Field(gt=0, le=30)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Lens(_Part):
    """A calibrated camera: image size, focal lengths and principal point (px), plumb_bob distortion k1 k2 p1 p2 k3."""

    size: tuple[Annotated[int, Field(ge=16, le=8192)], Annotated[int, Field(ge=16, le=8192)]]
    focal: tuple[Positive, Positive]
    center: tuple[float, float]
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def camera(self, name: str) -> Camera:
        """The camera model of this lens."""
        K = np.array([[self.focal[0], 0, self.center[0]], [0, self.focal[1], self.center[1]], [0, 0, 1]])
        return Camera(name, *self.size, K, np.array(self.distortion))


class Mount(_Part):
    """Where a fixed camera hangs and looks.

    aim: the point x, y in `map` at height `aim_height` that the middle of the picture shows; height: of the camera;
    tilt: from straight down; heading: direction in `map` towards which it looks, and in which the picture's top points.
    """

    aim: tuple[Metres, Metres]
    aim_height: Metres = 0.0
    height: Height
    tilt: Annotated[float, Field(ge=0, lt=80)] = 0.0
    heading: Degrees = 0.0

    @property
    def T_map_camera(self) -> FloatArray:  # noqa: N802 the pose's frames
        """(4, 4) pose of the optical frame."""
        tilt, heading = np.radians(self.tilt), np.radians(self.heading)
        forward = np.array([np.cos(heading), np.sin(heading), 0.0])
        axis = np.sin(tilt) * forward - np.array([0.0, 0.0, np.cos(tilt)])
        right = np.array([np.sin(heading), -np.cos(heading), 0.0])
        T = np.eye(4)
        T[:3, :3] = np.column_stack([right, np.cross(axis, right), axis])
        T[:3, 3] = np.array([*self.aim, self.aim_height]) - axis * (self.height - self.aim_height) / np.cos(tilt)
        return T


class LabOverheadCamera(_Part):
    """A fixed camera over some waypoints. clock_offset: s that its clock is ahead of the robot's."""

    name: Name
    lens: Lens
    mount: Mount
    waypoints: Waypoints
    clock_offset: Annotated[float, Field(ge=-7200, le=7200)] = 0.0


class LabTag(RobotTag):
    """The tag on the robot, lying flat. height: of the tag above the floor."""

    height: Height


class LabUpwardCamera(_Part):
    """A camera on the robot that looks straight up."""

    lens: Lens
    mount: CameraMount
    clock_offset: Annotated[float, Field(ge=-7200, le=7200)] = 0.0


class LabBundle(_Part):
    """Four tags on the ceiling. place: of their middle in `map`; heading: where the sheet's top points."""

    waypoints: Waypoints
    square: BundleGrid
    place: Place
    family: str = DEFAULT_FAMILY


class Ceiling(_Part):
    """Tags overhead. height: of the tags; build: whether to add a ceiling there, for worlds without one."""

    height: Height
    build: bool = False
    camera: LabUpwardCamera
    bundles: Annotated[tuple[LabBundle, ...], Field(min_length=1)]


class Unevenness(_Part):
    """How a robot at rest deviates from level: standard deviations of roll and pitch (degrees) and of height (m).

    pivot: height, m, of the point that stays where it is as the robot tilts.
    """

    tilt: Annotated[float, Field(ge=0, le=20)] = 0.3
    height: Annotated[float, Field(ge=0, le=0.1)] = 0.001
    pivot: Annotated[float, Field(ge=0, le=3)] = 0.0

    @property
    def sway(self) -> Sway:
        """In radians and metres."""
        return Sway(float(np.radians(self.tilt)), self.height, self.pivot)


class Photo(_Part):
    """How pictures are taken and what spoils them.

    rate: Hz. before, after: s around the end of each pause in which pictures are taken. heartbeat: s after which one is
    kept though it shows no tag, as `taskslam camera record` does; none keeps none. shutter: s that one is exposed.
    exposure: 1 is right, 4 two stops too bright. light: what falls on tags and robot. softness: px, sigma of the
    point-spread function. noise: grey levels. quality: of the JPEG; none: PNG without loss. dropped: share of frames.
    """

    rate: Annotated[float, Field(gt=0, le=60)] = 3.0
    before: Seconds = 6.5
    after: Seconds = 1.5
    heartbeat: Positive | None = HEARTBEAT
    shutter: Annotated[float, Field(ge=0, le=1)] = 0.008
    exposure: Positive = 1.0
    light: Positive = 0.7
    softness: Annotated[float, Field(ge=0, le=20)] = 0.7
    noise: Annotated[float, Field(ge=0, le=100)] = 2.0
    quality: Annotated[int, Field(ge=1, le=100)] | None = 92
    dropped: Share = 0.03


class Lab(_Part):
    """Everything in the lab. time_zero: Unix time, s, at which the run's t = 0 is said to have been."""

    name: Name
    scenario: str
    time_zero: Annotated[float, Field(ge=0, le=1e10)] = 1_700_000_000.0
    seed: Annotated[int, Field(ge=0)] = 0
    sway: Unevenness = Unevenness()
    photo: Photo = Photo()
    tag: LabTag | None = None
    cameras: tuple[LabOverheadCamera, ...] = ()
    ceiling: Ceiling | None = None

    @model_validator(mode="after")
    def _something_to_see(self) -> Lab:
        if bool(self.cameras) != (self.tag is not None):
            raise ValueError("cameras overhead need `tag`, and a tag needs `cameras`")
        if not self.cameras and self.ceiling is None:
            raise ValueError("expected `tag` and `cameras`, or `ceiling`, or all of them")
        return self


def shipped_labs() -> list[str]:
    """Names of the labs that ship with the package."""
    return _LABS.names()


def load_lab(reference: str | Path) -> Lab:
    """A lab by shipped name or YAML file.

    Raises:
        InputError: no such lab, not YAML, an unknown key or a value out of range; says which.
    """
    return _LABS.load(reference, Lab)
