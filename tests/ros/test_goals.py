"""Goals given in RViz become a file of waypoints that a scenario reads."""

import math
import signal
import threading
from contextlib import closing

import pytest

from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.ros.goals import collect_goals
from taskslam.ros.opening import join_graph, open_graph_of_our_own
from taskslam.scenario import load_scenario
from taskslam.stopping import StoppedError

POSE = "geometry_msgs/msg/PoseStamped"
GIVEN = [SE2(1.0, -0.25, 0.5), SE2(-2.0, 0.125, -3.0)]


@pytest.mark.parametrize("ros", [1, 2])
def test_goals_of_rviz_are_waypoints_of_a_scenario(ros, request, tmp_path, eventually, monkeypatch):
    if ros == 2:
        request.getfixturevalue("ros2")
    out, said = tmp_path / "goals.yaml", []
    with closing(open_graph_of_our_own(ros, "/rviz")) as rviz:
        for variable, value in rviz.variables.items():
            monkeypatch.setenv(variable, value)
        encoder = RosEncoder(rviz.store)
        rviz.advertise("/goal", POSE)
        with closing(join_graph(ros, "/goals")) as us:
            thread = threading.Thread(target=collect_goals, args=(us, "/goal", out, 2, said.append))
            thread.start()
            eventually(lambda: rviz.readers("/goal") and us.writers("/goal"), 60.0)
            rviz.publish("/goal", encoder.pose_stamped(1, "odom", SE2(9.0, 9.0, 0.0)))
            rviz.publish("/goal", encoder.pose_stamped(1, "map", SE2(math.nan, 9.0, 0.0)))
            for goal in GIVEN:
                rviz.publish("/goal", encoder.pose_stamped(1, "map", goal))
            thread.join(60.0)
            assert not thread.is_alive()
    assert "a goal in the frame 'odom': left out; expected 'map' (RViz: Fixed Frame)" in said
    assert any("not finite" in words for words in said)
    tour = tmp_path / "tour.yaml"
    tour.write_text(
        "name: tour\nworld: {name: house}\nstart: {x: 0, y: 0, yaw: 0}\nsequence: {waypoints_file: goals.yaml}\n"
    )
    read = [goal.pose for goal in load_scenario(tour, []).sequence.goals]
    assert [one.array() for one in read] == [pytest.approx(goal.array(), abs=1e-3) for goal in GIVEN]


class _Graph:
    """Nobody says anything, and then a person presses Ctrl-C."""

    def subscribe(self, topic, kind):
        assert kind == POSE

    def hear(self, longest_s):
        raise StoppedError(signal.SIGINT)


def test_a_person_ends_it_and_a_file_that_stands_is_kept(tmp_path):
    assert collect_goals(_Graph(), "/goal", tmp_path / "goals.yaml", None, lambda _: None) == 0
    assert not (tmp_path / "goals.yaml").exists()
    (tmp_path / "goals.yaml").write_text("mine")
    with pytest.raises(InputError, match=r"goals\.yaml exists"):
        collect_goals(_Graph(), "/goal", tmp_path / "goals.yaml", None, lambda _: None)
