"""A run of ours, laid out as the published benchmark lays out its trials, comes back with the same metrics."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from taskslam.datasets.trial_import import import_trials
from taskslam.errors import DatasetError
from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.record import Arrival, GoalFailed, RunRecord, Trajectory, load_run

POSES = "# timestamp tx ty tz qx qy qz qw"
ODOMS = POSES + " vx vy vz wx wy wz"


def write_table(path: Path, header: str, rows: Iterable[Iterable[float]]) -> None:
    """As the authors' loggers write: six decimals, and no file without a row."""
    lines = [" ".join(f"{value:.6f}" for value in row) for row in rows]
    if lines:
        path.write_text("\n".join([header, *lines]) + "\n")


def pose_rows(trajectory: Trajectory, tail: int) -> Iterable[list[float]]:
    for stamp, (x, y, theta) in zip(trajectory.stamps.tolist(), trajectory.poses.tolist(), strict=True):
        yield [stamp / 1e9, x, y, 0, 0, 0, math.sin(theta / 2), math.cos(theta / 2), *[0.0] * tail]


def joined(record: RunRecord, rounds: list[int], name: str) -> Trajectory:
    parts = [record.trajectory(number, name) for number in rounds]
    return Trajectory(np.concatenate([p.stamps for p in parts]), np.concatenate([p.poses for p in parts]))


def lay_out(record: RunRecord, root: Path, method: str = "some_slam", nav_info: bool = True) -> list[Path]:
    """The files of protocol 1.6, in the folders of 1.4; the trial directories."""
    numbers = [start.round for start in record.rounds()]
    trials = [[number] for number in numbers] if record.manifest.mode == "without-map" else [numbers]
    folders = []
    for trial, rounds in enumerate(trials):
        folder = root / "gazebo" / "room" / method / "path0" / f"trial{trial}"
        folder.mkdir(parents=True)
        truth, odometry = (joined(record, rounds, name) for name in ("truth", "odometry"))
        write_table(folder / "act_poses.txt", POSES, pose_rows(truth, 0))
        write_table(folder / "act_odoms.txt", ODOMS, pose_rows(truth, 6))
        write_table(folder / "robot_odoms.txt", ODOMS, pose_rows(odometry, 6))
        write_table(folder / "est_slam_poses.txt", POSES, pose_rows(truth, 0))
        goals = [goal.array().tolist() for goal in record.manifest.goals]
        write_table(folder / "planned_waypoints.txt", "# x y theta", goals)
        visits = [e for e in record.events if isinstance(e, Arrival) and e.round in rounds]
        logged = [[visit.t / 1e9, *visit.target.array().tolist()] for visit in visits]
        write_table(folder / "visited_waypoints.txt", "# timestamp x y theta", logged)
        if nav_info:
            indexed = [[*row, v.goal, v.round - rounds[0]] for row, v in zip(logged, visits, strict=True)]
            header = "# timestamp x y theta wpt_index loop_index"
            write_table(folder / "visited_waypoints_nav_info.txt", header, indexed)
        folders.append(folder)
    return folders


def imported(root: Path, tmp_path: Path, **options: object) -> tuple[RunRecord, dict[str, int]]:
    result = import_trials(root, tmp_path / "imported", **{"rounds": 2, **options})
    assert not result.left_out
    (run,) = result.runs
    return load_run(run.directory), dict(run.missing)


def numbers(metrics: RunMetrics) -> list[float | None]:
    position, orientation, area = metrics.position, metrics.orientation, metrics.n_auc
    return [
        position.precision_m,
        position.accuracy_m,
        orientation.precision_rad,
        orientation.accuracy_rad,
        area.exact,
        area.published,
    ]


def assert_same_metrics(record: RunRecord, original: RunRecord) -> None:
    back, own = run_metrics(record, "x"), run_metrics(original, "x")
    assert back.completeness == own.completeness
    assert numbers(back) == pytest.approx(numbers(own), abs=2e-6)
    assert [w.visits for w in back.waypoints] == [w.visits for w in own.waypoints]


@pytest.mark.parametrize("mode", ["without-map", "with-map"])
@pytest.mark.parametrize("nav_info", [True, False])
def test_metrics_agree_with_those_of_the_run_itself(driven, tmp_path, mode, nav_info):
    lay_out(driven[mode], tmp_path / "published", nav_info=nav_info)
    record, missing = imported(tmp_path / "published", tmp_path)
    assert_same_metrics(record, driven[mode])
    manifest = record.manifest
    assert (manifest.source, manifest.mode, manifest.method) == ("import", mode, "some_slam")
    assert [start.priming for start in record.rounds()] == [s.priming for s in driven[mode].rounds()]
    without = {"trials without visited_waypoints_nav_info.txt: goals told apart by visiting order": 2}
    assert missing == ({} if nav_info else {key: n if mode == "without-map" else 1 for key, n in without.items()})
    for name in ("truth", "odometry"):
        original, back = driven[mode].trajectory(0, name), record.trajectory(0, name)
        # A loop ends with its last visit here, a round of ours with the last sample before it.
        shared = np.isin(back.stamps, original.stamps)
        assert shared.mean() > 0.95
        own = original.poses[np.isin(original.stamps, back.stamps)]
        assert np.abs(back.poses[shared][:, :2] - own[:, :2]).max() < (1e-6 if name == "truth" else 1e-2)


def drop_lines(path: Path, *numbers: int) -> None:
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line for number, line in enumerate(lines, start=1) if number not in numbers) + "\n")


@pytest.mark.parametrize("nav_info", [True, False])
def test_a_skipped_goal_does_not_shift_the_others(driven, tmp_path, nav_info):
    trials = lay_out(driven["without-map"], tmp_path / "published", nav_info=nav_info)
    drop_lines(trials[0] / "visited_waypoints.txt", 3)
    if nav_info:
        drop_lines(trials[0] / "visited_waypoints_nav_info.txt", 3)
    record, _ = imported(tmp_path / "published", tmp_path)
    metrics = run_metrics(record, "x")
    assert [waypoint.visits for waypoint in metrics.waypoints] == [2, 1, 2]
    (failed,) = [event for event in record.events if isinstance(event, GoalFailed)]
    assert (failed.round, failed.goal, failed.outcome) == (0, 1, "unrecorded")
    assert metrics.waypoints[2].position.precision_m < 0.2


def test_a_gap_in_the_ground_truth_leaves_the_other_arrivals(driven, tmp_path):
    trials = lay_out(driven["without-map"], tmp_path / "published")
    arrival = next(event for event in driven["without-map"].events if isinstance(event, Arrival) and event.goal == 1)
    rows = (trials[0] / "act_poses.txt").read_text().splitlines()
    kept = [row for row in rows if row.startswith("#") or abs(float(row.split()[0]) - arrival.t / 1e9) > 0.06]
    (trials[0] / "act_poses.txt").write_text("\n".join(kept) + "\n")
    record, missing = imported(tmp_path / "published", tmp_path)
    assert missing == {"arrivals without a true pose within 0.05 s": 1}
    truths = [event.truth is None for event in record.events if isinstance(event, Arrival)]
    assert truths == [False, True, False, False, False, False]
    assert run_metrics(record, "x").completeness == 1.0


def test_rounds_that_are_missing_count_as_missed(driven, tmp_path):
    lay_out(driven["without-map"], tmp_path / "published")
    record, missing = imported(tmp_path / "published", tmp_path, rounds=5)
    assert missing == {"trials that are not there": 3}
    assert run_metrics(record, "x").completeness == 0.0
    assert record.manifest.failure == "9 of 15 arrivals are missing"


def test_rounds_beyond_those_that_count_are_left_out(driven, tmp_path):
    lay_out(driven["without-map"], tmp_path / "published")
    _, missing = imported(tmp_path / "published", tmp_path, rounds=1)
    assert missing == {"trials left out: more than the rounds that count": 1}


def test_a_trial_that_reached_nothing_is_a_round_without_arrivals(driven, tmp_path):
    trials = lay_out(driven["without-map"], tmp_path / "published")
    for name in ("visited_waypoints.txt", "visited_waypoints_nav_info.txt", "planned_waypoints.txt", "act_poses.txt"):
        (trials[1] / name).unlink()
    record, missing = imported(tmp_path / "published", tmp_path)
    assert [waypoint.visits for waypoint in run_metrics(record, "x").waypoints] == [1, 1, 1]
    assert missing == {"trials without visited_waypoints.txt: no goal reached, or the log lost": 1}


def test_the_folder_says_the_mode(driven, tmp_path):
    lay_out(driven["without-map"], tmp_path / "published")
    (tmp_path / "published" / "gazebo").rename(tmp_path / "published" / "localization")
    record, missing = imported(tmp_path / "published", tmp_path)
    assert record.manifest.mode == "with-map"
    assert missing["loops that are not there"] == 2


@pytest.mark.parametrize(
    ("file", "content", "complaint"),
    [
        ("visited_waypoints_nav_info.txt", "1.0 0 0 0 7 0\n", r"line 1: goal 7 in loop 0; expected .* of 3 goals"),
        ("visited_waypoints_nav_info.txt", "1.0 9 9 0 0 0\n", "line 1: the pose is not that of goal 0"),
        ("visited_waypoints_nav_info.txt", "1.0 0 0 0 0.5 0\n", "goal 0.5 in loop 0; expected whole numbers"),
        ("visited_waypoints_nav_info.txt", "1.0 0 0 0\n2.0 0 0 0\n", "line 1: expected 'timestamp x y theta wpt"),
        ("planned_waypoints.txt", "1 2 3\n", "planned different goals"),
        ("planned_waypoints.txt", "nan 2 3\n", "a goal that is not finite"),
        ("act_poses.txt", "hello\nworld\n", "line 1: expected 8 numbers"),
        ("act_poses.txt", "1 0 0 0 0 0 0 nan\n", ""),
    ],
)
def test_a_damaged_file_leaves_its_trials_out_and_the_others_in(driven, tmp_path, file, content, complaint):
    lay_out(driven["without-map"], tmp_path / "published", "other_slam")
    trials = lay_out(driven["without-map"], tmp_path / "published")
    (trials[0] / file).write_text(content)
    result = import_trials(tmp_path / "published", tmp_path / "imported", rounds=2)
    assert result.runs[0].name == "room_path0 / other_slam / without-map"
    if complaint:
        (reason,) = result.left_out.values()
        assert re.search(complaint, reason)
    else:
        assert result.runs[1].missing["rows of act_poses.txt that are no finite pose"] == 1


def test_a_folder_without_trials_says_what_was_expected(tmp_path):
    with pytest.raises(DatasetError, match="ENVIRONMENT/METHOD/PATH/trial<k>"):
        import_trials(tmp_path, tmp_path / "out")
