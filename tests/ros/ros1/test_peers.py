"""Our ROS 1 against itself, under Debian's rosmaster, and with Debian's rospy on the other end."""

import json
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.ros.errors import RosError
from taskslam.ros.ros1.master import Master
from taskslam.ros.ros1.node import SlowSubscriberError
from taskslam.ros.ros1.xmlrpc import call

PEERS = Path(__file__).parents[1] / "peers"
SCAN, IMAGE, TEXT = "sensor_msgs/LaserScan", "sensor_msgs/Image", "std_msgs/String"


def scan(node, number, beams=640):
    encoder = RosEncoder(node.store)
    return encoder.new(
        "sensor_msgs/msg/LaserScan", header=encoder.header(number, "laser"), angle_min=-1.0, angle_max=1.0,
        angle_increment=0.1, time_increment=0.0, scan_time=0.1, range_min=0.1, range_max=10.0,
        ranges=np.full(beams, number % 97, np.float32), intensities=np.empty(0, np.float32),
    )  # fmt: skip


def publish_many(publication, node):
    for number in range(1000):
        publication.publish(scan(node, number, 100_000))


@pytest.fixture(params=["our master", "Debian's rosmaster"])
def uri(request):
    """Of a master: ours, or Debian's."""
    if request.param == "our master":
        return request.getfixturevalue("master").uri
    request.getfixturevalue("debian_python")
    process = request.getfixturevalue("run_peer")("http://127.0.0.1:1", str(PEERS / "debian_master.py"))
    return process.stdout.readline().strip()


def test_nothing_is_lost_nor_out_of_order(uri, make_node, eventually):
    talker, listener = make_node("/talker", uri), make_node("/listener", uri)
    heard = []
    listener.subscribe("/scan", SCAN, lambda name, data: heard.append((name, listener.decode(SCAN, data))))
    publication = talker.advertise("/scan", SCAN)
    eventually(lambda: publication.peers == ["/listener"])
    for number in range(2000):
        publication.publish(scan(talker, number))
    eventually(lambda: len(heard) == 2000)
    assert {name for name, _ in heard} == {"/talker"}
    assert [message.header.stamp.nanosec for _, message in heard] == list(range(2000))
    assert [message.header.seq for _, message in heard] == list(range(2000))  # as roscpp numbers them
    assert all((message.ranges == number % 97).all() for number, (_, message) in enumerate(heard))


def test_who_comes_late_gets_what_is_latched_and_nothing_else(uri, make_node, eventually):
    talker = make_node("/talker", uri)
    text = talker.store.types["std_msgs/msg/String"]
    for topic, latch in (("/kept", True), ("/gone", False)):
        publication = talker.advertise(topic, TEXT, latch)
        for words in ("one", "two"):
            publication.publish(text(data=words))
    late, heard = make_node("/late", uri), []
    for topic in ("/gone", "/kept"):
        late.subscribe(topic, TEXT, lambda _, data, topic=topic: heard.append((topic, late.decode(TEXT, data).data)))
    eventually(lambda: late.publishers_of("/gone") and heard)
    assert heard == [("/kept", "two")]


def test_ends_of_different_types_refuse_one_another_and_say_why(uri, make_node, eventually):
    talker, listener = make_node("/talker", uri), make_node("/listener", uri)
    publication = talker.advertise("/scan", SCAN)
    listener.subscribe("/scan", IMAGE, lambda *_: None)
    (words,) = eventually(lambda: listener.complaints)
    assert words.startswith("/scan: /scan: /listener has sensor_msgs/Image")
    assert "expected sensor_msgs/LaserScan" in words
    assert publication.peers == []


def test_a_subscriber_that_leaves_is_forgotten_and_one_that_comes_back_is_found(uri, make_node, eventually):
    talker = make_node("/talker", uri)
    publication = talker.advertise("/scan", SCAN)
    for name in ("/first", "/second"):
        listener, heard = make_node(name, uri), []
        listener.subscribe("/scan", SCAN, lambda *_, heard=heard: heard.append(1))
        eventually(lambda name=name: name in publication.peers)
        publication.publish(scan(talker, 1))
        eventually(lambda heard=heard: heard)
        listener.close()
    eventually(lambda: publication.publish(scan(talker, 2)) or publication.peers == [])


def test_a_subscriber_that_reads_nothing_is_named_once_its_queue_is_full(master, make_node, eventually):
    talker, deaf = make_node("/talker", master.uri, 0.3), make_node("/deaf", master.uri)
    stop = threading.Event()
    deaf.subscribe("/scan", SCAN, lambda *_: stop.wait(20))
    publication = talker.advertise("/scan", SCAN)
    eventually(lambda: publication.peers)
    with pytest.raises(SlowSubscriberError, match=r"/scan: /deaf has read nothing for 0\.3 s, and its queue is full"):
        publish_many(publication, talker)
    stop.set()


def test_a_second_node_of_the_same_name_takes_its_place(master, make_node):
    first, listener = make_node("/twin", master.uri), make_node("/listener", master.uri)
    first.advertise("/scan", SCAN)
    make_node("/twin", master.uri).advertise("/other", SCAN)
    assert master.graph().publishers["/scan"] == {}
    assert listener.ask("getSystemState")[0] == [["/other", ["/twin"]]]


def test_a_master_refuses_in_words(master):
    for function, arguments, words in (
        ("lookupService", ["/me", "/absent"], "no provider of the service /absent"),
        ("lookupNode", ["/me", "/absent"], r"unknown node \[/absent\]"),
        ("getParam", ["/me", "/absent"], "is not set"),
        ("getParam", ["/me"], "getParam cannot take 1 such arguments"),
        ("makeCoffee", ["/me"], "there is no makeCoffee"),
    ):
        with pytest.raises(RosError, match=words):
            call(master.uri, function, *arguments)


def test_listeners_of_a_parameter_are_told_of_changes(master, debian_python, run_peer):
    """rospy keeps what it read; Debian's own client must hear of a change."""
    script = (
        "import rospy, time\n"
        "rospy.init_node('reader', disable_signals=True)\n"
        "import rosgraph\n"
        "from rospy.msproxy import MasterProxy\n"
        "from rospy.impl.paramserver import get_param_server_cache\n"
        "print(rospy.get_param_cached('/a/rate'), flush=True)\n"
        "while rospy.get_param_cached('/a/rate') != 2.5: time.sleep(0.01)\n"
        "print('changed', flush=True)\n"
    )
    call(master.uri, "setParam", "/me", "/a/rate", 1)
    process = run_peer(master.uri, "-c", script)
    assert process.stdout.readline().strip() == "1"
    call(master.uri, "setParam", "/me", "/a/rate", 2.5)
    assert process.stdout.readline().strip() == "changed"


@pytest.fixture
def peer(master, debian_python, run_peer):
    """A running rospy node under our master, and what it read of its parameters."""
    given = {"whole": 3, "part": 0.5, "words": "text", "truth": True, "list": [1, 2.5, "x"], "folder": {"below": -1}}
    master.parameters.set("/rospy_peer", given)
    master.parameters.set("/use_sim_time", False)
    process = run_peer(master.uri, str(PEERS / "rospy_peer.py"))
    return json.loads(process.stdout.readline())


def test_rospy_reads_parameters_of_every_type(peer, master):
    read = {key: peer[key] for key in ("whole", "part", "words", "truth", "list", "folder/below")}
    assert read == {
        "whole": 3, "part": 0.5, "words": "text", "truth": True, "list": [1, 2.5, "x"], "folder/below": -1,
    }  # fmt: skip
    assert (peer["absent"], peer["found"]) == (False, "/use_sim_time")
    assert master.parameters.get("/rospy_peer/seen") == 1.5
    assert {"/rospy_peer/whole", "/rospy_peer/absent"} <= master.asked()


def test_rospy_hears_us_and_we_hear_rospy(peer, master, make_node, eventually):
    us, heard = make_node("/us", master.uri), []
    publication = us.advertise("/scan", SCAN)
    us.subscribe("/doubled", SCAN, lambda _, data: heard.append(us.decode(SCAN, data)))
    eventually(lambda: publication.peers and us.publishers_of("/doubled"))
    eventually(lambda: publication.publish(scan(us, 0)) or heard)  # rospy drops what comes before it knows us
    for number in range(1, 301):
        publication.publish(scan(us, number))
    eventually(lambda: heard[-1].header.stamp.nanosec == 300)
    after = [message for message in heard if message.header.stamp.nanosec > 0]
    assert [message.header.stamp.nanosec for message in after] == list(range(1, 301))
    assert all((message.ranges == 2 * (number % 97)).all() for number, message in enumerate(after, start=1))


def test_services_of_rospy_answer_and_refuse(peer, master, make_node):
    us = make_node("/us", master.uri)
    assert us.call_service("/reset") == b""
    with pytest.raises(RosError, match=r"/fails refuses: .*no map yet"):
        us.call_service("/fails")
    with pytest.raises(RosError, match="no provider"):
        us.call_service("/absent")


def test_two_masters_know_nothing_of_one_another(make_node, eventually):
    masters = [Master(), Master()]
    try:
        counts = []
        for master in masters:
            listener, heard = make_node("/listener", master.uri), []
            listener.subscribe("/scan", SCAN, lambda *_, heard=heard: heard.append(1))
            counts.append(heard)
        publication = make_node("/talker", masters[0].uri).advertise("/scan", SCAN)
        eventually(lambda: publication.peers)
        publication.publish(scan(make_node("/other", masters[1].uri), 1))
        eventually(lambda: counts[0])
        time.sleep(0.1)
        assert counts[1] == []
    finally:
        for master in masters:
            master.close()
