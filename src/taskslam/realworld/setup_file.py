"""What was mounted where, in one YAML file: tags, cameras, logs of arrivals. Every complaint names file and key.

Waypoints are counted from 1 in visiting order, as in every table and figure; lengths are metres, angles degrees. Paths
are relative to the file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, field_validator, model_validator

from taskslam.errors import InputError
from taskslam.geometry import SE2, FloatArray
from taskslam.mode import Mode
from taskslam.realworld.tags.tag_family import DEFAULT_FAMILY
from taskslam.realworld.tags.tag_plane import tag_square
from taskslam.task import MOST_ROUNDS
from taskslam.user_files import read_model

LOOKING_UP = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""T_body_optical of a camera that looks up, the top of its image forward."""

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
Degrees = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False)]
Side = Annotated[float, Field(gt=0.005, le=5, allow_inf_nan=False)]
Seconds = Annotated[float, Field(allow_inf_nan=False, ge=-1e11, le=1e11)]
Waypoints = Annotated[tuple[Annotated[int, Field(ge=1)], ...], Field(min_length=1)]
TagId = Annotated[int, Field(ge=0)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Place(_Part):
    """A planar pose: x, y in metres, heading in degrees, anticlockwise seen from above."""

    x: Metres = 0.0
    y: Metres = 0.0
    heading: Degrees = 0.0

    @property
    def pose(self) -> SE2:
        """As a pose, in radians."""
        return SE2(self.x, self.y, float(np.radians(self.heading)))


class RunSource(_Part):
    """The arrivals of one run, as the navigation side logged them.

    arrivals: one of our run directories (method, mode and waypoints come with it), or files with one or more rounds:
    the published `visited_waypoints*.txt`, or CSV with `time,round,waypoint`. time_zero: Unix time, s, of t = 0 in our
    journal; by default when it says that it was started. priming: whether the first round of files only built the map.
    """

    arrivals: tuple[str, ...]
    method: str | None = None
    mode: Mode | None = None
    rounds: Annotated[int, Field(ge=1, le=MOST_ROUNDS)] | None = None
    time_zero: Seconds | None = None
    priming: bool | None = None

    @field_validator("arrivals", mode="before")
    @classmethod
    def _one_or_many(cls, value: object) -> object:
        return (value,) if isinstance(value, str) else value


class CameraSource(_Part):
    """A camera: its images, its calibration, its clock.

    image_kind: `raw` as the sensor gives them, or `rectified` by ROS image_proc; a calibration file holds both cameras
    and only the user knows. clock_offset: s, image stamp minus arrival stamp at one instant, or `estimate`. gamma: of
    the images; 1 for a machine-vision camera that writes grey values in proportion to light.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")]
    images: str
    calibration: str
    image_kind: Literal["raw", "rectified"] = Field(
        description="`raw`, or `rectified` by ROS image_proc; the calibration file cannot tell"
    )
    clock_offset: Seconds | Literal["estimate"] = 0.0
    gamma: Annotated[float, Field(ge=0.3, le=4)] = 2.2


class OverheadCamera(CameraSource):
    """A fixed camera over some waypoints. place: of its floor frame in `map`, if surveyed: then accuracy is known."""

    waypoints: Waypoints
    place: Place | None = None


class CameraMount(Place):
    """Where a camera that looks up sits on the base; heading: where its image's top points; z: m above the base."""

    z: Metres = 0.0

    @property
    def T_base_camera(self) -> FloatArray:  # noqa: N802 the frames' names
        """(4, 4) pose of the optical frame in the base: z up, -y to where the image's top points."""
        T = self.pose.matrix() @ LOOKING_UP
        T[2, 3] = self.z
        return np.asarray(T)


class UpwardCamera(CameraSource):
    """A camera on the robot, looking up."""

    mount: CameraMount = CameraMount()


class RobotTag(_Part):
    """The tag on top of the robot. size: outer edge of its black border. mount: on the base; heading: of its top."""

    id: TagId
    size: Side
    family: str = DEFAULT_FAMILY
    mount: Place = Place()


class BundleTag(_Part):
    """A tag of a bundle: its middle as one faces the sheet, x to the right, y up; heading anticlockwise."""

    id: TagId
    size: Side
    x: Metres = 0.0
    y: Metres = 0.0
    heading: Degrees = 0.0

    @property
    def corners(self) -> FloatArray:
        """(4, 2) TL, TR, BR, BL in the bundle's frame, m: x to the sheet's top, y to its right, z up."""
        angle = -np.radians(self.heading)
        c, s = np.cos(angle), np.sin(angle)
        square = tag_square(self.size, from_above=False)
        corners: FloatArray = square @ np.array([[c, s], [-s, c]]) + np.array([self.y, self.x])
        return corners


class BundleGrid(_Part):
    """Four tags of one size at the corners of a square. ids: top left, top right, bottom right, bottom left.

    spacing: between the middles of neighbours.
    """

    ids: tuple[TagId, TagId, TagId, TagId]
    size: Side
    spacing: Side

    @property
    def tags(self) -> tuple[BundleTag, ...]:
        """The same, one by one."""
        half = self.spacing / 2
        places = ((-half, half), (half, half), (half, -half), (-half, -half))
        return tuple(BundleTag(id=i, size=self.size, x=x, y=y) for i, (x, y) in zip(self.ids, places, strict=True))


class Bundle(_Part):
    """Tags on the ceiling over a waypoint; sheets alike may hang over several. place: of the sheet in `map`, if known.

    tags: any arrangement in one plane; square: the usual four. One tag alone can only be measured as if the robot never
    tilted.
    """

    waypoints: Waypoints
    tags: tuple[BundleTag, ...] = ()
    square: BundleGrid | None = None
    family: str = DEFAULT_FAMILY
    place: Place | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Bundle:
        if bool(self.tags) == (self.square is not None):
            raise ValueError("give either `tags` or `square`")
        _refuse_twice("tag id", (tag.id for tag in self.layout))
        return self

    @property
    def layout(self) -> tuple[BundleTag, ...]:
        """Its tags."""
        return self.square.tags if self.square is not None else self.tags


class Setup(_Part):
    """What both directions share.

    scenario: name under which results are kept. waypoints: `[x, y, heading]` in `map`, m and degrees, in visiting
    order; needed where the arrivals are not from one of our run directories and no `planned_waypoints.txt` lies beside
    them. pause: s that the robot stands at a waypoint; an arrival is stamped at the end of it. frames: how many images
    at least must show the tag at rest.
    """

    _folder: Path = PrivateAttr(default=Path())
    scenario: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")] | None = None
    runs: Annotated[tuple[RunSource, ...], Field(min_length=1)]
    waypoints: tuple[Place, ...] | None = None
    pause: Annotated[float, Field(gt=0, le=600)] = 5.0
    frames: Annotated[int, Field(ge=1, le=1000)] = 3

    @field_validator("waypoints", mode="before")
    @classmethod
    def _rows_as_lists(cls, value: object) -> object:
        if not isinstance(value, list):
            return value
        return [
            dict(zip(("x", "y", "heading"), row, strict=True)) if isinstance(row, list) and len(row) == 3 else row
            for row in value
        ]

    def path(self, name: str) -> Path:
        """A path in the file, relative to it."""
        return self._folder / Path(name).expanduser()


class OutsideInSetup(Setup):
    """Cameras over the waypoints look at the tag on the robot."""

    tag: RobotTag
    cameras: Annotated[tuple[OverheadCamera, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _each_once(self) -> OutsideInSetup:
        _refuse_twice("camera name", (camera.name for camera in self.cameras))
        _refuse_twice("image folder", (camera.images for camera in self.cameras))
        _refuse_twice("waypoint", (number for camera in self.cameras for number in camera.waypoints))
        return self


class InsideOutSetup(Setup):
    """A camera on the robot looks at tags over the waypoints."""

    camera: UpwardCamera
    bundles: Annotated[tuple[Bundle, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _each_once(self) -> InsideOutSetup:
        _refuse_twice("waypoint", (number for bundle in self.bundles for number in bundle.waypoints))
        if len({bundle.family for bundle in self.bundles}) > 1:
            raise ValueError("bundles of two tag families; expected one")
        return self


AnySetup = TypeVar("AnySetup", OutsideInSetup, InsideOutSetup)


def load_setup(path: Path, kind: type[AnySetup]) -> AnySetup:
    """A setup file. Raises InputError naming the file, the key, and what was expected there."""
    setup = read_model(path, kind, "setup", InputError)
    setup._folder = path.absolute().parent
    return setup


def _refuse_twice(what: str, values: Iterable[object]) -> None:
    for value, count in Counter(values).items():
        if count > 1:
            raise ValueError(f"{what} {value} is given {count} times; expected once")
