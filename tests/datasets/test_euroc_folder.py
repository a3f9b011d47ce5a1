from __future__ import annotations

import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

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
    assert dataset.skipped.counts == {"images without a partner": 2}


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
    ],
)
def test_a_bad_row_costs_that_row_and_is_named(euroc, row, complaint):
    with EurocFolder(euroc) as dataset:
        whole = sum(1 for _ in dataset.measurements([Sensor.IMU]))
    rewrite(euroc / "mav0/imu0/data.csv", 3, row)
    with EurocFolder(euroc) as dataset:
        assert sum(1 for _ in dataset.measurements([Sensor.IMU])) == whole - 1
        (sentence,) = dataset.skipped.sentences()
    assert re.match(rf"1 inertial samples that cannot be read \(first: .*{complaint}", sentence)


def test_a_table_of_which_more_is_wrong_than_right_is_refused(euroc):
    table = euroc / "mav0/imu0/data.csv"
    lines = table.read_text().splitlines()
    table.write_text("\n".join([*lines[:5], *(line.replace(",", ";") for line in lines[5:])]))
    with pytest.raises(DatasetError, match=r"line 6: expected a stamp in whole nanoseconds first"):
        read(euroc)


def test_a_line_without_end_is_no_row(euroc):
    rewrite(euroc / "mav0/imu0/data.csv", 3, "x" * 10_000)
    with pytest.raises(DatasetError, match=r"line 3: longer than 4096 bytes"):
        read(euroc)


def test_a_damaged_image_costs_its_pair_and_is_named(euroc):
    with EurocFolder(euroc) as dataset:
        whole = sum(1 for _ in dataset.measurements([Sensor.STEREO_IMAGES]))
    path = euroc / "mav0/cam0/data/66666667.png"
    data = path.read_bytes()
    for damaged in (data[: len(data) // 2], b"", b"no image", data[:60] + b"\0" * 40 + data[100:], None):
        path.write_bytes(damaged) if damaged is not None else path.unlink()
        with EurocFolder(euroc) as dataset:
            assert sum(1 for _ in dataset.measurements([Sensor.STEREO_IMAGES])) == whole - 1
            (sentence,) = dataset.skipped.sentences()
        assert re.search(r"line 3: (not a whole picture|the image .* does not exist)", sentence)


def test_images_of_16_bits_are_scaled_to_8(euroc):
    with EurocFolder(euroc) as dataset:
        expected = [pair.left for pair in dataset.measurements([Sensor.STEREO_IMAGES])]
    for path in euroc.glob("mav0/cam*/data/*.png"):
        with Image.open(path) as image:
            grey = np.asarray(image.convert("L"))
        Image.fromarray(grey.astype(np.uint16) * 256 + 77).save(path)
    with EurocFolder(euroc) as dataset:
        found = [pair.left for pair in dataset.measurements([Sensor.STEREO_IMAGES])]
    assert len(found) == len(expected)
    assert all(image.dtype == np.uint8 and image.ndim == 2 for image in found)
    grey = [np.asarray(Image.fromarray(image).convert("L")) for image in expected]
    assert all(np.abs(a.astype(int) - b.astype(int)).max() <= 1 for a, b in zip(found, grey, strict=True))


def test_ground_truth_of_a_motion_capture_is_found(euroc):
    with EurocFolder(euroc) as dataset:
        expected = [pose.stamp for pose in dataset.truth()]
    (euroc / "mav0/state_groundtruth_estimate0").rename(euroc / "mav0/mocap0")
    with EurocFolder(euroc) as dataset:
        assert [pose.stamp for pose in dataset.truth()] == expected


@pytest.mark.parametrize(
    ("mode", "size", "complaint"),
    [
        ("L", (64, 96), "64x96 pixels; expected 96x64"),
        ("RGB", (96, 64), "grey and colour images are mixed"),
        ("P", (96, 64), "mode P; expected grey or RGB of 8 bits"),
    ],
)
def test_an_image_of_another_size_or_kind_costs_its_pair(euroc, mode, size, complaint):
    Image.new(mode, size).save(euroc / "mav0/cam1/data/66666667.png")
    dataset = EurocFolder(euroc)
    assert sum(1 for _ in dataset.measurements([Sensor.STEREO_IMAGES])) == 29
    (sentence,) = dataset.skipped.sentences()
    assert complaint in sentence


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("resolution", [96], "resolution: expected a list of 2 numbers"),
        ("resolution", [96, 1e9], "resolution: expected two whole numbers"),
        ("intrinsics", [0, 0, 48, 32], "positive focal lengths"),
        ("intrinsics", [1, 1, 1, ".nan"], "intrinsics: expected a list of 4 numbers"),
        ("camera_model", "omni", "only pinhole is read"),
        ("distortion_model", "barrel", "distortion model 'barrel'; expected one of"),
        ("distortion_coefficients", [1, 2, 3], "3 coefficients .* expected 0 or 4 or 5 or 8"),
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
