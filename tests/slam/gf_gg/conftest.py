"""A drive through the built-in house as a robot with small pictures sees it, and runs of gf_gg on it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import Sensor, StereoImages
from taskslam.robot import load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.slam.methods.gf_gg import GfGg
from taskslam.world.loading import load_world

pytest.importorskip("cv2", reason="needs the extra `gf-gg`")
SECONDS = 8
_BEAT = 100_000_000


@dataclass(frozen=True)
class Drive:
    """Pairs in stamp order, and the true poses of the base with them."""

    rig: object
    pairs: list
    truth: list


@pytest.fixture(scope="session")
def drive():
    robot = load_robot("turtlebot2_vga15")
    simulator = Simulator(load_world("house"), robot, 0, sensors={Sensor.STEREO_IMAGES})
    pairs, truth = [], []
    for beat in range(10 * SECONDS):
        simulator.drive(*((0.0, 0.0) if beat < 5 else (0.25, 0.6 if beat // 20 % 2 else -0.6)))
        for measurement in simulator.advance(simulator.now + _BEAT):
            if isinstance(measurement, StereoImages):
                pairs.append(StereoImages(measurement.stamp, measurement.left.copy(), measurement.right.copy()))
                truth.append(simulator.true_pose())
    return Drive(robot.rig, pairs, truth)


@dataclass(frozen=True)
class Followed:
    """estimates: of all pairs; errors: m, planar, against the truth; NaN where it does not track."""

    estimates: list
    errors: np.ndarray

    @property
    def statuses(self):
        return [str(estimate.status) for estimate in self.estimates]

    @property
    def bytes(self):
        return [estimate.T_start_base.tobytes() for estimate in self.estimates]


@pytest.fixture(scope="session")
def follow(drive):
    """Runs gf_gg on the pairs of these numbers, stamped as if one came after the other.

    change: what becomes of the n-th that is fed.
    """

    def run(numbers=None, change=lambda pair, n: pair, rig=None, **options):
        method = GfGg(**options)
        method.start(rig or drive.rig)
        numbers = range(len(drive.pairs)) if numbers is None else numbers
        origin, period = drive.truth[numbers[0]], drive.pairs[1].stamp - drive.pairs[0].stamp
        estimates, errors = [], []
        for n, number in enumerate(numbers):
            estimate = method.feed(change(replace(drive.pairs[number], stamp=(n + 1) * period), n))
            estimates.append(estimate)
            expected = origin.inverse() @ drive.truth[number]
            error = expected.distance_to(SE2.from_matrix(estimate.T_start_base))
            errors.append(error if estimate.status == "tracking" else np.nan)
        return Followed(estimates, np.array(errors))

    return run
