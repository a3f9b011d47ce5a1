"""ORB-SLAM3 itself on rendered images of the built-in house. Skipped where pyorbslam3 is not installed."""

import importlib.util
import sys

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.geometry import SE2
from taskslam.measurements import Sensor, StereoImages
from taskslam.robot import load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.slam import Status
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.methods import orb_slam3
from taskslam.world.loading import load_world

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("pyorbslam3") is None, reason="pyorbslam3 is not installed (extra 'orb-slam3')"
)
PERIOD = 66_666_667
TICK = 50_000_000


@pytest.fixture(scope="module")
def rig():
    whole = load_robot("turtlebot2").rig
    camera = whole.stereo.model_copy(update={"width": 640, "rate": 15.0})
    return whole.model_copy(update={"stereo": camera})


@pytest.fixture(scope="module")
def drive(rig):
    """(pair, true pose since the start) of six seconds down the corridor: a second at rest, then to and fro."""
    robot = load_robot("turtlebot2").model_copy(update={"rig": rig})
    simulator = Simulator(load_world("house"), robot, 0, sensors={Sensor.STEREO_IMAGES})
    start = SE2(0.0, 0.0, 0.0)
    simulator.reset(start)
    frames = []
    for beat in range(120):
        simulator.drive(*((0.0, 0.0) if beat < 20 else (0.3, 0.4 if beat // 20 % 2 else -0.4)))
        frames += [
            (measurement, start.inverse() @ simulator.true_pose())
            for measurement in simulator.advance(simulator.now + TICK)
            if isinstance(measurement, StereoImages)
        ]
    return frames


@pytest.fixture
def host(rig, tmp_path):
    host = MethodHost("orb_slam3", {}, rig, tmp_path / "method.log")
    host.start()
    yield host
    host.stop()


def tracked(host, frames):
    """Feed (pair, truth) with stamps of their own; returns (frame, status, metres from the truth) of every estimate."""
    told = []
    for n, (pair, truth) in enumerate(frames):
        stamp = (n + 1) * PERIOD
        host.feed(StereoImages(stamp, pair.left, pair.right))
        told += [
            (n, estimate.status, truth.distance_to(SE2.from_matrix(estimate.T_start_base)))
            for estimate in host.collect(stamp + PERIOD - 1)
        ]
    return told


def dark(frame, count):
    pair, truth = frame
    black = np.zeros_like(pair.left)
    return [(StereoImages(pair.stamp, black, black), truth)] * count


def test_it_tracks_a_drive_within_three_centimetres(host, drive):
    told = tracked(host, drive)
    assert len(told) == len(drive)
    assert {status for _, status, _ in told} == {Status.TRACKING}
    assert drive[-1][1].distance_to(SE2()) > 1.0
    assert max(error for *_, error in told) < 0.03


def test_after_a_blackout_it_is_lost_and_never_jumps(host, drive, tmp_path):
    seen, blind = 40, 60  # four seconds in the dark: it gives the map up and begins a new one, elsewhere
    told = tracked(host, drive[:seen] + dark(drive[seen - 1], blind) + drive[seen:])
    host.stop()
    assert (tmp_path / "method.log").read_text().count("New Map created") >= 2
    statuses = [status for _, status, _ in told]
    assert statuses[:seen] == [Status.TRACKING] * seen
    assert Status.TRACKING not in statuses[seen:]
    assert statuses[-1] is Status.LOST


def test_it_begins_with_the_first_pair_that_shows_something(host, drive):
    told = tracked(host, dark(drive[0], 5) + drive[:10])
    assert [status for _, status, _ in told] == [Status.STARTING] * 5 + [Status.TRACKING] * 10


def test_a_beginning_after_the_still_start_has_no_known_origin(host, drive):
    told = tracked(host, dark(drive[0], 20) + drive[20:30])
    assert Status.TRACKING not in [status for _, status, _ in told]


def test_a_missing_vocabulary_is_one_sentence(rig, tmp_path):
    host = MethodHost("orb_slam3", {"vocabulary": "/nowhere/ORBvoc.txt"}, rig, tmp_path / "method.log")
    with pytest.raises(InputError, match=r"/nowhere/ORBvoc\.txt: cannot read the vocabulary: No such file"):
        host.start()


def test_the_environment_names_a_vocabulary(rig, tmp_path, monkeypatch):
    (tmp_path / "mine.txt").write_text("not a vocabulary")
    monkeypatch.setenv(orb_slam3.VOCABULARY_VARIABLE, str(tmp_path / "mine.txt"))
    host = MethodHost("orb_slam3", {}, rig, tmp_path / "logs" / "method.log")
    (tmp_path / "logs").mkdir()
    with pytest.raises(InputError, match=r"mine\.txt: expected the text format of ORBvoc\.txt"):
        host.start()


@pytest.mark.parametrize(
    ("option", "words"), [({"features": 3}, "features is 3"), ({"feature": 800}, "Did you mean 'features'")]
)
def test_wrong_options_are_named(rig, tmp_path, option, words):
    with pytest.raises(InputError, match=words):
        MethodHost("orb_slam3", option, rig, tmp_path / "method.log").start()


def test_a_robot_without_cameras_is_told_what_is_missing(rig, tmp_path):
    blind = rig.model_copy(update={"stereo": None})
    with pytest.raises(InputError, match="needs stereo_images, which the robot has not"):
        MethodHost("orb_slam3", {}, blind, tmp_path / "method.log").start()


def test_absent_system_libraries_are_named_with_their_packages(monkeypatch, tmp_path):
    (tmp_path / "pyorbslam3.py").write_text("raise ImportError('libEGL.so.1: cannot open shared object file')")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "pyorbslam3", raising=False)
    monkeypatch.setattr(orb_slam3, "missing_libraries", lambda: ["libEGL.so.1", "libSM.so.6"])
    with pytest.raises(MethodUnavailableError, match=r"libEGL\.so\.1, libSM\.so\.6.*: apt install libegl1 libsm6"):
        orb_slam3._package()
