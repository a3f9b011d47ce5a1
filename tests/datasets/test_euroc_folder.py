from __future__ import annotations

import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from taskslam.datasets.euroc_folder import EurocFolder
from taskslam.datasets.euroc_writer import EUROC_SENSORS, EurocWriter
from taskslam.errors import DatasetError
from taskslam.measurements import Sensor, StereoImages


def read(folder: Path) -> list:
    return list(EurocFolder(folder).measurements(EUROC_SENSORS))


def test_what_was_written_comes_back_bit_for_bit(euroc, recorded, is_same):
    written, back = recorded.of(EUROC_SENSORS), read(euroc)
    assert len(back) == len(written) == 130
    assert all(map(is_same, written, back))
    assert EurocFolder(euroc).rig.stereo == recorded.robot.rig.stereo
    assert EurocFolder(euroc).rig.imu == recorded.robot.rig.imu


def test_the_truth_comes_back_bit_for_bit(euroc, recorded):
    back = list(EurocFolder(euroc).truth())
    assert [pose.stamp for pose in back] == [stamp for stamp, _ in recorded.truth]
    assert all(
        np.array_equal(pose.T_world_base, at.matrix()) for pose, (_, at) in zip(back, recorded.truth, strict=True)
    )


def test_the_same_drive_writes_the_same_bytes(euroc, recorded, tmp_path):
    again = tmp_path / "again"
    again.mkdir()
    writer = EurocWriter(again, recorded.robot, EUROC_SENSORS)
    for measurement in recorded.of(EUROC_SENSORS):
        writer.measurement(measurement)
    writer.close()
    for path in sorted(again.rglob("*")):
        if path.is_file() and "groundtruth" not in str(path):
            assert path.read_bytes() == (euroc / path.relative_to(again)).read_bytes()


def test_without_our_robot_file_the_rig_follows_from_the_sensor_files(euroc, recorded, is_same):
    (euroc / "robot.yaml").unlink()
    dataset, robot = EurocFolder(euroc), recorded.robot
    assert dataset.sensors == EUROC_SENSORS
    assert np.allclose(dataset.rig.stereo.mount.matrix(), robot.rig.stereo.mount.matrix())
    assert math.isclose(dataset.rig.stereo.focal_length, robot.rig.stereo.focal_length)
    assert math.isclose(dataset.rig.stereo.baseline, robot.rig.stereo.baseline)
    assert math.isclose(dataset.rig.imu.gyro_noise, robot.rig.imu.gyro_noise)
    assert all(map(is_same, recorded.of(EUROC_SENSORS), dataset.measurements(EUROC_SENSORS)))


def test_a_folder_as_the_dataset_server_has_it_is_read(euroc):
    """Windows line ends, an OpenCV header, mav0 itself as the folder, distorted cameras."""
    (euroc / "robot.yaml").unlink()
    for camera in ("cam0", "cam1"):
        folder = euroc / "mav0" / camera
        rows = (folder / "data.csv").read_text().replace("\n", "\r\n")
        (folder / "data.csv").write_text(rows, newline="")
        keys = yaml.safe_load((folder / "sensor.yaml").read_text())
        keys["distortion_coefficients"] = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
        (folder / "sensor.yaml").write_text("%YAML:1.0\n" + yaml.safe_dump(keys))
    dataset = EurocFolder(euroc / "mav0")
    pairs = list(dataset.measurements({Sensor.STEREO_IMAGES}))
    assert len(pairs) == 30
    assert all(isinstance(pair, StereoImages) and pair.left.shape == (64, 96) for pair in pairs)


def test_images_without_a_partner_are_skipped_and_counted(euroc):
    rows = (euroc / "mav0/cam1/data.csv").read_text().splitlines()
    (euroc / "mav0/cam1/data.csv").write_text("\n".join(rows[:4] + rows[6:]) + "\n")
    dataset = EurocFolder(euroc)
    assert len(list(dataset.measurements({Sensor.STEREO_IMAGES}))) == 28
    assert dataset.skipped == {"images without a partner": 2}


def test_lidar_and_odometry_have_no_place_in_the_form(tmp_path, recorded):
    with pytest.raises(DatasetError, match=r"not laser_scan; write rosbag1, rosbag2 or mcap"):
        EurocWriter(tmp_path, recorded.robot, frozenset({Sensor.LASER_SCAN, Sensor.IMU}))


def rewrite(path: Path, line: int, text: str) -> None:
    lines = path.read_text().splitlines()
    lines[line - 1] = text
    path.write_text("\n".join(lines) + "\n")


def test_an_image_outside_the_folder_is_never_opened(euroc, tmp_path):
    (tmp_path / "secret.png").write_bytes((euroc / "mav0/cam0/data/33333333.png").read_bytes())
    for name in ("../../../../secret.png", str(tmp_path / "secret.png"), "..", "", "\0", "a/../../data.csv"):
        rewrite(euroc / "mav0/cam0/data.csv", 2, f"33333333,{name}")
        with pytest.raises(DatasetError, match=r"data\.csv, line 2: "):
            read(euroc)
    (euroc / "mav0/cam0/data/link.png").symlink_to(tmp_path / "secret.png")
    rewrite(euroc / "mav0/cam0/data.csv", 2, "33333333,link.png")
    with pytest.raises(DatasetError, match="not a file inside"):
        read(euroc)


def test_a_pipe_in_place_of_an_image_does_not_hang(euroc):
    path = euroc / "mav0/cam0/data/33333333.png"
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(DatasetError, match="does not exist"):
        read(euroc)


@pytest.mark.parametrize(
    ("row", "complaint"),
    [
        ("20000000,nan,0,0,0,0,0", r"imu0/data\.csv, line 3: expected a stamp and 6 finite numbers"),
        ("20000000,0,0,0", r"line 3: expected a stamp and 6 finite numbers"),
        ("5,0,0,0,0,0,0", r"line 3: stamp 5 is not later than 10000000"),
        ("10000000,0,0,0,0,0,0", r"line 3: stamp 10000000 is not later"),
        ("1.5e7,0,0,0,0,0,0", r"line 3: expected a stamp in whole nanoseconds"),
        ("99999999999999999999999999,0,0,0,0,0,0", r"line 3: expected a stamp in whole nanoseconds"),
        ("20000000;0;0;0;0;0;0", r"line 3: expected a stamp in whole nanoseconds"),
        ("x" * 10_000, r"line 3: longer than 4096 bytes"),
    ],
)
def test_a_bad_row_is_named(euroc, row, complaint):
    rewrite(euroc / "mav0/imu0/data.csv", 3, row)
    with pytest.raises(DatasetError, match=complaint):
        read(euroc)


def test_damaged_images_are_named(euroc):
    path = euroc / "mav0/cam0/data/66666667.png"
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", b"no image", whole[:60] + b"\0" * 40 + whole[100:]):
        path.write_bytes(damaged)
        with pytest.raises(DatasetError, match=r"cam0/data\.csv, line 3: not a whole picture"):
            read(euroc)
    path.unlink()
    with pytest.raises(DatasetError, match=r"line 3: the image .* does not exist"):
        read(euroc)


def test_images_of_another_size_or_kind_are_refused(euroc):
    from PIL import Image

    path = euroc / "mav0/cam1/data/66666667.png"
    Image.new("L", (64, 96)).save(path)
    with pytest.raises(DatasetError, match="64x96 pixels; expected 96x64"):
        read(euroc)
    Image.new("RGB", (96, 64)).save(path)
    with pytest.raises(DatasetError, match="grey and colour images are mixed"):
        read(euroc)
    Image.new("I;16", (96, 64)).save(path)
    with pytest.raises(DatasetError, match="mode I;16; expected 8-bit"):
        read(euroc)


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("resolution", [96], "resolution: expected a list of 2 numbers"),
        ("resolution", [96, 1e9], "resolution: expected two whole numbers"),
        ("intrinsics", [0, 0, 48, 32], "positive focal lengths"),
        ("intrinsics", [1, 1, 1, ".nan"], "intrinsics: expected a list of 4 numbers"),
        ("camera_model", "omni", "only pinhole is read"),
        ("distortion_model", "barrel", "distortion model 'barrel'; expected one of"),
        ("distortion_coefficients", [1, 2, 3], "expected a list of 0 or 4 or 5 or 8 numbers"),
        ("T_BS", {"data": [0] * 16}, "not a rigid transform"),
        ("T_BS", None, "T_BS: expected the sensor's pose"),
        ("rate_hz", 0, "rate_hz: expected a positive number"),
    ],
)
def test_a_wrong_key_of_a_camera_is_named(euroc, key, value, complaint):
    path = euroc / "mav0/cam0/sensor.yaml"
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), key: value}))
    with pytest.raises(DatasetError, match=complaint) as caught:
        EurocFolder(euroc)
    assert "cam0/sensor.yaml" in str(caught.value)


def test_calibrations_beyond_all_bounds_are_refused(euroc):
    (euroc / "robot.yaml").unlink()
    path = euroc / "mav0/cam0/sensor.yaml"
    whole = path.read_text()
    for rate in ("1" + "0" * 400, "1e300"):
        path.write_text(re.sub(r"rate_hz: .*", f"rate_hz: {rate}", whole))
        with pytest.raises(DatasetError, match=r"64 bits|rate"):
            read(euroc)
