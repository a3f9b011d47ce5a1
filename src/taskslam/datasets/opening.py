"""Opening a recording by what it is: an EuRoC/ASL folder, a ROS 1 bag, a ROS 2 bag or an MCAP."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from taskslam.datasets.bag import Bag
from taskslam.datasets.bag_access import bag_file
from taskslam.datasets.dataset import Dataset
from taskslam.datasets.euroc_folder import EurocFolder, is_euroc
from taskslam.errors import DatasetError
from taskslam.reading import is_folder, is_there
from taskslam.robot import Robot


def open_dataset(
    path: Path,
    robot: Robot | None = None,
    topics: Mapping[str, str] | None = None,
    base_frame: str | None = None,
    mounts: Mapping[str, str] | None = None,
) -> Dataset:
    """The dataset at `path`, ready to be replayed.

    robot: whose rig the recording is of, where the recording itself does not say it. topics: sensor to topic;
    base_frame, and mounts (frame to `x,y,z,roll,pitch,yaw`): see `Bag`; only bags have them.

    Raises:
        DatasetError: no such path, no known form, or damaged.
    """
    if not is_there(path):
        raise DatasetError(f"{path}: no such file or folder; expected an EuRoC folder, a .bag, an .mcap or a ROS 2 bag")
    if is_euroc(path):
        if topics or base_frame or mounts:
            raise DatasetError(f"{path}: an EuRoC folder has no topics or frames to name")
        return EurocFolder(path, robot)
    bag = Bag(bag_file(path), robot, topics or {}, base_frame, mounts or {})
    if is_folder(path):
        bag.name = path.resolve().name
    return bag
