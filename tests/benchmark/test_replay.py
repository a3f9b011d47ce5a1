"""A drive exported and replayed gives what the closed loop gave; and what a recording cannot give is said."""

from __future__ import annotations

import shutil
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taskslam.benchmark.export import ExportRequest, Format, export
from taskslam.benchmark.replay import replay
from taskslam.benchmark.spec import spec_of_replay
from taskslam.datasets.opening import open_dataset
from taskslam.errors import DatasetError, InputError, RecordError
from taskslam.evaluation import evaluate_runs
from taskslam.measurements import Sensor
from taskslam.mode import Mode
from taskslam.record import MethodNotice, RoundEnded, RunRecord, load_run
from taskslam.record.run_directory import JOURNAL
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel
from taskslam.stopping import StoppedError
from taskslam.studies.study import load_study

SENSORS = frozenset({Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY})
SECONDS = 6.0


@pytest.fixture(autouse=True)
def _find_methods_of_these_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the recording is made once."""
    return tmp_path_factory.mktemp("original") / "recording"


@pytest.fixture
def recording(make_stage, original: Path, tmp_path: Path) -> Path:
    """Six seconds steered by karto."""
    if not original.exists():
        export(make_stage(), ExportRequest(Format.MCAP, SENSORS, method="karto", seconds=SECONDS), original)
    return Path(shutil.copytree(original, tmp_path / "recording"))


def run(recording: Path, *way: Any, out: str = "replays", **named: Any) -> RunRecord:
    with open_dataset(recording) as dataset:
        directory, _ = replay(dataset, spec_of_replay(dataset, *way, **named), recording.parent / out)
    return load_run(directory)


def test_replayed_measurements_give_the_poses_of_the_live_loop(recording):
    live, back = load_run(recording / "drive"), run(recording, "karto", rounds=2)
    drove, replayed = live.trajectory(0, "estimate"), back.trajectory(0, "estimate")
    shared = np.isin(replayed.stamps, drove.stamps)
    assert np.array_equal(replayed.stamps[shared], drove.stamps)
    assert len(drove) > 50
    assert np.abs(replayed.poses[shared] - drove.poses).max() < 1e-15  # what a TUM file's quaternion loses
    assert np.array_equal(back.trajectory(1, "estimate").poses, replayed.poses)
    truth = back.trajectory(0, "truth")
    assert np.array_equal(truth.stamps, live.trajectory(0, "truth").stamps)
    assert np.abs(truth.poses - live.trajectory(0, "truth").poses).max() < 1e-15
    assert (back.manifest.source, back.manifest.driven_by) == ("replay", "recording")
    assert back.manifest.goals == ()
    assert 20 << 20 < back.manifest.method_peak_bytes < 4 << 30
    assert back.manifest.complete


def test_a_saved_map_is_loaded_by_every_round_that_counts(recording):
    record = run(recording, "karto", Mode.WITH_MAP, rounds=2)
    assert [start.priming for start in record.rounds()] == [True, False, False]
    priming, first, second = (record.trajectory(number, "estimate").poses for number in range(3))
    assert np.array_equal(first, second)
    assert not np.array_equal(priming, first)
    assert np.abs(priming - first)[:, :2].max() < 0.05


def test_a_method_that_lives_on_is_carried_back(recording):
    """Its rounds lie in one lifetime: stamps go on for the method, and are the recording's own in the record."""
    record = run(recording, "replayed_methods:Counting", Mode.WITH_MAP, rounds=2)
    rounds = [record.trajectory(number, "estimate") for number in range(3)]
    assert [len(trajectory) for trajectory in rounds] == [60, 60, 60]
    assert all(np.array_equal(trajectory.stamps, rounds[0].stamps) for trajectory in rounds)
    counts = np.concatenate([trajectory.poses[:, 0] for trajectory in rounds]) - rounds[0].poses[0, 0]
    assert np.allclose(np.diff(counts), 1.0)
    assert [event.frames for event in record.events if isinstance(event, RoundEnded)] == [60, 60, 60]


def test_latency_drops_frames_as_in_the_loop(recording):
    fixed = LatencyModel(LatencyMode.FIXED)
    ended = [
        event
        for event in run(recording, "replayed_methods:Counting", latency=fixed).events
        if isinstance(event, RoundEnded)
    ]
    assert (ended[0].frames, ended[0].dropped_frames) == (60, 0)
    ended = [
        event
        for event in run(recording, "replayed_methods:Slow", latency=fixed).events
        if isinstance(event, RoundEnded)
    ]
    assert (ended[0].frames, ended[0].dropped_frames) == (60, 35)  # 6 s of scans at 0.25 s each: 25 are taken


def test_no_method_but_a_reference_is_told_the_truth(recording):
    record = run(recording, "replayed_methods:Nosy")
    assert not [event for event in record.events if isinstance(event, MethodNotice) and "crashed" in event.text]
    reference = run(recording, "ground_truth")
    truth, told = reference.trajectory(0, "truth"), reference.trajectory(0, "estimate")
    assert np.abs(truth.poses - told.poses).max() < 1e-12


def test_a_method_that_fails_ends_its_round_and_not_the_replay(recording):
    record = run(recording, "replayed_methods:Dies", rounds=2)
    outcomes = [str(event.outcome) for event in record.events if isinstance(event, RoundEnded)]
    assert outcomes == ["crashed", "crashed"]
    assert not record.manifest.complete
    assert "round 1: crashed" in record.manifest.failure
    assert len(record.trajectory(0, "estimate")) > 5


def test_a_recording_without_the_sensor_says_what_it_holds(recording, tmp_path):
    with (
        open_dataset(recording) as dataset,
        pytest.raises(DatasetError, match=r"needs stereo_images, .* \(it gives laser_scan, wheel_odometry\)"),
    ):
        replay(dataset, spec_of_replay(dataset, "orb_slam3"), tmp_path / "out")
    with open_dataset(recording) as dataset, pytest.raises(InputError, match="keeps no map"):
        replay(dataset, spec_of_replay(dataset, "wheel_odometry", Mode.WITH_MAP), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_finished_replay_is_kept_and_another_one_is_not_overwritten(recording):
    first = run(recording, "wheel_odometry")
    assert run(recording, "wheel_odometry").manifest.started_utc == first.manifest.started_utc
    with pytest.raises(RecordError, match="another configuration"):
        run(recording, "wheel_odometry", rounds=2)


def test_goal_metrics_leave_a_replay_out_and_say_where_to_go(recording):
    run(recording, "wheel_odometry")
    metrics = evaluate_runs([recording.parent / "replays"])
    assert metrics.runs == ()
    assert "evaluate-trajectories" in metrics.left_out[0].reason


def test_a_folder_of_replays_is_a_study(recording):
    run(recording, "replayed_methods:Counting", Mode.WITH_MAP, rounds=2)
    run(recording, "wheel_odometry", rounds=2)
    study = load_study(str(recording.parent / "replays"))
    sequence = study.sequences["recording"]
    assert sequence.groundtruth.endswith("round00/truth.tum")
    assert {method: len(runs) for method, runs in sequence.runs.items()} == {
        "replayed_methods:Counting with map": 2,
        "wheel_odometry": 2,
    }
    assert all("round00" not in path for path in sequence.runs["replayed_methods:Counting with map"])


def test_two_ways_of_one_method_are_two_methods_of_the_study(recording):
    run(recording, "karto", rounds=1, out="ways")
    run(recording, "karto", rounds=1, out="ways", options={"do_loop_closing": False})
    sequence = load_study(str(recording.parent / "ways")).sequences["recording"]
    assert sorted(sequence.runs) == ["karto (default options)", "karto (do_loop_closing = False)"]


def test_a_replay_that_was_interrupted_goes_on_with_the_round_that_had_not_ended(recording, monkeypatch):
    undisturbed = run(recording, "karto", rounds=3, out="undisturbed")
    starts, start = [], MethodHost.start

    def interrupted(host):
        starts.append(host)
        if len(starts) == 3:
            raise StoppedError(signal.SIGTERM)
        start(host)

    monkeypatch.setattr(MethodHost, "start", interrupted)
    with pytest.raises(StoppedError) as stop:
        run(recording, "karto", rounds=3)
    assert "2 rounds ended" in stop.value.__notes__[0]
    record = run(recording, "karto", rounds=3)
    assert len(starts) == 4
    assert record.manifest.files == undisturbed.manifest.files
    assert (record.directory / JOURNAL).read_bytes() == (undisturbed.directory / JOURNAL).read_bytes()
