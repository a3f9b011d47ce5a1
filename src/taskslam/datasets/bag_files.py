"""The files of a bag, looked at before a library opens them: ordinary ones, all that the metadata names."""

from __future__ import annotations

from pathlib import Path, PosixPath
from typing import Any

from taskslam.errors import DatasetError, TaskSlamError
from taskslam.reading import is_file, is_folder, open_file
from taskslam.user_files import read_mapping

METADATA = "metadata.yaml"
SUFFIXES = (".bag", ".mcap", ".db3")
_ROS1, _MCAP, _SQLITE = b"#ROSBAG V2.0", b"\x89MCAP0\r\n", b"SQLite format 3"


class BagPath(PosixPath):
    """The path of a bag, or of a file in it, for a library that reads what a damaged length asks for."""

    def open(self, *how: Any, **named: Any) -> Any:
        """As any path, but reading bytes with bounds."""
        return open_file(self, "bag", DatasetError) if how == ("rb",) else super().open(*how, **named)


def is_ros1(path: Path) -> bool:
    """Whether this is a ROS 1 bag, by its first bytes; a name says nothing: folders of ROS 2 may end in .bag."""
    if is_folder(path):
        return False
    with open_file(path, "bag", DatasetError) as file:
        return file.read(len(_ROS1)) == _ROS1


def begins_as_a_bag(path: Path) -> bool:
    """Whether a file begins as a recording of some kind does."""
    with open_file(path, "bag", DatasetError) as file:
        return file.read(16).startswith((_ROS1, _MCAP, _SQLITE))


def bag_in(path: Path) -> Path:
    """What to open: a file, a ROS 2 folder, or the only recording in a folder without metadata."""
    if not is_folder(path) or is_file(path / METADATA):
        return path
    inside = [file for file in sorted(path.iterdir()) if file.suffix.lower() in SUFFIXES and is_file(file)]
    return inside[0] if len(inside) == 1 else path


def how_to_repair(path: Path) -> str:
    """The command that mends a recording which was cut off or has no index; empty for a folder."""
    if is_folder(path):
        return ""
    with open_file(path, "bag", DatasetError) as file:
        magic = file.read(16)
    if magic.startswith(_ROS1):
        return f"; rosbag reindex {path.name} mends it"
    if magic.startswith(_MCAP):
        return f"; mcap recover {path.name} -o mended.mcap mends it"
    return f"; ros2 bag reindex {path.parent.name or '.'} mends it"


def check_bag_files(path: Path, error: type[TaskSlamError]) -> None:
    """A bag's file, or the folder of a ROS 2 bag. A recording may be of any size, so sizes are not looked at.

    Raises `error`: a file is missing, or is a pipe or a device; the metadata are no YAML of at most 1 MB.
    """
    if not is_folder(path):
        open_file(path, "bag", error).close()
        return
    content = read_mapping(path / METADATA, "metadata of the bag", error, "the key rosbag2_bagfile_information")
    information = content.get("rosbag2_bagfile_information")
    names = information.get("relative_file_paths") if isinstance(information, dict) else None
    for name in names if isinstance(names, list) else ():
        open_file(path / str(name), "bag", error).close()
