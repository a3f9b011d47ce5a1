"""What the door for ROS nodes costs: a frame to a node and its answer back, and what is lost on the way.

    python benchmarks/ros_round_trip.py [--frames 1000] [--pairs 10000] [--ros 1] [--ros 2]

The node is a process of its own that looks at no pixel: it answers a frame once all its messages are there. Then the
same through the whole method (its process, the wall, the pipe), beside a method that answers at once without any ROS.
p50 and p99 of the wall time, ms. A frame counts as lost if its answer did not come within ten seconds.
"""

from __future__ import annotations

import argparse
import os
import signal
import struct
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rosbags.typesys import Stores
from rosbags.typesys.store import Typestore

from common import machine_line
from taskslam.datasets.bag_access import ros_types
from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan, Measurement, PointCloud, Sensor, StereoImages
from taskslam.robot import SensorRig, load_robot
from taskslam.ros.bridge import WAITING_FROM
from taskslam.ros.lockstep import Lockstep
from taskslam.ros.method import bridge_to
from taskslam.ros.node_file import load_node
from taskslam.ros.ros1.node import Node
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel

TOPICS = {
    Sensor.LASER_SCAN: {"/scan": "sensor_msgs/LaserScan"},
    Sensor.POINT_CLOUD: {"/velodyne_points": "sensor_msgs/PointCloud2"},
    Sensor.STEREO_IMAGES: {
        "/stereo/left/image_rect": "sensor_msgs/Image",
        "/stereo/right/image_rect": "sensor_msgs/Image",
    },
}
WAYS = ((1, ""), (2, "reliable"), (2, "best_effort"))
_STAMP = struct.Struct("<II")
_BEFORE = 4  # bytes of a message before its stamp: the header's number, or how CDR is encoded


class Echo(SlamMethod):
    """Answers every frame at once, without ROS."""

    def start(self, rig: SensorRig) -> None:
        """Nothing to prepare."""

    def feed(self, measurement: Measurement) -> PoseEstimate:
        """The origin."""
        return PoseEstimate(measurement.stamp, np.eye(4), Status.TRACKING)


class EchoScan(Echo):
    """To every scan."""

    card = MethodCard("echo", "1", "Apache-2.0", Kind.ODOMETRY, (Sensor.LASER_SCAN,))


class EchoCloud(Echo):
    """To every cloud."""

    card = MethodCard("echo", "1", "Apache-2.0", Kind.ODOMETRY, (Sensor.POINT_CLOUD,))


class EchoStereo(Echo):
    """To every stereo pair."""

    card = MethodCard("echo", "1", "Apache-2.0", Kind.ODOMETRY, (Sensor.STEREO_IMAGES,))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--pairs", type=int, default=10_000, help="of the stereo camera, for what is lost")
    parser.add_argument("--ros", type=int, action="append", choices=(1, 2), help="once for each; both without it")
    asked = parser.parse_args()
    rig = load_robot("turtlebot2").rig
    loads = {
        "scan of 640 rays": (a_scan(640), "EchoScan"),
        "cloud of 28,800 points": (a_cloud(28_800), "EchoCloud"),
        "stereo 752x480": (a_pair(rig), "EchoStereo"),
    }
    print(machine_line())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for words, (make, echo) in loads.items():
            without = through_host(f"ros_round_trip:{echo}", None, rig, make, asked.frames, folder)
            print(f"{words:24} method without ROS   {shown(without)}")
            for ros, quality in WAYS:
                if ros in (asked.ros or (1, 2)):
                    file = node_file(folder, make(0).sensor, ros, quality)
                    counts, wall = through_bridge(file, rig, make, asked.frames)
                    way = f"ROS {ros} {quality}"
                    print(f"{words:24} node, {way:17} {shown(wall)}; {counts.missing} of {counts.frames} lost")
                    wall = through_host(f"ros:{file}", file, rig, make, asked.frames, folder)
                    print(f"{words:24} method, {way:15} {shown(wall)}")
        words, (make, _) = list(loads.items())[-1]
        for ros, quality in WAYS:
            if ros in (asked.ros or (1, 2)):
                counts, wall = through_bridge(node_file(folder, make(0).sensor, ros, quality), rig, make, asked.pairs)
                print(f"{words:24} ROS {ros} {quality}: {counts.missing} of {counts.frames} lost, node {shown(wall)}")


def a_scan(rays: int) -> Callable[[int], Measurement]:
    ranges = np.full(rays, 2.0, np.float32)
    return lambda n: LaserScan(n * 100_000_000, ranges, -1.0, 2.0 / rays, 0.1, 10.0)


def a_cloud(size: int) -> Callable[[int], Measurement]:
    points = np.ones((size, 3), np.float32)
    ring, offset = np.zeros(size, np.uint16), np.zeros(size, np.int32)
    return lambda n: PointCloud(n * 100_000_000, points, ring, offset)


def a_pair(rig: SensorRig) -> Callable[[int], Measurement]:
    assert rig.stereo is not None
    size = (rig.stereo.height, rig.stereo.width)
    left, right = (np.random.default_rng(eye).integers(0, 256, size, dtype=np.uint8) for eye in (0, 1))
    return lambda n: StereoImages(n * 33_333_333, left, right)


def node_file(folder: Path, sensor: Sensor, ros: int, quality: str) -> Path:
    source = Path(__file__).parents[1] / "src"
    file = folder / f"{sensor}{ros}{quality}.yaml"
    content = {
        "name": "echo",
        "ros": ros,
        "command": f"{sys.executable} {Path(__file__).absolute()} --echo={sensor}",
        "environment": {"PYTHONPATH": f"{source}:{Path(__file__).parent.absolute()}", "QUALITY": quality},
        "needs": {"reads": [str(source), sys.prefix]},
        "sensors": [str(sensor)],
        "answer": {"topic": "/pose", "type": "geometry_msgs/PoseStamped"},
        "latency": 0.0,
    }
    if ros == 2:
        content["qos"] = {topic: {"reliability": quality} for topic in TOPICS[sensor]}
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return file


def through_bridge(file: Path, rig: SensorRig, make: Callable[[int], Measurement], frames: int):  # type: ignore[no-untyped-def]
    node, wall = load_node(file), []
    bridge = bridge_to(node, rig)
    try:
        lockstep = Lockstep(bridge, node.rules, WAITING_FROM)
        bridge.shake_hands(lockstep)
        period = make(1).stamp
        for n in range(frames):
            began = time.perf_counter()
            said = bridge.utterance(make(n))
            lockstep.frame(said, said.bears, said.stamp + period)
            wall.append(time.perf_counter() - began)
        return lockstep.counts, wall
    finally:
        bridge.close()


def through_host(
    method: str, file: Path | None, rig: SensorRig, make: Callable[[int], Measurement], frames: int, folder: Path
) -> list[float]:
    wall = []
    (logs := folder / "logs").mkdir(exist_ok=True)
    card = load_node(file).card() if file else None
    with MethodHost(method, {}, rig, logs / "method.log", LatencyModel(LatencyMode.ZERO), described=card) as host:
        for n in range(frames):
            measurement = make(n)
            began = time.perf_counter()
            host.feed(measurement)
            host.collect(measurement.stamp)
            wall.append(time.perf_counter() - began)
    return wall


def shown(wall: list[float]) -> str:
    low, high = np.percentile(np.array(wall[len(wall) // 20 :]) * 1e3, [50, 99])
    return f"p50 {low:6.2f} ms, p99 {high:6.2f} ms"


class EchoNode:
    """The node's rule: a pose at the origin for every stamp that all messages of a frame have come with.

    store: of its messages; publish: told the pose.
    """

    def __init__(self, store: Typestore, topics: int, publish: Callable[[Any], None]) -> None:
        self._encoder, self._topics, self._publish = RosEncoder(store), topics, publish
        self._seen = Counter[bytes]()
        self._pose = self._encoder.odometry(0, "map", SE2(), 0.0, 0.0).pose.pose

    def take(self, data: bytes | bytearray) -> None:
        """A message of any of its topics."""
        stamp = bytes(data[_BEFORE : _BEFORE + _STAMP.size])
        self._seen[stamp] += 1
        if self._seen[stamp] == self._topics:
            del self._seen[stamp]
            seconds, rest = _STAMP.unpack(stamp)
            header = self._encoder.header(seconds * NANOSECONDS + rest, "map")
            self._publish(self._encoder.new("geometry_msgs/msg/PoseStamped", header=header, pose=self._pose))


def echo1(topics: Mapping[str, str]) -> None:
    node = Node("/echo", os.environ["ROS_MASTER_URI"])
    answer = node.advertise("/pose", "geometry_msgs/PoseStamped")
    rule = EchoNode(node.store, len(topics), answer.publish)
    for topic, kind in topics.items():
        node.subscribe(topic, kind, lambda _, data: rule.take(data))
    signal.pause()


def echo2(topics: Mapping[str, str]) -> None:
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs import msg as sensors

    rclpy.init(args=sys.argv)
    node, store = rclpy.create_node("echo"), ros_types(Stores.ROS2_KILTED)
    answer = node.create_publisher(PoseStamped, "/pose", 10)
    kind = "geometry_msgs/msg/PoseStamped"
    rule = EchoNode(store, len(topics), lambda pose: answer.publish(bytes(store.serialize_cdr(pose, kind))))
    quality = QoSProfile(depth=10, reliability=ReliabilityPolicy[os.environ["QUALITY"].upper()])
    for topic, short in topics.items():
        node.create_subscription(getattr(sensors, short.partition("/")[2]), topic, rule.take, quality, raw=True)
    rclpy.spin(node)


if __name__ == "__main__":
    if sys.argv[1:] and sys.argv[1].startswith("--echo="):
        topics = TOPICS[Sensor(sys.argv[1].partition("=")[2])]
        with suppress(KeyboardInterrupt):
            (echo1 if "ROS_MASTER_URI" in os.environ else echo2)(topics)
    else:
        main()
