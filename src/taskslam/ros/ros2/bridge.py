"""Between the rules of lockstep and a ROS 2 node: a bridge process in a domain of its own, and the foreign process.

Discovery has two directions: that we see a node does not say that it sees us. A node is connected once a service of its
own, its parameters', has answered a client that we made after all our topics: who knows of the last knows of all.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
from rosbags.typesys import Stores

from taskslam.datasets.bag_access import ros_types
from taskslam.errors import InputError, did_you_mean
from taskslam.robot import SensorRig
from taskslam.ros.bridge import CLOCK_TYPE, ROSOUT, TF_TYPE, US, Bridge, View
from taskslam.ros.errors import RosError
from taskslam.ros.node_file import CLOCK, TF, TF_STATIC, NodeFile
from taskslam.ros.process import NodeProcess, session_of
from taskslam.ros.qos import LATCHED, Quality, mismatch
from taskslam.ros.ros2.client import End, Graph, Publication, Ros2
from taskslam.ros.ros2.domain import Domain
from taskslam.slam.base import StalledError

_US = f"/{US}"
_LOG_TYPE = "rcl_interfaces/msg/Log"
_WARN = 30  # rcl_interfaces/Log
_HANDSHAKE_S = 0.5
_CLOCK_DEPTH = 10
_KINDS = ("not set", "a truth value", "an int", "a double", "text", "bytes")  # rcl_interfaces/ParameterType
_LISTS = ("bytes", "truth values", "ints", "doubles", "texts")


class Ros2Bridge(Bridge):
    """One life of a ROS 2 node. Raises InputError: it cannot be started, or its file does not fit the robot."""

    def __init__(self, node: NodeFile, rig: SensorRig) -> None:
        super().__init__(node, rig, ros_types(Stores.ROS2_KILTED))
        self._ros: Ros2 | None = None
        self._domain: Domain | None = None
        self._known: set[str] = set()  # nodes that have answered us
        self._folder = TemporaryDirectory(prefix="ros2-", ignore_cleanup_errors=True)
        try:
            self._domain = Domain(Path(self._folder.name))
            self._setup = node.beside(node.setup) if node.setup else None
            self._ros = Ros2(US, self._setup, {**node.environment, **self._domain.variables})
            self._open_topics(self._ros)
            self._process = self._started(self._ros, self._domain)
        except RosError as error:
            self.close()
            raise InputError(str(error)) from error
        except BaseException:
            self.close()
            raise
