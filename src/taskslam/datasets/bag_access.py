"""Opening ROS 1 bags, ROS 2 bags and MCAPs with rosbags, and reading messages of some topics one after the other.

Only standard messages are read, by their standard definitions: a bag may hold any other types, known or not.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Reader as Rosbag1Reader
from rosbags.rosbag2 import Reader as Rosbag2Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from taskslam.datasets.bag_files import (
    SUFFIXES,
    BagPath,
    bag_in,
    begins_as_a_bag,
    check_bag_files,
    how_to_repair,
    is_ros1,
)
from taskslam.errors import DatasetError, TaskSlamError
from taskslam.reading import is_file, is_folder

_TF = "tf2_msgs/msg/TFMessage"


@dataclass(frozen=True, slots=True)
class Message:
    """One message: its topic, when it was recorded (ns), and its content by field names."""

    topic: str
    recorded: int
    content: Any


@cache
def ros_types(store: Stores) -> Typestore:
    """The standard messages, TFMessage among them, which some of the sets that ship with rosbags lack."""
    types = get_typestore(store)
    if _TF not in types.types:
        types.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", _TF))
    return types


def bag_file(path: Path) -> Path:
    """What to open: the file or ROS 2 folder itself, or the one that lies in the folder. Raises DatasetError."""
    if is_file(path) or is_file(path / "metadata.yaml"):
        return path
    inside = [place for place in sorted(path.iterdir()) if _is_bag(place)]
    if len(inside) != 1:
        what = f"holds {len(inside)} bags" if inside else "holds neither mav0, nor metadata.yaml, nor a .bag or .mcap"
        raise DatasetError(f"{path}: {what}; expected an EuRoC folder, or one ROS 1 bag, ROS 2 bag or MCAP")
    return inside[0]


def topic_types(path: Path) -> dict[str, str]:
    """Message type of every topic; a topic of two types has the first. Raises DatasetError."""
    with _opened(path) as reader:
        types: dict[str, str] = {}
        for connection in reader.connections:
            types.setdefault(connection.topic, connection.msgtype)
        return types


def read_messages(
    path: Path, topics: Collection[str], skip: Callable[[Message, DatasetError], None] | None = None
) -> Iterator[Message]:
    """All messages of these topics as they were recorded. skip: told of one that cannot be decoded.

    Raises DatasetError where the bag is damaged, or a topic is of a type that is not standard; without `skip`, also for
    the first message that cannot be decoded.
    """
    if topics:
        with _opened(path) as reader:
            yield from _messages(reader, path, topics, skip)


def read_heads(path: Path, counts: Mapping[str, int]) -> dict[str, list[Any] | DatasetError]:
    """The content of the first so many messages of each topic, or why they cannot be read; the bag is opened once.

    Opening costs: the metadata of a hundred topics take a second. Raises DatasetError if the bag cannot be opened.
    """
    heads: dict[str, list[Any] | DatasetError] = {}
    with _opened(path) as reader:
        for topic, count in counts.items():
            try:
                heads[topic] = [message.content for message in islice(_messages(reader, path, [topic]), count)]
            except DatasetError as error:
                heads[topic] = error
    return heads


def _messages(
    reader: Any, path: Path, topics: Collection[str], skip: Callable[[Message, DatasetError], None] | None = None
) -> Iterator[Message]:
    ros1 = is_ros1(path)
    types = ros_types(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    decode = types.deserialize_ros1 if ros1 else types.deserialize_cdr
    connections = [connection for connection in reader.connections if connection.topic in topics]
    for connection in connections:
        if connection.msgtype not in types.types:
            raise DatasetError(f"{path}: {connection.topic} is of the type {connection.msgtype}, which is not read")
    if not connections:
        return
    with _foreign_errors(path, "damaged or cut off"):
        for connection, recorded, raw in reader.messages(connections=connections):
            where = f"{path}: {connection.topic}, the message recorded at {recorded / 1e9:.3f} s"
            try:
                with _foreign_errors(where, "cannot be decoded"):
                    content = decode(raw, connection.msgtype)
            except DatasetError as error:
                if skip is None:
                    raise
                skip(Message(connection.topic, recorded, None), error)
                continue
            yield Message(connection.topic, recorded, content)


def _is_bag(place: Path) -> bool:
    return (is_file(place) and place.suffix in SUFFIXES) or is_file(place / "metadata.yaml")


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    path = bag_in(path)
    check_bag_files(path, DatasetError)
    if not (is_folder(path) or begins_as_a_bag(path)):
        raise DatasetError(f"{path}: exists, but is no bag: it begins as no ROS 1 bag, MCAP or SQLite file does")
    ros1 = is_ros1(path)
    try:
        with _foreign_errors(path, "cannot be opened as a bag"):
            reader: Any = (Rosbag1Reader if ros1 else Rosbag2Reader)(BagPath(path))
            reader.open()
    except DatasetError as error:
        raise DatasetError(f"{str(error).rstrip('.')}{how_to_repair(path)}") from error
    try:
        yield reader
    finally:
        with _foreign_errors(path, "cannot be closed"):
            reader.close()


@contextmanager
def _foreign_errors(where: object, what: str) -> Iterator[None]:
    """One sentence for whatever a library raises on damaged bytes: struct, sqlite, lz4, YAML and its own errors."""
    try:
        yield
    except TaskSlamError:
        raise
    except Exception as error:
        detail = " ".join(str(error).split())[:200]
        raise DatasetError(f"{where}: {what}: {detail or type(error).__name__}") from error
