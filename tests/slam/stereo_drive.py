"""A drive through the built-in house as a robot with small pictures sees it, for stereo methods."""

from dataclasses import dataclass

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import ImuSamples, Sensor, StereoImages
from taskslam.robot import load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.world.loading import load_world

SECONDS = 14
_BEAT = 100_000_000


@dataclass(frozen=True)
class Drive:
    """Pairs and IMU samples in stamp order, and the true poses of the base at the pairs' stamps."""

    rig: object
    measurements: list
    truth: dict

    def pairs(self):
        return [m for m in self.measurements if isinstance(m, StereoImages)]


@pytest.fixture(scope="session")
def stereo_drive():
    robot = load_robot("turtlebot2_vga15")
    simulator = Simulator(load_world("house"), robot, 0, sensors={Sensor.STEREO_IMAGES, Sensor.IMU})
    measurements, truth = [], {}
    for beat in range(10 * SECONDS):
        simulator.drive(*((0.0, 0.0) if beat < 10 else (0.25, 0.6 if beat // 20 % 2 else -0.6)))
        for measurement in simulator.advance(simulator.now + _BEAT):
            if isinstance(measurement, StereoImages):
                truth[measurement.stamp] = simulator.true_pose()
                measurement = StereoImages(measurement.stamp, measurement.left.copy(), measurement.right.copy())
            measurements.append(measurement)
    return Drive(robot.rig, [m for m in measurements if isinstance(m, StereoImages | ImuSamples)], truth)


@dataclass(frozen=True)
class Followed:
    """estimates: all of them; errors: m, planar, of those that track, against the truth."""

    estimates: list
    errors: np.ndarray

    @property
    def statuses(self):
        return [str(estimate.status) for estimate in self.estimates]


@pytest.fixture(scope="session")
def follow_stereo(stereo_drive):
    """For a class of methods: what feeds one, made with options; change: what becomes of the number-th pair, or of IMU
    samples (number None).
    """
    drive = stereo_drive

    def of(kind):
        def run(change=lambda measurement, number: measurement, rig=None, **options):
            method = kind(**options)
            method.start(rig or drive.rig)
            estimates, number = [], 0
            for measurement in drive.measurements:
                is_pair = isinstance(measurement, StereoImages)
                fed = change(measurement, number if is_pair else None)
                number += is_pair
                answer = None if fed is None else method.feed(fed)
                if answer is not None:
                    estimates.append(answer)
            errors = [
                drive.truth[e.stamp].distance_to(SE2.from_matrix(e.T_start_base))
                for e in estimates
                if e.status == "tracking" and e.stamp in drive.truth
            ]
            return Followed(estimates, np.array(errors))

        return run

    return of
