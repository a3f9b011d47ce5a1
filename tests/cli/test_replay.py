"""The verbs of recordings, from export to the judgement of a replay."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.errors import InputError
from taskslam.record import load_run


def call(*arguments: object):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_a_house_drive_is_exported_and_replayed(tmp_path):
    out = tmp_path / "house"
    sensors = ("--sensors", "lidar_2d,odometry", "--seconds", 2)
    exported = call("export", "house", "--out", out, "--format", "rosbag2", *sensors)
    assert exported.exit_code == 0, exported.output
    assert f"Dataset: {out}" in exported.output
    replayed = call("replay", out, "-m", "wheel_odometry", "--rounds", 2, "--out", tmp_path / "replays")
    assert replayed.exit_code == 0, replayed.output
    run = load_run(tmp_path / "replays/house/wheel_odometry/without-map/seed0")
    assert run.manifest.rounds == 2
    assert len(run.trajectory(1, "estimate")) == 100


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("export", "house", "--out", "x", "--format", "mcap", "--sensors", "lidar2d"), "Did you mean 'lidar_2d'"),
        (("export", "house", "--out", "x", "--format", "euroc", "--robot", "turtlebot3"), "turtlebot3"),
        (("replay", "nowhere.bag", "-m", "karto"), "nowhere.bag: no such file or folder"),
        (("replay", "nowhere.bag", "-m", "carto"), "Did you mean 'karto'"),
        (("replay", "nowhere.bag", "-m", "karto", "--topic", "scan"), "--topic scan: expected NAME=VALUE"),
        (("import-trials", "nowhere"), "holds no trial"),
    ],
)
def test_wrong_use_is_one_sentence(tmp_path, monkeypatch, arguments, complaint):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments)
    assert isinstance(result.exception, InputError)
    assert complaint in str(result.exception)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", ["export", "replay", "import-trials"])
def test_help_shows_examples(verb):
    assert f"taskslam {verb}" in call(verb, "--help").output
