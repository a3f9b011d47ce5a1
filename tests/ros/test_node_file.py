import re

import pytest
import yaml

from taskslam.errors import InputError
from taskslam.measurements import Sensor
from taskslam.ros import node_file
from taskslam.ros.lockstep import Answers
from taskslam.ros.node_file import NODES, load_node

SMALLEST = {
    "name": "mine",
    "command": "rosrun mine mine_node",
    "sensors": ["laser_scan"],
    "answer": {"topic": "/pose", "type": "geometry_msgs/PoseStamped"},
}


@pytest.fixture
def load(tmp_path):
    """The smallest node file, with other values where they are given."""

    def read(**changes):
        file = tmp_path / "node.yaml"
        content = {key: value for key, value in (SMALLEST | changes).items() if value is not None}
        file.write_text(yaml.safe_dump(content))
        return load_node(file)

    return read


def test_the_page_of_the_model_shows_a_node_file(tmp_path):
    (example,) = re.findall(r"\n\n(    name: .*?)\n\n", node_file.__doc__, re.DOTALL)
    file = tmp_path / "node.yaml"
    file.write_text("\n".join(line[4:] for line in example.splitlines()))
    node = load_node(file)
    assert node.awaited == Sensor.LASER_SCAN
    assert node.card().odometry_prior


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"comand": "x"}, r"comand.*Did you mean 'command'\?"),
        ({"command": None}, "the key 'command' is missing: how the node is started"),
        ({"ros": 3}, "ros: .*1"),
        ({"sensors": ["lase_scan"]}, r"Did you mean 'laser_scan'\?"),
        ({"sensors": ["wheel_odometry"]}, r"awaits: say to which sensor's frames it answers \(.*none\)"),
        ({"sensors": ["laser_scan", "point_cloud"]}, r"awaits: say .*laser_scan, point_cloud"),
        ({"awaits": "imu"}, "awaits: imu is none of its sensors with frames"),
        ({"sensors": ["laser_scan", "true_pose"]}, "a node is not told true poses"),
        (
            {"topics": {"/scam": "/front"}},
            r"topics: /scam is none of ours; expected .*/scan. Did you mean '/scan'\?",
        ),
        ({"topics": {"scan": "/front"}}, "topics.scan"),
        ({"parameters": {"since": None}}, r"since is a NoneType: expected true or false, an int, a double, text"),
        ({"parameters": {"big": 1 << 40}}, "big is 1099511627776: an int parameter has 32 bits; write it as a double"),
        ({"parameters": {"a": {"b": [1, None]}}}, "a is a NoneType"),
        ({"answer": {"topic": "/pose"}}, "expected a topic with its type"),
        ({"answer": {"topic": "/pose", "type": "geometry_msgs/Pose"}}, r"answer.type.*geometry_msgs/PoseStamped"),
        ({"answer": {}}, r"expected either a topic with its type, or a transform"),
        ({"answer": {"transform": ["map", "odom"], "orgin": "of"}}, r"Did you mean 'origin'\?"),
        ({"answers": "always"}, "answers: .*every_frame.*sparse"),
        ({"tick_ms": 0}, "tick_ms"),
        ({"qos": {"/scan": {"depth": 5}}}, "qos: ROS 1 has none; expected it with ros: 2"),
        (
            {"ros": 2, "qos": {"/scam": {"depth": 5}}},
            r"qos: /scam is no topic between us; expected one of /scan, .*/pose. Did you mean '/scan'\?",
        ),
        ({"ros": 2, "qos": {"/scan": {"relyability": "x"}}}, r"relyability.*Did you mean 'reliability'\?"),
        ({"ros": 2, "qos": {"/scan": {"reliability": "best"}}}, "qos./scan.reliability.*'best_effort'"),
        ({"ros": 2, "parameters": {"/a/b": 1}}, "/a/b begins with a slash; a parameter of ROS 2 is always a node's"),
        ({"ros": 2, "parameters": {"a": {"b": [1, 2.0]}}}, "a is a list of several types; ROS 2 has lists of one"),
        ({"ros": 2, "parameters": {"a": []}}, "a is an empty list"),
    ],
)
def test_what_is_wrong_is_said_with_its_key(load, changes, words):
    with pytest.raises(InputError, match=words) as caught:
        load(**changes)
    assert "\n" not in str(caught.value)


def test_an_unknown_name_is_told_with_those_that_ship():
    with pytest.raises(InputError, match=r"node 'hectr' is neither shipped \(.*\) nor .* Did you mean 'hector'"):
        load_node("hectr")


def test_what_lies_beside_the_node_file_is_found_and_opened(load, tmp_path):
    (tmp_path / "slam_node").touch()
    node = load(
        command="./slam_node --fast", parameters={"words": "./orb.txt", "topic": "/scan"}, setup="./devel/setup.sh"
    )
    assert node.arguments == [str(tmp_path / "slam_node"), "--fast"]
    assert set(node.card().reads) == {str(tmp_path), str(tmp_path / "devel"), str(tmp_path / "orb.txt")}


def test_the_card_says_what_is_needed_beyond_the_wall(load):
    card = load(needs={"reads": ["/opt/ros/noetic"], "shared_memory": True}, latency=0.1, queue=3, still_start=5).card()
    assert card.loopback
    assert card.shared_memory
    assert "/opt/ros/noetic" in card.reads
    assert (card.latency, card.queue, card.needs_still_start) == (0.1, 3, 5.0)


def test_a_node_of_ros_2_needs_shared_memory_and_no_tcp(load):
    node = load(ros=2, topics={"/scan": "/front"}, qos={"/front": {"reliability": "best_effort"}, "/pose": {}})
    assert (node.card().loopback, node.card().shared_memory) == (False, True)
    assert node.qos["/front"].depth == 100


def test_the_card_changes_with_the_file(load):
    assert load().card() == load().card()
    assert load().card() != load(parameters={"rate": 1}).card()


def test_options_are_parameters_with_other_values(load):
    node = load(parameters={"rate": 1, "words": "x"})
    assert node.with_parameters({"rate": 2.5}).parameters == {"rate": 2.5, "words": "x"}
    with pytest.raises(InputError, match="mine option rate is a NoneType"):
        node.with_parameters({"rate": None})


@pytest.mark.parametrize("name", NODES.names())
def test_what_ships_is_a_node_file_that_says_where_the_node_comes_from(name):
    node = load_node(name)
    assert node.card().sensors
    assert node.source
    assert node.homepage.startswith("https://")
    assert node.answers in Answers
