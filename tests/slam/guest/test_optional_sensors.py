"""Sensors that a method makes use of where there are any."""

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import ImuSamples, LaserScan, Sensor, WheelOdometry
from taskslam.slam.base import Kind, MethodCard

MS = 1_000_000


def card(**fields):
    return MethodCard("m", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), **fields)


def test_a_method_hears_all_that_it_must_get_and_of_the_rest_what_there_is():
    optional = card(optional_sensors=(Sensor.IMU, Sensor.WHEEL_ODOMETRY))
    assert optional.hears(()) == (Sensor.LASER_SCAN,)
    assert optional.hears((Sensor.IMU, Sensor.STEREO_IMAGES)) == (Sensor.LASER_SCAN, Sensor.IMU)
    assert card().hears((Sensor.IMU,)) == (Sensor.LASER_SCAN,)


def imu(ms):
    return ImuSamples(ms * MS, np.array([ms * MS]), np.zeros((1, 3)), np.zeros((1, 3)))


@pytest.mark.parametrize("has_imu", [True, False])
def test_it_is_fed_what_there_is(host_of, has_imu):
    host = host_of("optional:CountsSamples")
    host.start()
    assert host.card.optional_sensors == (Sensor.IMU,)
    for ms in range(0, 50, 10):
        host.feed(WheelOdometry(ms * MS, SE2(), 0.0, 0.0))  # nobody asked for it
        if has_imu:
            host.feed(imu(ms))
    host.feed(LaserScan(50 * MS, np.ones(4, np.float32), 0.0, 0.1, 0.1, 10.0))
    (estimate,) = host.collect(60 * MS)
    assert estimate.T_start_base[0, 3] == (5 if has_imu else 0)


def test_the_truth_is_no_option(host_of):
    with pytest.raises(InputError, match="asks for true poses"):
        host_of("optional:Spies").start()
