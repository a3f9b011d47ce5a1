"""The queue in front of a method, without a process: what it takes when, and what it never sees."""

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, PointCloud, Sensor, WheelOdometry
from taskslam.slam.guest.latency import NEVER, LatencyMode, LatencyModel, Schedule

SENSORS = (Sensor.LASER_SCAN, Sensor.POINT_CLOUD, Sensor.WHEEL_ODOMETRY)
RANGES = np.ones(4, dtype=np.float32)


def scan(stamp):
    return LaserScan(stamp, RANGES, 0.0, 0.1, 0.1, 10.0)


def odometry(stamp):
    return WheelOdometry(stamp, SE2(), 0.0, 0.0)


def cloud(stamp):
    empty = np.empty(0)
    return PointCloud(stamp, empty.reshape(0, 3).astype("f4"), empty.astype("u2"), empty.astype("i4"))


def play(schedule, measurements, until=10_000):
    """What the method sees, as (sensor, stamp, taken, due)."""
    handed = [h for m in measurements for h in schedule.offer(m)] + schedule.advance(until)
    assert [h.number for h in handed] == list(range(1, len(handed) + 1))
    return [(h.measurement.sensor.split("_")[0], h.measurement.stamp, h.taken, h.due) for h in handed]


def test_an_idle_method_takes_a_frame_at_its_stamp():
    assert play(Schedule(SENSORS, 1, 30), [scan(100), scan(200)]) == [
        ("laser", 100, 100, 130),
        ("laser", 200, 200, 230),
    ]


def test_of_the_frames_that_come_while_it_is_busy_the_newest_wins():
    schedule = Schedule(SENSORS, 1, 250)
    taken = play(schedule, [scan(s) for s in range(100, 700, 100)])
    # At 600 the method is free before the scan of 600 arrives, so it takes the one that waited.
    assert [(stamp, when, due) for _, stamp, when, due in taken] == [
        (100, 100, 350),
        (300, 350, 600),
        (500, 600, 850),
        (600, 850, 1100),
    ]
    assert (schedule.frames, schedule.dropped) == (6, 2)


def test_a_longer_queue_keeps_the_newest_frames_and_takes_the_oldest_of_them():
    schedule = Schedule(SENSORS, 2, 350)
    assert play(schedule, [scan(s) for s in (100, 200, 300, 400)]) == [
        ("laser", 100, 100, 450),
        ("laser", 300, 450, 800),
        ("laser", 400, 800, 1150),
    ]
    assert schedule.dropped == 1


def test_odometry_is_never_dropped_and_stays_in_stamp_order_with_queued_frames():
    measurements = [m for s in range(100, 400, 100) for m in (odometry(s - 50), scan(s))]
    taken = play(Schedule(SENSORS, 1, 150), measurements)
    assert [(kind, stamp) for kind, stamp, _, _ in taken] == [
        ("wheel", 50),
        ("laser", 100),
        ("wheel", 150),
        ("laser", 200),
        ("wheel", 250),
        ("laser", 300),
    ]
    stamps = [stamp for _, stamp, _, _ in taken]
    assert stamps == sorted(stamps)


def test_what_waited_behind_a_dropped_frame_goes_on():
    schedule = Schedule(SENSORS, 1, 1000)
    offered = [scan(0), scan(100), odometry(150), scan(200), odometry(250)]
    assert [h.measurement.stamp for m in offered for h in schedule.offer(m)] == [0, 150]
    assert [h.measurement.stamp for h in schedule.advance(1000)] == [200, 250]
    assert schedule.dropped == 1


def test_a_frame_of_one_sensor_does_not_push_out_another_sensors():
    schedule = Schedule(SENSORS, 1, 100)
    assert [stamp for _, stamp, _, _ in play(schedule, [scan(0), cloud(10), scan(20), cloud(30)])] == [0, 20, 30]
    assert schedule.dropped == 1


def test_collecting_often_or_once_makes_no_difference():
    def taken(collect):
        schedule, seen = Schedule(SENSORS, 1, 130), []
        for stamp in range(0, 2000, 20):
            seen += schedule.offer(odometry(stamp))
            seen += schedule.offer(scan(stamp)) if stamp % 100 == 0 else []
            seen += schedule.advance(stamp) if collect else []
        return [(h.measurement.stamp, h.taken, h.due) for h in seen + schedule.advance(5000)]

    assert taken(True) == taken(False)


def test_odometry_of_a_frame_method_is_answered_with_the_frames():
    assert play(Schedule(SENSORS, 1, 30), [odometry(10)]) == [("wheel", 10, 10, NEVER)]


def test_a_method_without_frames_answers_every_message_after_its_latency():
    schedule = Schedule((Sensor.WHEEL_ODOMETRY,), 1, 30)
    assert play(schedule, [odometry(10), odometry(20)]) == [("wheel", 10, 10, 40), ("wheel", 20, 20, 50)]


def test_an_unknown_latency_is_settled_afterwards():
    schedule = Schedule(SENSORS, 1, None)
    (first,) = schedule.offer(scan(100))
    assert schedule.unsettled
    assert schedule.settle(first, 250) == 350
    assert not schedule.unsettled
    assert schedule.offer(scan(200)) == []
    assert [(h.measurement.stamp, h.taken) for h in schedule.advance(350)] == [(200, 350)]


def test_stamps_may_not_go_back():
    schedule = Schedule(SENSORS, 1, 0)
    schedule.advance(100)
    with pytest.raises(ValueError, match="stamp order"):
        schedule.offer(scan(99))


def test_latency_modes():
    assert LatencyModel().before(0.03) == 30_000_000
    assert LatencyModel(LatencyMode.ZERO).before(0.03) == 0
    assert LatencyModel(LatencyMode.MEASURED).before(0.03) is None
    assert LatencyModel(LatencyMode.MEASURED, 2.5).after(1000) == 2500
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="cpu_scale"):
            LatencyModel(LatencyMode.MEASURED, wrong)
