"""The files of a bag, looked at before a library opens them: ordinary ones, all that the metadata names."""

from __future__ import annotations

from pathlib import Path, PosixPath
from typing import Any

from taskslam.errors import DatasetError, TaskSlamError
from taskslam.reading import is_folder, open_file
from taskslam.user_files import read_mapping

METADATA = "metadata.yaml"


class BagPath(PosixPath):
    """The path of a bag, or of a file in it, for a library that reads what a damaged length asks for."""

    def open(self, *how: Any, **named: Any) -> Any:
        """As any path, but reading bytes with bounds."""
        return open_file(self, "bag", DatasetError) if how == ("rb",) else super().open(*how, **named)


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
