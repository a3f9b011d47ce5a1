"""The adapter of cuVSLAM (dim-odom) on rendered images of the built-in house; skipped where it is not installed."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.geometry import is_rigid
from taskslam.robot import SensorRig
from taskslam.slam.methods.cuvslam import Cuvslam, camera_mounts

DRIVE = """
import hashlib
from taskslam.geometry import SE2
from taskslam.measurements import Sensor, StereoImages
from taskslam.robot import load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.slam.methods.cuvslam import Cuvslam
from taskslam.world.loading import load_world

robot, method = load_robot("turtlebot2"), Cuvslam()
method.start(robot.rig)
simulator = Simulator(load_world("house"), robot, 0, sensors={Sensor.STEREO_IMAGES})
errors, digest = [], hashlib.sha256()
for beat in range(90):
    simulator.drive(*((0.0, 0.0) if beat < 20 else (0.3, 0.4 if beat // 20 % 2 else -0.4)))
    for measurement in simulator.advance(simulator.now + 50_000_000):
        if isinstance(measurement, StereoImages):
            T_start_base = method.feed(measurement).T_start_base
            errors.append(simulator.true_pose().distance_to(SE2.from_matrix(T_start_base)))
            digest.update(T_start_base.tobytes())
print(len(errors), max(errors), digest.hexdigest())
"""


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
def test_it_follows_a_drive_and_repeats_in_a_process_of_its_own():
    """Two instances in one process share a state and differ; the benchmark never has two."""
    runs = [subprocess.run([sys.executable, "-c", DRIVE], capture_output=True, text=True, check=True) for _ in range(2)]
    one, two = (run.stdout.splitlines()[-1].split() for run in runs)  # the package prints, too
    assert int(one[0]) > 130
    assert float(one[1]) < 0.05
    assert one == two
