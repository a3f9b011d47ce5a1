"""What a scan calls a hit, and that sensors' names are an open set."""

import numpy as np
import pytest

from taskslam.measurements import LaserScan, Sensor


@pytest.mark.parametrize(
    ("reading", "is_hit"),
    [(0.1, True), (5.0, True), (9.999, True), (10.0, False), (0.0999, False), (0.0, False), (-1.0, False)],
)
def test_a_hit_lies_from_range_min_to_below_range_max(reading, is_hit):
    scan = LaserScan(0, np.array([reading, np.inf, np.nan, -np.inf], np.float32), 0.0, 0.1, 0.1, 10.0)
    assert scan.hits().tolist() == [is_hit, False, False, False]


def test_nothing_at_the_sensor_itself_is_a_hit_even_if_the_least_range_is_zero():
    assert LaserScan(0, np.array([0.0, 0.01], np.float32), 0.0, 0.1, 0.0, 10.0).hits().tolist() == [False, True]


def test_a_sensor_is_a_name_and_ours_are_constants():
    assert Sensor("laser_scan") == Sensor.LASER_SCAN == "laser_scan"
    assert Sensor("of_another_package") not in (Sensor.LASER_SCAN, Sensor.RGBD_IMAGES)
    assert f"{Sensor.IMU}" == str(Sensor.IMU) == "imu"
