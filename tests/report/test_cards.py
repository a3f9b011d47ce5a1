import pytest

from taskslam.report import cards


@pytest.mark.parametrize(
    ("licence", "limits"), [("GPL-3.0-only", ["GPL"]), ("GPL-2.0", ["GPL"]), ("LGPL-3.0", []), ("MIT", []), ("", [])]
)
def test_only_gpl_counts_as_gpl(licence, limits):
    assert cards.known_limits({"licence": licence, "kind": "slam", "map_mode": "continue"}) == limits


def test_the_limits_of_an_odometry():
    card = {
        "kind": "odometry",
        "map_mode": "none",
        "deterministic": False,
        "odometry_prior": True,
        "needs_still_start": 2.0,
        "optional_sensors": ["imu"],
    }
    assert cards.known_limits(card) == [
        "odometry only",
        "no map reuse",
        "not deterministic",
        "uses wheel odometry as prior",
        "uses IMU as prior where there is one",
        "stands still 2 s first",
    ]


def test_a_card_that_says_nothing_is_shown_as_such():
    assert cards.known_limits({}) == []
    assert [cards.sensor_suite({}), cards.kind({}), cards.map_mode({}), cards.yes_or_no({}, "deterministic")] == [
        "–"
    ] * 4


def test_sensors_in_words():
    assert cards.sensor_suite({"sensors": ["point_cloud", "imu"]}) == "3D LiDAR + IMU"


@pytest.mark.parametrize(
    ("sensors", "main"),
    [
        (["laser_scan", "wheel_odometry"], "laser_scan"),
        (["imu", "point_cloud"], "point_cloud"),
        (["wheel_odometry"], "wheel_odometry"),
        ([], ""),
        (["sonar"], ""),
    ],
)
def test_the_main_sensor_is_what_a_method_sees_with(sensors, main):
    assert cards.main_sensor({"sensors": sensors}) == main


def test_a_sensor_that_nobody_knows_keeps_its_name():
    assert [cards.sensor_name("laser_scan"), cards.sensor_name("sonar")] == ["2D LiDAR", "sonar"]


@pytest.mark.parametrize("wrong", [7, "<b>", {"a": 1}, None, [None, 3], True])
def test_a_card_that_holds_anything_is_still_told(wrong):
    card = dict.fromkeys(
        (
            "sensors",
            "kind",
            "licence",
            "map_mode",
            "latency",
            "deterministic",
            "odometry_prior",
            "optional_sensors",
            "needs_still_start",
            "limits",
        ),
        wrong,
    )
    for tell in (cards.sensor_suite, cards.main_sensor, cards.kind, cards.map_mode, cards.latency):
        assert isinstance(tell(card), str)
    assert all(isinstance(limit, str) for limit in cards.known_limits(card))
