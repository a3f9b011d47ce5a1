"""Messages as strangers' drivers write them: layouts, encodings and time conventions other than our own."""

from __future__ import annotations

from types import SimpleNamespace as Message

import numpy as np
import pytest

from taskslam.datasets import ros_decoding
from taskslam.datasets.bag_rig import Frames, lidar_2d
from taskslam.datasets.cloud_clock import CloudClock
from taskslam.errors import DatasetError

HEADER = Message(stamp=Message(sec=10, nanosec=0), frame_id="sensor")
STAMP = 10_000_000_000


def cloud(layout: list[tuple[str, str]], rows: list[tuple], **changes: object) -> Message:
    dtype = np.dtype(layout)
    points = np.array(rows, dtype)
    codes = {"<f4": 7, "<f8": 8, "<u2": 4, "<u4": 6, "|u1": 2}
    fields = [
        Message(name=name, offset=offset, datatype=codes[kind.str], count=1)
        for name, (kind, offset) in dtype.fields.items()
    ]
    message = Message(
        header=HEADER, height=1, width=len(points), fields=fields, is_bigendian=False, point_step=dtype.itemsize,
        row_step=points.nbytes, data=points.view(np.uint8),
    )  # fmt: skip
    message.__dict__.update(changes)
    return message


def later(message: Message) -> Message:
    """The same cloud a tenth of a second later, its times too if they count since 1970."""
    points = message.data.copy().view(np.dtype({
        "names": [field.name for field in message.fields],
        "formats": [{7: "<f4", 8: "<f8", 4: "<u2", 6: "<u4", 2: "|u1"}[field.datatype] for field in message.fields],
        "offsets": [field.offset for field in message.fields],
        "itemsize": message.point_step,
    }))  # fmt: skip
    if "timestamp" in points.dtype.names:
        points["timestamp"] += 0.1
    header = Message(stamp=Message(sec=10, nanosec=100_000_000), frame_id="sensor")
    return Message(**{**message.__dict__, "header": header, "data": points.view(np.uint8)})


NO_CLOCK = CloudClock()

XYZ = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]


@pytest.mark.parametrize(
    ("name", "kind", "times"),
    [
        ("t", "<u4", (0, 50_000_000, 100_000_000)),  # Ouster
        ("time", "<f4", (0.0, 0.05, 0.1)),  # Velodyne, stamped with the first firing
        ("timestamp", "<f8", (10.0, 10.05, 10.1)),  # Hesai
    ],
)
def test_times_of_any_driver_become_offsets_before_the_last_firing(name, kind, times):
    rows = [(1, 0, 0, 1, times[0]), (2, 0, 0, 0, times[1]), (3, 0, 0, 1, times[2])]
    message = cloud([*XYZ, ("ring", "<u2"), (name, kind)], rows)
    clock = ros_decoding.clock_of_clouds([message, later(message)], 10.0)
    assert clock.note == ""
    read = ros_decoding.point_cloud(message, clock)
    assert abs(read.stamp - STAMP - 100_000_000) <= 5
    assert read.ring.tolist() == [0, 1, 1]  # ring by ring, each in firing order
    assert read.points[:, 0].tolist() == [2, 1, 3]
    assert np.abs(read.time_offset - [-50_000_000, -100_000_000, 0]).max() <= 5


def test_points_without_a_return_are_left_out():
    rows = [(np.nan, 0, 0, 0), (0, 0, 0, 0), (1, 2, 3, 5)]
    read = ros_decoding.point_cloud(cloud([*XYZ, ("ring", "|u1")], rows), NO_CLOCK)
    assert read.points.tolist() == [[1, 2, 3]]
    assert read.time_offset.tolist() == [0]


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (cloud(XYZ, [(1, 2, 3)]), "without a field ring, line, channel"),
        (cloud(XYZ[:2], [(1, 2)]), "without the field z"),
        (cloud([*XYZ, ("ring", "<u2")], [(1, 2, 3, 0)], width=10**9), "a point cloud of 1000000000 points"),
        (cloud([*XYZ, ("ring", "<u2"), ("time", "<f4")], [(1, 2, 3, 0, 5.0)]), "'time' lies more than a second"),
        (cloud([*XYZ, ("ring", "<u2"), ("time", "<f4")], [(1, 2, 3, 0, np.nan)]), "'time' lies more than a second"),
        (cloud([*XYZ, ("ring", "<u2")], [(1, 2, 3, 0)], point_step=4), "not a number inside a point"),
    ],
)
def test_a_cloud_that_is_none_says_why(message, complaint):
    with pytest.raises(DatasetError, match=complaint):
        ros_decoding.point_cloud(message, CloudClock("time", 1e9))


def picture(encoding: str, data: list[int], width: int = 2, height: int = 1, step: int = 0) -> Message:
    return Message(header=HEADER, encoding=encoding, width=width, height=height, step=step or len(data) // height,
                   data=np.array(data, np.uint8))  # fmt: skip


def test_images_of_any_channel_order_become_grey_or_rgb():
    assert ros_decoding.image(picture("mono8", [1, 2, 9, 3, 4, 9], height=2, step=3)).tolist() == [[1, 2], [3, 4]]
    assert ros_decoding.image(picture("bgr8", [1, 2, 3, 4, 5, 6])).tolist() == [[[3, 2, 1], [6, 5, 4]]]
    assert ros_decoding.image(picture("rgba8", [1, 2, 3, 0, 4, 5, 6, 0])).tolist() == [[[1, 2, 3], [4, 5, 6]]]


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (picture("mono16", [0] * 4), "encoded as 'mono16'; expected one of mono8"),
        (picture("mono8", [0] * 4, width=1000, height=1000, step=1000), "with 4 bytes; expected 1000000"),
        (picture("rgb8", [0] * 4), "an image of 2x1 with 4 bytes"),
    ],
)
def test_an_image_that_is_none_says_why(message, complaint):
    with pytest.raises(DatasetError, match=complaint):
        ros_decoding.image(message)


def test_readings_outside_the_limits_are_no_returns_and_the_stamp_is_the_last_ray():
    scan = Message(
        header=HEADER, angle_min=-1.0, angle_max=1.0, angle_increment=0.5, time_increment=0.001, scan_time=0.1,
        range_min=0.1, range_max=5.0, ranges=np.array([0.05, 1.0, np.nan, 7.0, 0.0], np.float32),
    )  # fmt: skip
    read = ros_decoding.laser_scan(scan, None)
    assert read.ranges.tolist() == [np.inf, 1.0, np.inf, np.inf, np.inf]
    assert read.stamp == STAMP + 4_000_000
    assert read.time_increment == 1_000_000


def scans(**changes):
    """Five scans at 10 Hz."""
    return [
        Message(**{
            "header": Message(stamp=Message(sec=10, nanosec=number * 100_000_000), frame_id=""), "angle_min": -1.0,
            "angle_max": 1.0, "angle_increment": 0.01, "time_increment": 0.0, "scan_time": 0.1, "range_min": 0.1,
            "range_max": 5.0, "ranges": np.full(201, 2.0, np.float32), **changes,
        })
        for number in range(5)
    ]  # fmt: skip


def laser(messages):
    frames = Frames([], "base_link", None, {"": "0,0,0,0,0,0"})
    return lidar_2d(messages, frames)


def test_a_sweep_longer_than_the_time_between_scans_is_not_believed():
    messages = scans(time_increment=0.1)  # which is the scan_time
    part = laser(messages)
    read = ros_decoding.laser_scan(messages[0], part)
    assert (read.stamp, read.time_increment, part.rolling) == (STAMP, 0, False)
    (doubt,) = ros_decoding.doubts_about_scans(messages, part)
    assert doubt.startswith("a sweep of 20 s (201 rays, time_increment 0.1 s) is longer than the 0.1 s from scan to")
    messages = scans(time_increment=0.1 / 201)
    part = laser(messages)
    read = ros_decoding.laser_scan(messages[0], part)
    assert (read.stamp - STAMP, part.rolling) == (pytest.approx(99_500_000, abs=5000), True)
    assert ros_decoding.doubts_about_scans(messages, part) == []


def test_a_laser_that_sees_without_end_is_one():
    messages = scans(range_max=np.inf, ranges=np.array([0.05, 1.0, 70.0, np.inf, np.nan], np.float32))
    part = laser(messages)
    read = ros_decoding.laser_scan(messages[0], part)
    assert (read.range_max, part.range_max) == (100.0, 100.0)
    assert read.ranges.tolist() == [np.inf, 1.0, 70.0, np.inf, np.inf]
    assert ros_decoding.doubts_about_scans(messages, part) == ["range_max is infinite: taken for 100 m"]


def test_the_first_scan_that_can_be_read_tells_the_laser():
    messages = scans()
    messages[0].angle_min = np.nan
    assert laser(messages).samples == 201
    with pytest.raises(DatasetError, match="a scan without ranges"):
        laser(scans(angle_min=np.nan))
