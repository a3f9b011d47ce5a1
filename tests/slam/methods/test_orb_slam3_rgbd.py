"""ORB-SLAM3 on rendered RGB-D images of the built-in house. Skipped where pyorbslam3 is not installed."""

import importlib.util

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import RgbdImages, Sensor
from taskslam.robot import load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.slam import Status
from taskslam.slam.guest.host import MethodHost
from taskslam.world.loading import load_world

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("pyorbslam3") is None, reason="pyorbslam3 is not installed (extra 'orb-slam3')"
)
PERIOD = 66_666_667
TICK = 50_000_000
METHOD = "taskslam.slam.methods.orb_slam3_rgbd:OrbSlam3Rgbd"


@pytest.fixture(scope="module")
def robot():
    robot = load_robot("turtlebot2_d435i")
    camera = robot.rig.rgbd.model_copy(update={"rate": 15.0, "color": False})
    return robot.model_copy(update={"rig": robot.rig.model_copy(update={"rgbd": camera})})


@pytest.fixture(scope="module")
def drive(robot):
    """(frame, true pose since the start) of five seconds down the corridor: a second at rest, then to and fro."""
    simulator = Simulator(load_world("house"), robot, 0, sensors={Sensor.RGBD_IMAGES})
    frames = []
    for beat in range(100):
        simulator.drive(*((0.0, 0.0) if beat < 20 else (0.3, 0.3 if beat // 20 % 2 else -0.3)))
        frames += [
            (measurement, simulator.true_pose())
            for measurement in simulator.advance(simulator.now + TICK)
            if isinstance(measurement, RgbdImages)
        ]
    return frames


def tracked(host, frames):
    """Feed frames with stamps of their own; returns (status, metres from the truth) of every estimate."""
    told = []
    for n, (frame, truth) in enumerate(frames):
        stamp = (n + 1) * PERIOD
        host.feed(RgbdImages(stamp, frame.image, frame.depth))
        told += [
            (estimate.status, truth.distance_to(SE2.from_matrix(estimate.T_start_base)))
            for estimate in host.collect(stamp + PERIOD - 1)
        ]
    return told


def test_depth_gives_it_the_scale_of_the_drive(robot, drive, tmp_path):
    with MethodHost(METHOD, {}, robot.rig, tmp_path / "method.log") as host:
        told = tracked(host, drive)
    assert len(told) == len(drive)
    assert {status for status, _ in told} == {Status.TRACKING}
    assert drive[-1][1].distance_to(SE2()) > 1.0
    assert max(error for _, error in told) < 0.05


def test_without_depth_it_is_lost_at_once(robot, drive, tmp_path):
    blind = [(RgbdImages(frame.stamp, frame.image, np.zeros_like(frame.depth)), truth) for frame, truth in drive[:10]]
    with MethodHost(METHOD, {}, robot.rig, tmp_path / "method.log") as host:
        assert [status for status, _ in tracked(host, blind)][1:] == [Status.LOST] * 9


def test_a_robot_without_depth_is_told_what_is_missing(tmp_path):
    host = MethodHost(METHOD, {}, load_robot("turtlebot2").rig, tmp_path / "method.log")
    with pytest.raises(InputError, match="needs rgbd_images, which the robot has not"):
        host.start()
