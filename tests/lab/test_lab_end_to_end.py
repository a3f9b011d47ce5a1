"""From rendered pictures to metrics: tags on the ceiling; robots that stray, cameras that die."""

from __future__ import annotations

import csv
import json
import math
import shutil
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from taskslam.evaluation import evaluate_runs
from taskslam.evaluation.metrics_file import RunMetrics, write_metrics
from taskslam.geometry import SE2, wrap_angle
from taskslam.lab.folder import INSIDE_OUT, OUTSIDE_IN
from taskslam.lab.lab_file import Lab
from taskslam.lab.virtual_lab import photograph
from taskslam.record import RunRecord
from taskslam.robot import load_robot
from taskslam.world.loading import load_world

pytest.importorskip("apriltag", reason="needs the extra `apriltag`")
pytest.importorskip("cv2", reason="needs the extra `apriltag`")

Drive = Callable[..., RunRecord]
STRAY = (2, 11)  # round and goal at which the robot says that it has arrived, and is in another room


@pytest.fixture(scope="module")
def strayed(drive: Drive, small_lab: Lab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What one camera over waypoints 1 and 12 recorded in three rounds."""
    where = tmp_path_factory.mktemp("stray")
    run = drive(where / "run", (0, 11), 3, strays={STRAY: SE2(20.0, 0.0, 0.0)})
    lab = small_lab.model_copy(update={"cameras": small_lab.cameras[:1], "ceiling": None})
    photograph(run, load_world("house"), load_robot("turtlebot2"), lab, where / "lab")
    return where / "lab"


def pictures(folder: Path, number: int, goal: int) -> list[Path]:
    rows = csv.DictReader((folder / "truth" / "pictures.csv").open())
    return [folder / row["file"] for row in rows if (int(row["round"]), int(row["waypoint"]) - 1) == (number, goal)]


def measured(folder: Path, out: Path) -> tuple[RunMetrics, dict[tuple[int, int], str]]:
    from taskslam.realworld.measure import measure_outside_in
    from taskslam.realworld.setup_file import OutsideInSetup, load_setup

    (run,) = measure_outside_in(load_setup(folder / OUTSIDE_IN, OutsideInSetup), out)
    (metrics,) = evaluate_runs([out]).runs
    return metrics, {(a.arrival.round, a.arrival.goal): f"{a.verdict}: {a.reason}" for a in run.arrivals}


def with_a_dead_camera(lab: Path, place: Path, *rounds: int) -> Path:
    """A copy of the lab without the pictures of the last waypoint in these rounds."""
    folder = place / "lab"
    shutil.copytree(lab, folder)
    for number in rounds:
        for path in pictures(folder, number, STRAY[1]):
            path.unlink()
    return folder


def test_the_lab_keeps_what_a_recorder_would(strayed: Path) -> None:
    """A picture every 1.5 s at most where the robot is not, more where it is."""
    there, elsewhere = pictures(strayed, 1, 11), pictures(strayed, *STRAY)
    assert len(elsewhere) >= 3
    assert len(there) > len(elsewhere)
    stamps = sorted(float(path.stem) for path in elsewhere)
    assert min(b - a for a, b in pairwise(stamps)) >= 1.5


def test_a_robot_that_never_came_into_sight_has_not_arrived(strayed: Path, tmp_path: Path) -> None:
    metrics, said = measured(strayed, tmp_path / "out")
    assert said[STRAY].startswith("not seen: tag 0 was not found in ")
    assert [text for key, text in said.items() if key != STRAY] == ["measured: "] * 5
    waypoint = metrics.waypoints[11]
    assert (waypoint.complete, waypoint.unjudged, waypoint.visits, waypoint.rounds) == (False, None, 2, 3)
    assert metrics.waypoints[0].complete
    (failure,) = [one for one in metrics.failures if (one.round, one.goal) == STRAY]
    assert failure.outcome == "not_seen"
    assert "navigation reported an arrival, but tag 0 was not found" in failure.detail


def test_a_camera_that_was_dead_decides_nothing(strayed: Path, tmp_path: Path) -> None:
    metrics, said = measured(with_a_dead_camera(strayed, tmp_path, STRAY[0]), tmp_path / "out")
    assert "ambiguous: camera corridor took no image during the pause; the nearest, " in said[STRAY]
    waypoint = metrics.waypoints[11]  # judged on the two rounds that were measured
    assert (waypoint.complete, waypoint.unjudged, waypoint.visits, waypoint.rounds) == (True, None, 2, 2)


def test_a_camera_that_was_dead_twice_of_three_times_leaves_nothing_to_judge(strayed: Path, tmp_path: Path) -> None:
    metrics, _ = measured(with_a_dead_camera(strayed, tmp_path, 1, 2), tmp_path / "out")
    reason = metrics.waypoints[11].unjudged
    assert reason is not None
    assert reason.startswith("1 of 3 rounds measured; round 2 is ambiguous: camera corridor took no image")


def test_a_camera_that_died_hides_no_absence(strayed: Path, tmp_path: Path) -> None:
    """The robot was elsewhere in round 3; that the camera was off in rounds 1 and 2 does not excuse it."""
    metrics, _ = measured(with_a_dead_camera(strayed, tmp_path, 0, 1), tmp_path / "out")
    waypoint = metrics.waypoints[11]
    assert (waypoint.complete, waypoint.unjudged, waypoint.visits, waypoint.rounds) == (False, None, 0, 1)


def test_tags_on_the_ceiling_give_every_arrival_to_a_millimetre(drive: Drive, small_lab: Lab, tmp_path: Path) -> None:
    """Two waypoints, two rounds, four tags over each; the robot sways about its wheels."""
    from taskslam.realworld.measure import measure_inside_out
    from taskslam.realworld.setup_file import InsideOutSetup, load_setup

    goals = (3, 8)
    sway = small_lab.sway.model_copy(update={"pivot": 0.0})
    lab = small_lab.model_copy(update={"cameras": (), "tag": None, "sway": sway})
    folder, out = tmp_path / "lab", tmp_path / "out"
    run = drive(tmp_path / "run", goals, 2)
    (setup,) = photograph(run, load_world("house"), load_robot("turtlebot2"), lab, folder)
    assert setup.name == INSIDE_OUT
    measure_inside_out(load_setup(setup, InsideOutSetup), out)
    content = json.loads(write_metrics(out, evaluate_runs([out])).read_text())
    (metrics,) = content["runs"]
    assert (metrics["completeness"], metrics["complete_waypoints"], metrics["truth_frame"]) == (1.0, 2, "map")
    assert [w["goal"] for w in metrics["waypoints"] if w["complete"]] == list(goals)

    true = {
        (int(row["round"]), int(row["waypoint"]) - 1): SE2(*(float(row[name]) for name in ("x", "y", "theta")))
        for row in csv.DictReader((folder / "truth" / "arrivals.csv").open())
    }
    seen = {
        (visit["round"], goal): SE2(*visit["truth"])
        for goal in goals
        for visit in metrics["waypoints"][goal]["arrivals"]
    }
    assert seen.keys() == true.keys()
    for cell, pose in seen.items():
        assert pose.distance_to(true[cell]) < 1e-3
        assert abs(wrap_angle(pose.theta - true[cell].theta)) < math.radians(0.1)
    for goal in goals:
        apart = true[0, goal].distance_to(true[1, goal])
        assert apart > 0.01  # so that there is something to measure
        E = metrics["waypoints"][goal]["position"]["precision_m"]
        assert abs(E - apart / 2) < 1e-3
