"""ROS 2 through bridge processes: what one says, another hears; services, parameters, and what is refused, in words."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.errors import InputError
from taskslam.ros.errors import RosError
from taskslam.ros.process import processor_time, session_of
from taskslam.ros.qos import LATCHED, Quality
from taskslam.ros.ros2.client import Ros2
from taskslam.ros.ros2.domain import Domain, abandoned

PEERS = Path(__file__).parents[1] / "peers"
IMAGE, SCAN, CLOUD = (f"sensor_msgs/msg/{name}" for name in ("Image", "LaserScan", "PointCloud2"))
TEXT = "std_msgs/msg/String"
BEST_EFFORT = Quality(reliability="best_effort")


@pytest.fixture(scope="module")
def domain(ros2, tmp_path_factory):
    held = Domain(tmp_path_factory.mktemp("domain"))
    yield held
    held.close()


@pytest.fixture(scope="module")
def pair(domain):
    """Two bridges in one domain."""
    bridges = [Ros2(name, None, domain.variables) for name in ("talker", "listener")]
    yield bridges
    for bridge in bridges:
        bridge.close()


def messages_of(store, load, count):
    encoder = RosEncoder(store)
    noise = np.random.default_rng(3).integers(0, 256, (480, 752), np.uint8)
    for number in range(count):
        if load == "image":
            yield encoder.image(number, "camera", np.roll(noise, number))
        elif load == "scan":
            yield encoder.new(
                SCAN, header=encoder.header(number, "laser"), angle_min=-1.0, angle_max=1.0, angle_increment=0.1,
                time_increment=0.0, scan_time=0.1, range_min=0.1, range_max=10.0,
                ranges=np.full(640, number % 97, np.float32), intensities=np.empty(0, np.float32),
            )  # fmt: skip
        else:
            yield encoder.new(
                CLOUD, header=encoder.header(number, "lidar"), height=1, width=28_800, fields=[], is_bigendian=False,
                point_step=22, row_step=28_800 * 22, data=np.full(28_800 * 22, number % 251, np.uint8), is_dense=True,
            )  # fmt: skip


@pytest.mark.parametrize("quality", [Quality(), BEST_EFFORT], ids=["reliable", "best effort"])
@pytest.mark.parametrize(("load", "kind"), [("scan", SCAN), ("image", IMAGE), ("cloud", CLOUD)])
def test_what_one_says_the_other_hears(pair, eventually, load, kind, quality):
    """In lockstep, as a method's node is spoken to: nothing is lost, whatever the quality, and bytes stay the same."""
    talker, listener = pair
    topic, heard = f"/{load}_{quality.reliability}", []
    subscription = listener.subscribe(topic, kind, quality, heard.append)
    publication = talker.advertise(topic, kind, quality)
    eventually(lambda: talker.matched(publication.number) and listener.matched(subscription))
    sent = list(messages_of(talker.store, load, 20))
    for number, message in enumerate(sent):
        publication.publish(message)
        eventually(lambda n=number: len(heard) == n + 1)
    assert [bytes(talker.store.serialize_cdr(message, kind)) for message in sent] == heard
    assert listener.decode(kind, heard[-1]).header.stamp.nanosec == 19
    talker.withdraw(publication.number)
    listener.withdraw(subscription)


def test_who_comes_late_gets_what_is_latched(pair, eventually):
    talker, listener = pair
    publication = talker.advertise("/latched", TEXT, LATCHED)
    publication.publish(talker.store.types[TEXT]("before"))
    heard = []
    listener.subscribe("/latched", TEXT, LATCHED, lambda data: heard.append(listener.decode(TEXT, data).data))
    eventually(lambda: heard == ["before"])


def test_who_does_what_is_seen_with_its_quality(pair, eventually):
    talker, listener = pair
    talker.advertise("/seen", TEXT, BEST_EFFORT)
    listener.subscribe("/seen", TEXT, Quality(), lambda _: None)
    eventually(lambda: "/seen" in listener.graph().publishers and "/seen" in talker.graph().subscribers)
    (end,) = listener.graph().publishers["/seen"]
    assert (end.node, end.type, end.quality.reliability) == ("/talker", TEXT, "best_effort")
    assert {"/talker", "/listener"} <= set(talker.graph().nodes)


def test_what_cannot_be_is_said_and_the_bridge_lives_on(pair):
    talker, _ = pair
    with pytest.raises(RosError, match="has no type my_msgs/msg/Nothing"):
        talker.advertise("/x", "my_msgs/msg/Nothing", Quality())
    with pytest.raises(RosError, match="nobody offers the service /none"):
        talker.call("/none", "std_srvs/srv/Trigger", within_s=0.2)
    with pytest.raises(RosError, match="there is no 'dance' to do"):
        talker._ask("dance")
    with pytest.raises(RosError, match="not a std_msgs/msg/String"):
        talker.decode(TEXT, b"\0\1\0\0\xff\xff\xff\xff")
    talker._say({"do": "publish", "id": 9999}, b"x")
    assert "/talker" in talker.graph().nodes
    assert talker.complaints == ["publish: 9999"]


def test_services_and_parameters_of_others_as_plain_values(pair, domain, eventually):
    talker, _ = pair
    words = [sys.executable, str(PEERS / "rclpy_node.py"), "--ros-args", "-r", "__node:=peer", "-p", "rate:=2.5"]
    with subprocess.Popen(words, env=os.environ | domain.variables, stdout=subprocess.PIPE, text=True) as node:
        try:
            assert node.stdout.readline() == "whole 1 rate 2.5\n"
            assert talker.call("/reset", "std_srvs/srv/Empty") == {}
            asked = {"names": ["rate", "odom_frame"]}
            told = talker.call("/peer/get_parameters", "rcl_interfaces/srv/GetParameters", asked)
            assert [value["type"] for value in told["values"]] == [3, 4]
            assert told["values"][0]["double_value"] == 2.5
            value = {"type": 3, "double_value": 7}
            change = {"parameters": [{"name": "rate", "value": value}, {"name": "whole", "value": value}]}
            results = talker.call("/peer/set_parameters", "rcl_interfaces/srv/SetParameters", change)["results"]
            assert [result["successful"] for result in results] == [True, False]
            with pytest.raises(RosError, match=r"has no field 'name'; expected some of names"):
                talker.call("/peer/get_parameters", "rcl_interfaces/srv/GetParameters", {"name": "x"})
        finally:
            node.send_signal(signal.SIGINT)


def test_a_bridge_that_is_killed_is_told_and_another_domain_hears_nothing(ros2, tmp_path, pair):
    with pytest.raises(InputError, match="there is no such file"):
        Ros2("x", str(tmp_path / "setup.bash"), {})
    before, other = abandoned(), Domain(tmp_path)
    try:
        alone = Ros2("alone", None, other.variables)
        assert set(alone.graph().nodes) == {"/alone"}
        os.killpg(alone._process.pid, signal.SIGKILL)
        with pytest.raises(RosError, match="the bridge to ROS 2 has ended"):
            alone.graph()
        alone.close()
        left = abandoned() - before
        assert left
    finally:
        other.close()
    assert not left & abandoned()
    assert set(pair[0].graph().nodes) == {"/talker", "/listener"}


def test_work_is_counted_of_all_that_a_node_starts():
    """By its session: the shell here does nothing itself."""
    words = ["bash", "-c", f"{sys.executable} -c 'import time\nwhile time.process_time() < 0.2: pass\ninput()'; true"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, start_new_session=True) as shell:
        deadline = time.monotonic() + 20.0
        while len(session_of(shell.pid)) < 2 or processor_time(session_of(shell.pid)) < 0.2e9:
            assert time.monotonic() < deadline
        assert processor_time([shell.pid]) < 0.1e9
        shell.communicate(b"\n")
    assert session_of(shell.pid) == []


def test_a_domain_with_a_port_that_is_taken_is_passed_over(tmp_path, monkeypatch):
    """Two numbers of a range of our own, so that nobody else is kept from theirs."""
    monkeypatch.setattr("taskslam.ros.ros2.domain._NUMBERS", (98, 99))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as somebody:
        somebody.bind(("", 7400 + 250 * 98))
        held = Domain(tmp_path)
        assert held.number == 99
        with pytest.raises(InputError, match="no domain of ROS 2 is free on this machine: 2 are in use"):
            Domain(tmp_path)
    held.close()


def test_a_shared_memory_that_is_full_is_refused_before_anybody_is_killed_by_it(tmp_path):
    """In a mount of its own, of 8 MB."""
    alone = ["unshare", "--user", "--map-root-user", "--mount"]
    if subprocess.run([*alone, "true"], check=False).returncode:
        pytest.skip("needs namespaces of users and mounts, which this kernel does not give")
    script = (
        "from pathlib import Path\nfrom taskslam.errors import InputError\n"
        "from taskslam.ros.ros2.domain import Domain\n"
        f"try: Domain(Path({str(tmp_path)!r}))\nexcept InputError as error: print(error)"
    )
    command = f'mount -t tmpfs -o size=8m none /dev/shm && exec {sys.executable} -c "$0"'
    said = subprocess.run([*alone, "bash", "-c", command, script], capture_output=True, text=True, check=True).stdout
    assert said.startswith("/dev/shm has 8 MB left; expected 192 for a ROS 2 node and its bridge")


def test_no_two_runs_have_the_same_domain(tmp_path):
    held = [Domain(tmp_path) for _ in range(20)]
    assert len({domain.number for domain in held}) == 20
    for domain in held:
        domain.close()
