from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from taskslam.benchmark.export import ExportRequest, Format, export
from taskslam.errors import DatasetError, TaskSlamError
from taskslam.measurements import Sensor
from taskslam.record import load_run

SMALL = frozenset({Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY})


def checksums(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "run.json"
    }


@pytest.mark.parametrize("form", [Format.ROSBAG1, Format.ROSBAG2, Format.MCAP])
def test_the_same_seed_writes_the_same_bytes(make_stage, tmp_path, form):
    for name in ("a", "b"):
        assert not export(make_stage(), ExportRequest(form, SMALL, seconds=1.5), tmp_path / name)
    assert checksums(tmp_path / "a") == checksums(tmp_path / "b")
    export(make_stage(), ExportRequest(form, SMALL, seed=1, seconds=1.5), tmp_path / "c")
    assert checksums(tmp_path / "a") != checksums(tmp_path / "c")


def test_an_euroc_folder_holds_what_the_form_knows(make_stage, tmp_path):
    request = ExportRequest(Format.EUROC, seconds=0.5)
    export(make_stage(), request, tmp_path / "euroc")
    assert sorted(place.name for place in (tmp_path / "euroc/mav0").iterdir()) == [
        "cam0", "cam1", "imu0", "state_groundtruth_estimate0",
    ]  # fmt: skip
    assert len(list((tmp_path / "euroc/mav0/cam1/data").iterdir())) == 15


def test_the_drive_to_the_first_goals_stands_beside_the_dataset(make_stage, tmp_path):
    assert export(make_stage(), ExportRequest(Format.MCAP, SMALL, goals=1), tmp_path / "one")
    drive = load_run(tmp_path / "one" / "drive")
    assert drive.manifest.complete
    assert len(drive.manifest.goals) == 1
    assert drive.manifest.rounds == 1
    assert len(drive.trajectory(0, "truth")) > 100


@pytest.mark.parametrize(
    ("request_", "complaint"),
    [
        (ExportRequest(Format.EUROC, SMALL), "not laser_scan, wheel_odometry; write rosbag1, rosbag2 or mcap"),
        (ExportRequest(Format.MCAP, SMALL, method="no_such"), "no_such"),
        (ExportRequest(Format.MCAP, frozenset({Sensor.TRUE_POSE})), "the robot has no true_pose"),
    ],
)
def test_a_wrong_request_leaves_nothing(make_stage, tmp_path, request_, complaint):
    with pytest.raises(TaskSlamError, match=complaint):
        export(make_stage(), request_, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_what_exists_is_not_replaced(make_stage, tmp_path):
    with pytest.raises(DatasetError, match="exists already"):
        export(make_stage(), ExportRequest(Format.MCAP, SMALL), tmp_path)


def test_a_drive_that_breaks_down_leaves_nothing(make_stage, tmp_path):
    broken = ExportRequest(Format.MCAP, SMALL, method="karto", options={"no_such_option": 1})
    with pytest.raises(TaskSlamError):
        export(make_stage(), broken, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
