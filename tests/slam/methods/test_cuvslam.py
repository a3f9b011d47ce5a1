"""The adapter of cuVSLAM (dim-odom) on rendered images of the built-in house; skipped where it is not installed."""

import importlib.util
import sys

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.geometry import SE2, is_rigid
from taskslam.measurements import Sensor, StereoImages
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.methods.cuvslam import Cuvslam, camera_mounts

TICK = 50_000_000


def test_an_absent_package_names_its_extra(rig, monkeypatch):
    monkeypatch.setitem(sys.modules, "dim_odom", None)
    with pytest.raises(MethodUnavailableError, match=r"taskslam\[cuvslam\]"):
        Cuvslam().start(rig)


def test_a_robot_without_cameras_is_refused(rig):
    with pytest.raises(InputError, match="needs a stereo camera"):
        Cuvslam().start(SensorRig(odometry=rig.odometry))


def test_the_cameras_look_ahead_and_the_right_one_stands_to_the_right(rig):
    left, right = camera_mounts(rig.stereo)
    assert is_rigid(left)
    np.testing.assert_allclose(left[:3, 3], rig.stereo.mount.xyz)
    np.testing.assert_allclose(left[:3, 2], [1.0, 0.0, 0.0])  # the optical axis
    np.testing.assert_allclose(left[:3, 1], [0.0, 0.0, -1.0])  # image rows go down
    np.testing.assert_allclose(right[:3, 3] - left[:3, 3], [0.0, -rig.stereo.baseline, 0.0])


@pytest.mark.skipif(importlib.util.find_spec("dim_odom") is None, reason="dim-odom is not installed (extra 'cuvslam')")
def test_it_follows_a_drive_and_repeats_to_the_byte(rig):
    from taskslam.simulation.simulator import Simulator
    from taskslam.world.loading import load_world

    one, two = Cuvslam(), Cuvslam()
    one.start(rig)
    two.start(rig)
    simulator = Simulator(load_world("house"), load_robot("turtlebot2"), 0, sensors={Sensor.STEREO_IMAGES})
    simulator.reset(SE2(0.0, 0.0, 0.0))
    errors = []
    for beat in range(120):
        simulator.drive(*((0.0, 0.0) if beat < 20 else (0.3, 0.4 if beat // 20 % 2 else -0.4)))
        for measurement in simulator.advance(simulator.now + TICK):
            if isinstance(measurement, StereoImages):
                estimate, again = one.feed(measurement), two.feed(measurement)
                assert estimate.T_start_base.tobytes() == again.T_start_base.tobytes()
                errors.append(simulator.true_pose().distance_to(SE2.from_matrix(estimate.T_start_base)))
    assert len(errors) > 170
    assert max(errors) < 0.1
