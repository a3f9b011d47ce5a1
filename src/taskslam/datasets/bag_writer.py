"""Writing a ROS 1 bag, a ROS 2 bag (sqlite) or an MCAP of what the sensors of a robot said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores

from taskslam.datasets.bag_access import ros_types
from taskslam.datasets.bag_sensor import frames_of, messages_of
from taskslam.datasets.ros_encoding import ALWAYS, RosEncoder, Said
from taskslam.errors import DatasetError
from taskslam.geometry import SE2
from taskslam.measurements import Measurement, Sensor
from taskslam.robot import Robot
from taskslam.sensors import fitted


class BagWriter:
    """Writes one bag into `folder`: for ROS 1 the file NAME.bag, for ROS 2 the folder NAME."""

    def __init__(self, folder: Path, name: str, form: str, robot: Robot, sensors: frozenset[Sensor]) -> None:
        """Begin; form: `rosbag1`, `rosbag2` or `mcap`."""
        self._store = ros_types(Stores.ROS1_NOETIC if form == "rosbag1" else Stores.ROS2_HUMBLE)
        self._writer: Any
        if form == "rosbag1":
            self._writer = Rosbag1Writer(folder / f"{name}.bag")
            self._serialize = self._store.serialize_ros1
        else:
            plugin = StoragePlugin.MCAP if form == "mcap" else StoragePlugin.SQLITE3
            self._writer = Rosbag2Writer(folder / name, version=8, storage_plugin=plugin)
            self._serialize = self._store.serialize_cdr
        self._writer.open()
        kinds = [kind for sensor, kind in fitted(robot.rig).items() if sensor in sensors]
        if unknown := [kind.sensor for kind in kinds if not kind.bag]:
            raise DatasetError(f"nobody says how a bag holds {', '.join(unknown)}; leave it out (--sensors)")
        topics = [*ALWAYS, *((topic.name, topic.kind) for kind in kinds for topic in kind.topics)]
        self._connections = {
            topic: self._writer.add_connection(topic, kind, typestore=self._store) for topic, kind in topics
        }
        self._encoder = RosEncoder(self._store)
        self._robot = robot
        self._opened = False

    def measurement(self, measurement: Measurement) -> None:
        """Write one measurement."""
        self._open(measurement.stamp)
        for said in messages_of(self._encoder, self._robot.rig, measurement):
            self._say(said)

    def truth(self, stamp: int, pose: SE2) -> None:
        """Write the true pose of an instant (ns)."""
        self._open(stamp)
        self._say(self._encoder.truth(stamp, pose))

    def close(self) -> None:
        """Write indices and close."""
        self._writer.close()

    def _open(self, stamp: int) -> None:
        if not self._opened:
            self._opened = True
            for said in self._encoder.opening(stamp, frames_of(self._robot.rig), self._robot):
                self._say(said)

    def _say(self, said: Said) -> None:
        topic, stamp, message = said
        self._writer.write(self._connections[topic], stamp, self._serialize(message, message.__msgtype__))
