from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import RobotError
from taskslam.robot import load_robot, robot_presets


def test_turtlebot2_has_the_published_numbers() -> None:
    robot = load_robot("turtlebot2")
    lidar = robot.rig.lidar_2d
    assert lidar is not None
    assert (lidar.samples, lidar.rate, lidar.range_min, lidar.range_max, lidar.noise) == (1024, 10.0, 0.10, 10.0, 0.01)
    assert np.allclose(lidar.mount.matrix()[:3, 3], (0.04, 0.0, 0.4102))
    assert robot.footprint.radius == 0.178
    assert robot.drive.max_linear_acceleration == 0.6
    assert robot.rig.odometry.gyro_noise == 0.00276


def test_every_preset_loads() -> None:
    assert "turtlebot2" in robot_presets()
    for name in robot_presets():
        assert load_robot(name).name == name


def test_an_unknown_preset_is_named_with_a_guess() -> None:
    with pytest.raises(RobotError, match=r"'turtlebot3'.*Did you mean 'turtlebot2'"):
        load_robot("turtlebot3")


def test_a_wrong_key_or_value_in_a_robot_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("name: mine\nwheels: 3\n")
    with pytest.raises(RobotError, match=r"mine\.yaml: the key 'drive' is missing"):
        load_robot(file)
    with pytest.raises(RobotError, match="cannot read"):
        load_robot(tmp_path / "absent.yaml")
    file.write_text("name: [")
    with pytest.raises(RobotError, match="not valid YAML"):
        load_robot(file)


def test_a_robot_built_on_another_gives_only_what_differs(tmp_path: Path) -> None:
    (tmp_path / "slow.yaml").write_text(
        "built_on: turtlebot2\nname: slow\nrig: {stereo: {rate: 5.0}, lidar_3d: null}\n"
    )
    (tmp_path / "slower.yaml").write_text("built_on: slow.yaml\nname: slower\nrig: {stereo: {rate: 1.0}}\n")
    paper, slower = load_robot("turtlebot2"), load_robot(tmp_path / "slower.yaml")
    assert paper.rig.stereo is not None
    assert slower.rig.stereo == paper.rig.stereo.model_copy(update={"rate": 1.0})
    assert slower.rig.lidar_3d is None
    assert (slower.drive, slower.rig.lidar_2d) == (paper.drive, paper.rig.lidar_2d)


def test_a_robot_built_on_itself_or_on_nothing_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("built_on: mine.yaml\nname: mine\n")
    with pytest.raises(RobotError, match=r"mine\.yaml is built on itself"):
        load_robot(file)
    file.write_text("built_on: turtlebot3\nname: mine\n")
    with pytest.raises(RobotError, match="Did you mean 'turtlebot2'"):
        load_robot(file)
    file.write_text("built_on: [turtlebot2]\nname: mine\n")
    with pytest.raises(RobotError, match=r"expected the name of a robot or a \.yaml file"):
        load_robot(file)
    file.write_text("built_on: turtlebot2\nname: mine\nrig: {stereo: {raet: 5.0}}\n")
    with pytest.raises(RobotError, match=r"rig\.stereo\.raet.*Did you mean"):
        load_robot(file)


def test_the_paper_s_real_camera_has_its_published_numbers() -> None:
    stereo = load_robot("turtlebot2_d435i").rig.stereo
    assert stereo is not None
    assert (stereo.width, stereo.height, stereo.rate, stereo.baseline) == (640, 480, 30.0, 0.05)
    assert np.isclose(np.degrees(stereo.horizontal_fov), 87.0)


def test_what_a_run_draws_is_refused_on_the_data_sheet_that_methods_read(tmp_path: Path) -> None:
    robot = load_robot("turtlebot2")
    assert robot.imperfections.odometry.scale == -0.0029
    for key in ("scale", "slip", "gyro_bias", "accel_bias"):
        assert key not in robot.rig.model_dump_json()
    file = tmp_path / "mine.yaml"
    file.write_text("built_on: turtlebot2\nname: mine\nrig: {odometry: {scale: 0.01}}\n")
    with pytest.raises(RobotError, match=r"rig\.odometry\.scale: expected under imperfections\.odometry\.scale"):
        load_robot(file)
