"""Peers: Debian's own ROS 1 (rospy, rosmaster, roscpp), ROS 2 from wheels, and nodes that are written for the tests."""

from __future__ import annotations

import importlib.util
import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from small_tour import write_tour
from taskslam.measurements import NANOSECONDS, Measurement, Sensor
from taskslam.processes.guest import Limits
from taskslam.robot import SensorRig, load_robot
from taskslam.ros.bridge import WAITING_FROM
from taskslam.ros.lockstep import Lockstep
from taskslam.ros.method import bridge_to
from taskslam.ros.node_file import NodeFile, load_node
from taskslam.ros.ros1.master import Master
from taskslam.ros.ros1.node import Node
from taskslam.ros.ros2.messages import make_messages
from taskslam.slam.base import PoseEstimate
from taskslam.slam.conformance.drive import ConformanceDrive
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel

PEERS = Path(__file__).parent / "peers"
PACKAGES = (Path(__file__).parent / "debian_packages.txt").read_text().split()
SENSORS = frozenset({Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY})
ZERO = LatencyModel(LatencyMode.ZERO)
PYTHON = "/usr/bin/python3"  # Debian's, which has rospy


def absent(what: str, how: str = f"apt install --no-install-recommends {' '.join(PACKAGES)}") -> None:
    """Skip where a ROS is not installed; in CI it must be."""
    words = f"needs {what}: {how}"
    if os.environ.get("CI") == "true":
        pytest.fail(words)
    pytest.skip(words)


@pytest.fixture(scope="session")
def peers() -> Path:
    """Where programs lie that are written for the tests."""
    return PEERS


@pytest.fixture
def world_file(tmp_path: Path) -> Path:
    """A scenario's file: two goals in a room of 6 m with nothing in it."""
    return write_tour(tmp_path, [[0.4, 0.0, 0.0], [0.4, 0.3, 1.5]], "rounds: 1, pause: 0.5, still_start: 0.5")


@pytest.fixture(scope="session")
def rig() -> SensorRig:
    return load_robot("turtlebot2").rig


@pytest.fixture(scope="session")
def debian_python() -> str:
    """An interpreter with rospy and rosmaster."""
    command = [PYTHON, "-c", "import rospy, rosmaster, sensor_msgs.msg, std_srvs.srv"]
    if not Path(PYTHON).exists() or subprocess.run(command, capture_output=True, check=False).returncode:
        absent("Debian's rospy and rosmaster")
    return PYTHON


@pytest.fixture(scope="session")
def ros2() -> None:
    """Our own interpreter has the wheels of ROS 2."""
    if importlib.util.find_spec("rclpy") is None or importlib.util.find_spec("rmw_fastrtps_cpp") is None:
        absent("the wheels of ROS 2", "pip install 'taskslam[ros2]'")


@pytest.fixture(scope="session")
def ros2_messages(ros2: None, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The setup script of the wheels with the types that they lack."""
    if shutil.which("g++") is None:
        absent("g++ and Python's headers")
    return str(make_messages(tmp_path_factory.mktemp("messages") / "ros2"))


@pytest.fixture(scope="session")
def rate_node(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`peers/rate_node.cpp`, compiled against Debian's roscpp."""
    packages = ["roscpp", "sensor_msgs", "geometry_msgs", "tf2_msgs", "std_srvs"]
    if shutil.which("g++") is None or shutil.which("pkg-config") is None:
        absent("g++ and pkg-config")
    found = subprocess.run(["pkg-config", "--cflags", "--libs", *packages], capture_output=True, text=True, check=False)
    if found.returncode:
        absent("Debian's roscpp")
    binary = tmp_path_factory.mktemp("rate_node") / "rate_node"
    source = str(PEERS / "rate_node.cpp")
    command = ["g++", "-O0", "-w", "-o", str(binary), source, *shlex.split(found.stdout), "-pthread"]
    subprocess.run(command, check=True, timeout=300)
    return binary


@pytest.fixture
def master() -> Iterator[Master]:
    """Ours."""
    ours = Master()
    yield ours
    ours.close()


@pytest.fixture
def make_node() -> Iterator[Callable[[str, str], Node]]:
    """Nodes of ours under any master, closed in the end."""
    made: list[Node] = []

    def make(name: str, uri: str, patience_s: float = 10.0) -> Node:
        made.append(Node(name, uri, patience_s))
        return made[-1]

    yield make
    for node in made:
        node.close()


@pytest.fixture
def run_peer(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Programs of Debian's Python under a master, killed in the end."""
    started: list[subprocess.Popen[str]] = []

    def run(uri: str, *words: str) -> subprocess.Popen[str]:
        environment = {
            "PATH": os.defpath, "ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "HOME": str(tmp_path),
            "ROS_LOG_DIR": str(tmp_path / "log"), "PYTHONUNBUFFERED": "1",
        }  # fmt: skip
        started.append(subprocess.Popen([PYTHON, *words], env=environment, stdout=subprocess.PIPE, text=True))
        return started[-1]

    yield run
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def write_node(tmp_path: Path) -> Callable[..., Path]:
    """Writes node files: that of the rate node, with other values where they are given."""

    def write(binary: Path | str, **changes: Any) -> Path:
        folder = tmp_path / "node"
        folder.mkdir(exist_ok=True)
        content = {
            "name": "rate_node",
            "command": str(binary),
            "sensors": ["laser_scan", "wheel_odometry"],
            "frames": {"base_footprint": "base_link"},
            "answer": {"topic": "/pose", "type": "geometry_msgs/PoseWithCovarianceStamped", "world": "map"},
            "start": 20.0,
            "latency": 0.0,
            "repeats": True,
            **changes,
        }
        file = folder / f"node{len(list(folder.iterdir()))}.yaml"
        file.write_text(yaml.safe_dump({key: value for key, value in content.items() if value is not None}))
        return file

    return write


@pytest.fixture
def host_of(rig: SensorRig, tmp_path: Path) -> Iterator[Callable[..., MethodHost]]:
    """Hosts of node files or other methods, stopped in the end."""
    hosts: list[MethodHost] = []

    def make(method: Path | str, latency: LatencyModel = ZERO, options: dict[str, Any] | None = None) -> MethodHost:
        card = load_node(method).card() if isinstance(method, Path) else None
        name = f"ros:{method}" if isinstance(method, Path) else method
        folder = tmp_path / f"run{len(hosts)}"
        folder.mkdir()
        limits = Limits(frame_timeout_s=20.0)
        hosts.append(MethodHost(name, options or {}, rig, folder / "method.log", latency, limits, described=card))
        return hosts[-1]

    yield make
    for host in hosts:
        host.stop()


@pytest.fixture(scope="session")
def drive() -> Callable[..., list[PoseEstimate]]:
    """`drive(host, rig, seconds)`: the estimates of a drive."""

    def estimates_of(
        host: MethodHost,
        rig: SensorRig,
        seconds: float = 3.0,
        begin: float = 0.0,
        each: Callable[[Measurement], object] = lambda measurement: None,
    ) -> list[PoseEstimate]:
        estimates: list[PoseEstimate] = []
        for measurement in ConformanceDrive(rig, 0.2, sensors=SENSORS).measurements(
            round(begin * NANOSECONDS), round((begin + seconds) * NANOSECONDS)
        ):
            each(measurement)
            host.feed(measurement)
            estimates += host.collect(measurement.stamp)
        return estimates

    return estimates_of


@pytest.fixture(scope="session")
def connect() -> Callable[[NodeFile, SensorRig], None]:
    """`connect(file, rig)`: start a node and shake hands, without a process of its own for the method."""

    def connected(file: NodeFile, rig: SensorRig) -> None:
        bridge = bridge_to(file, rig)
        try:
            bridge.shake_hands(Lockstep(bridge, file.rules, WAITING_FROM))
        finally:
            bridge.close()

    return connected


def _eventually(holds: Callable[[], Any], within_s: float = 15.0) -> Any:
    """What `holds` returns as soon as that is true."""
    deadline = time.monotonic() + within_s
    while not (found := holds()):
        assert time.monotonic() < deadline, "it never came to hold"
        time.sleep(0.01)
    return found


@pytest.fixture(scope="session")
def eventually() -> Callable[..., Any]:
    """`eventually(holds)` waits until that is true."""
    return _eventually
