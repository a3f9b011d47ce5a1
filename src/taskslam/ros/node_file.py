"""Node files: what there is to say of somebody's SLAM node, so that it can be driven as a method (`-m ros:NODE.yaml`).

    name: my_slam
    command: rosrun my_slam my_slam_node
    setup: /home/me/catkin_ws/devel/setup.bash
    sensors: [laser_scan, wheel_odometry]
    parameters: {max_laser_range: 20.0}
    answer: {topic: /pose, type: geometry_msgs/PoseWithCovarianceStamped}

Text that begins with `./` is a file beside the node file. What every key means stands at its field; `nodes/` holds
the files that ship.
"""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, field_validator, model_validator

from taskslam.errors import InputError, did_you_mean
from taskslam.field_types import NonNegative, Positive
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.ros.lockstep import Answers, Rules
from taskslam.ros.qos import Quality
from taskslam.sensors import sensor_kind
from taskslam.slam.base import Kind, MapMode, MethodCard
from taskslam.user_files import Shipped, check

NODES = Shipped("node", "taskslam.ros", "nodes", InputError)
POSE_TYPES = (
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TransformStamped",
    "nav_msgs/Odometry",
)
TF, TF_STATIC, CLOCK = "/tf", "/tf_static", "/clock"
ALWAYS = (TF, TF_STATIC, CLOCK)
"""Topics that every node is told."""

_BESIDE = "./"
_INT32 = 1 << 31
_MILLISECOND = 1_000_000

Text = Annotated[str, Field(min_length=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]
Topic = Annotated[str, Field(pattern=r"^/[A-Za-z]\w*(/\w+)*$", description="a whole name such as /scan")]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Answer(_Part):
    """Where the node's live pose is heard.

    topic and type: of a message with a pose; or transform: the parent and the child of one on /tf. world, of: the pose
    is that of our frame `of` in the node's frame `world` (any, if it is empty). origin: what the world is: the `base`
    where it started, the frame `of` where that started, or whatever the `first` pose was. ahead: seconds by which the
    node stamps it later than the frame that it belongs to.
    """

    topic: Topic | None = None
    type: Literal[POSE_TYPES] | None = None  # type: ignore[valid-type]
    transform: tuple[Text, Text] | None = None
    world: str = ""
    of: Text = "base_footprint"
    origin: Literal["base", "of", "first"] = "base"
    ahead: NonNegative = 0.0

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.topic is None) == (self.transform is None):
            raise ValueError("expected either a topic with its type, or a transform [parent, child]")
        if (self.topic is None) != (self.type is None):
            raise ValueError("expected a topic with its type")
        return self


class Extrinsic(_Part):
    """A parameter that says how one of our frames lies in another, worked out from the robot.

    what: `xyz` (3 numbers, m), `rotation` (9, row by row), `matrix` (16, row by row) or `rows` (4 lists of 4).
    """

    of: Text
    seen_from: Text
    what: Literal["xyz", "rotation", "matrix", "rows"]


class Intrinsic(_Part):
    """A parameter that says what a camera without distortion is, worked out from the robot.

    of: the sensor. what: `pinhole` (fx, fy, cx, cy, pixels) or `resolution` (width, height).
    """

    of: Literal["stereo_images", "rgbd_images"] = "stereo_images"
    what: Literal["pinhole", "resolution"]


class Needs(_Part):
    """What the node needs beyond the wall around a method, printed beside its results.

    reads: files and folders, such as the ROS prefix under the one whose `setup` is named (which is open). The ROS log
    is written into the method's own folder. TCP is always open to a ROS 1 node, shared memory to a ROS 2 node.
    """

    reads: tuple[Text, ...] = ()
    shared_memory: bool = False


class NodeFile(_Part):
    """A node file.

    name: of the node and of the method. ros: its version. command: how it is started, without a shell. setup: a script
    that is sourced before (bash); the `python3` that it leaves speaks ROS 2 for us, and without it our own interpreter.
    environment: variables. parameters: the type is that of the value (1 is an int, 1.0 a double); for ROS 1, a name
    that begins with a slash is the whole name, any other is the node's own. extrinsics and intrinsics: parameters that
    are worked out from the robot. remaps: as in `from:=to`. sensors: what the node is told. awaits: the sensor whose
    frames it answers. topics: names of ours that shall be others. frames: the same for frames. qos: quality of service
    by topic, for ROS 2: of ours as the node has them, and of the answer's. clouds_from: the firing with which a point
    cloud is stamped and from which its points' times count; `first`, which nodes that straighten turns want, also gives
    the points in the order of firing, as drivers do. answers: whether to every frame or, sparse, where it sees fit;
    silent_start: s from the first frame of a life in which it may be silent, though it answers every later frame.
    reset: `restart`, a fresh process for every life, or a service without a request that is called besides, before the
    first measurement. tick_ms: of the clock while it is waited for. patience: s on the wall's clock for one answer, a
    long time; in_a_row: so many frames without an answer end a node that answers every frame. start: s on the wall's
    clock until it must be connected. repeats: whether the same input gives the same poses. still_start, latency, queue:
    as on any method's card. source: how to get it.
    """

    name: Name
    ros: Literal[1, 2] = 1
    command: Annotated[str, Field(min_length=1, description="how the node is started")]
    setup: Text | None = None
    environment: dict[Name, str] = {}
    parameters: dict[Text, Any] = {}
    extrinsics: dict[Text, Extrinsic] = {}
    intrinsics: dict[Text, Intrinsic] = {}
    remaps: dict[Text, Text] = {}
    sensors: Annotated[tuple[str, ...], Field(min_length=1, description="what the node is told, as [laser_scan]")]
    awaits: str | None = None
    topics: dict[Topic, Topic] = {}
    frames: dict[Text, Text] = {}
    qos: dict[Topic, Quality] = {}
    clouds_from: Literal["first", "last"] = "last"
    answer: Annotated[Answer, Field(description="where its live pose is heard")]
    answers: Answers = Answers.EVERY_FRAME
    silent_start: NonNegative = 0.0
    reset: Literal["restart"] | Topic = "restart"
    tick_ms: Positive = 2.0
    patience: Positive = 10.0
    in_a_row: Annotated[int, Field(ge=1)] = 10
    start: Positive = 60.0
    still_start: NonNegative = 0.0
    latency: NonNegative = 0.05
    queue: Annotated[int, Field(ge=1)] = 1
    needs: Needs = Needs()
    kind: Literal[Kind.SLAM, Kind.ODOMETRY, Kind.LOCALIZATION] = Kind.SLAM
    repeats: bool = False
    version: str = ""
    licence: str = "unknown"
    summary: str = ""
    homepage: str = ""
    source: str = ""
    _folder: Path = PrivateAttr(default=Path())
    _digest: str = PrivateAttr(default="")

    @field_validator("parameters")
    @classmethod
    def _as_ros_has_them(cls, parameters: dict[str, Any]) -> dict[str, Any]:
        for name, value in parameters.items():
            if wrong := _not_a_parameter(value):
                raise ValueError(f"{name} {wrong}")
        return parameters

    @model_validator(mode="after")
    def _as_its_ros_has_them(self) -> Self:
        if self.ros == 1 and self.qos:
            raise ValueError("qos: ROS 1 has none; expected it with ros: 2")
        for name, value in self.parameters.items() if self.ros == 2 else ():
            if name.startswith("/"):
                raise ValueError(f"parameters: {name} begins with a slash; a parameter of ROS 2 is always a node's own")
            if wrong := _mixed(value):
                raise ValueError(f"parameters: {name} {wrong}")
        return self

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        try:
            kinds = [sensor_kind(sensor) for sensor in self.sensors]
        except InputError as error:
            raise ValueError(str(error)) from None
        if Sensor.TRUE_POSE in self.sensors:
            raise ValueError("sensors: a node is not told true poses")
        frames = [kind.sensor for kind in kinds if kind.is_frame]
        if self.awaits is None and len(frames) != 1:
            listed = ", ".join(frames) or "none"
            raise ValueError(f"awaits: say to which sensor's frames it answers (those with frames: {listed})")
        if self.awaits is not None and self.awaits not in frames:
            raise ValueError(
                f"awaits: {self.awaits} is none of its sensors with frames{did_you_mean(self.awaits, frames)}"
            )
        known = [topic.name for kind in kinds for topic in kind.topics]
        for topic in self.topics:
            if topic not in known:
                hint = did_you_mean(topic, known)
                raise ValueError(f"topics: {topic} is none of ours; expected one of {', '.join(known)}.{hint}")
        heard = [self.answer.topic] if self.answer.topic else []
        told = list(dict.fromkeys([*map(self.called, known), *ALWAYS, *heard]))
        for topic in self.qos:
            if topic not in told:
                hint = did_you_mean(topic, told)
                raise ValueError(f"qos: {topic} is no topic between us; expected one of {', '.join(told)}.{hint}")
        return self

    def called(self, topic: str) -> str:
        """What the node calls one of our topics."""
        return self.topics.get(topic, topic)

    @property
    def awaited(self) -> Sensor:
        """The sensor whose frames it answers."""
        return Sensor(self.awaits or next(name for name in self.sensors if sensor_kind(name).is_frame))

    @property
    def rules(self) -> Rules:
        """How it is waited for."""
        tick, silent = round(self.tick_ms * _MILLISECOND), round(self.silent_start * NANOSECONDS)
        return Rules(self.answers, silent, tick, longest_s=self.patience, in_a_row=self.in_a_row)

    @property
    def arguments(self) -> list[str]:
        """The command's words."""
        return [self.beside(word) for word in shlex.split(self.command)]

    @property
    def places(self) -> tuple[str, ...]:
        """What it reads beyond the system's places: whole paths."""
        named = [*self.needs.reads, *(text for text in _texts(self.parameters) if text.startswith(_BESIDE))]
        places = map(self.beside, named)
        programs = [str(Path(word).parent) for word in self.arguments if word.startswith("/") and Path(word).exists()]
        prefix = [str(Path(self.beside(self.setup)).parent)] if self.setup else []
        return tuple(dict.fromkeys((*prefix, *programs, *places)))

    def with_parameters(self, values: Mapping[str, object]) -> NodeFile:
        """The same with some parameters of other values. Raises InputError: one cannot be a parameter."""
        for name, value in values.items():
            if wrong := _not_a_parameter(value):
                raise InputError(f"{self.name} option {name} {wrong}")
        return self.model_copy(update={"parameters": self.parameters | dict(values)})

    def beside(self, text: str) -> str:
        """The whole path of a file beside the node file; any other text as it is."""
        return str(self._folder / text.removeprefix(_BESIDE)) if text.startswith(_BESIDE) else text

    def card(self) -> MethodCard:
        """What it declares as a method."""
        sensors = tuple(sensor_kind(sensor).sensor for sensor in self.sensors)
        return MethodCard(
            name=self.name,
            version=" ".join(filter(None, (self.version, f"node file {self._digest}"))),
            licence=self.licence,
            kind=Kind(self.kind),
            sensors=sensors,
            summary=self.summary or f"a ROS {self.ros} node: {self.command}",
            odometry_prior=Sensor.WHEEL_ODOMETRY in sensors,
            needs_still_start=self.still_start,
            map_mode=MapMode.CONTINUE if self.kind is Kind.SLAM else MapMode.NONE,
            deterministic=self.repeats,
            latency=self.latency,
            queue=self.queue,
            homepage=self.homepage,
            reads=self.places,
            loopback=self.ros == 1,
            shared_memory=self.needs.shared_memory or self.ros == 2,
        )


def load_node(reference: str | Path) -> NodeFile:
    """A node by the name of a file that ships, or from a .yaml file.

    Raises InputError: there is none, or it says something that a node file cannot say; names the key.
    """
    content, where = NODES.read(reference, NodeFile)
    node = check(NodeFile, content, where, InputError)
    shipped = str(reference) in NODES.names()
    node._folder = Path(__file__).parent / NODES.folder if shipped else Path(reference).absolute().parent
    node._digest = hashlib.sha256(node.model_dump_json().encode()).hexdigest()[:12]
    return node


def _not_a_parameter(value: object) -> str:
    """Why a value cannot be a parameter; empty if it can."""
    match value:
        case bool() | float() | str():
            return ""
        case int():
            return (
                "" if -_INT32 <= value < _INT32 else f"is {value}: an int parameter has 32 bits; write it as a double"
            )
        case list():
            return next(filter(None, map(_not_a_parameter, value)), "")
        case dict() if all(isinstance(key, str) for key in value):
            return next(filter(None, map(_not_a_parameter, value.values())), "")
    return (
        f"is a {type(value).__name__}: expected true or false, an int, a double, text, or lists and mappings of these"
    )


def _mixed(value: object) -> str:
    """Why a value cannot be a parameter of ROS 2; empty if it can."""
    match value:
        case []:
            return "is an empty list, of which ROS 2 cannot tell the type"
        case [first, *rest] if any(type(other) is not type(first) for other in rest) or isinstance(first, list | dict):
            return "is a list of several types; ROS 2 has lists of one: true or false, ints, doubles, or texts"
        case dict():
            return next(filter(None, map(_mixed, value.values())), "")
    return ""


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    for part in value if isinstance(value, list) else value.values() if isinstance(value, dict) else ():
        yield from _texts(part)
