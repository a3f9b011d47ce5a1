"""A ROS node as a method: `-m ros:NODE.yaml`, or `-m ros:NAME` for a node file that ships.

The node, and what its ROS is spoken with, live in the method's own process and below it, behind its wall. Every life
has a fresh node, and a simulated clock that never goes back.
"""

from __future__ import annotations

import time
from typing import ClassVar

from taskslam.errors import InputError, did_you_mean
from taskslam.measurements import NANOSECONDS, Measurement
from taskslam.robot import SensorRig
from taskslam.ros.bridge import WAITING_FROM, Bridge
from taskslam.ros.lockstep import SAME, Lockstep
from taskslam.ros.node_file import NodeFile, load_node
from taskslam.ros.notes import note
from taskslam.sensors import sensor_kind
from taskslam.slam.base import MethodCard, PoseEstimate, SlamMethod, Status


def method_of(reference: str) -> type[SlamMethod]:
    """The method that a node file describes, by its path or by the name of one that ships.

    Raises InputError: it is no node file.
    """
    file = load_node(reference)

    class Described(RosNode):
        card: ClassVar[MethodCard] = file.card()
        node: ClassVar[NodeFile] = file

    return Described


def bridge_to(file: NodeFile, rig: SensorRig) -> Bridge:
    """Start a node, and what its ROS is spoken with. Raises InputError: it cannot be, or does not fit the robot."""
    if file.ros == 1:
        from taskslam.ros.ros1.bridge import Ros1Bridge

        return Ros1Bridge(file, rig)
    from taskslam.ros.ros2.bridge import Ros2Bridge

    return Ros2Bridge(file, rig)


class RosNode(SlamMethod):
    """A node, driven in lockstep. Options: parameters of its file, by their names there, with other values."""

    node: ClassVar[NodeFile]

    def __init__(self, **options: object) -> None:
        parameters = self.node.parameters
        for name in options:
            if name not in parameters:
                raise InputError(
                    f"{self.node.name} has no option '{name}': expected one of its parameters"
                    f" ({', '.join(parameters) or 'none'}).{did_you_mean(name, parameters)}"
                )
        self._file = self.node.with_parameters(options)
        self._bridge: Bridge | None = None

    def start(self, rig: SensorRig) -> None:
        """Start the node, and wait until it is connected. Raises InputError: it will not, in words."""
        self._bridge = bridge_to(self._file, rig)
        self._lockstep = Lockstep(self._bridge, self._file.rules, WAITING_FROM)
        self._bridge.shake_hands(self._lockstep)
        self._awaited = self._file.awaited
        self._period = round(NANOSECONDS / sensor_kind(self._awaited).part_of(rig).rate)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """Tell the node; the live pose that it answers to a frame, or None."""
        assert self._bridge is not None
        said = self._bridge.utterance(measurement)
        if measurement.sensor != self._awaited:
            self._lockstep.stream(said)
            return None
        answer = self._lockstep.frame(said, said.bears, measurement.stamp + self._period)
        if answer is None or said.bears < 0:  # the first ray of a scan at t = 0 was taken before it
            return None
        stamp = said.bears if abs(answer.stamp - said.bears) <= SAME else answer.stamp
        return PoseEstimate(stamp, answer.pose, Status.TRACKING, answer.covariance)

    def processor_time(self) -> int:
        """Ours and the node's, ns."""
        theirs = self._bridge.processor_time() if self._bridge else 0
        return time.process_time_ns() + theirs

    def stop(self) -> None:
        """End the node; what is to be said of it goes into the log."""
        if self._bridge is None:
            return
        note(str(self._lockstep.counts))
        for words in self._bridge.findings():
            note(words)
        self._bridge.close()
