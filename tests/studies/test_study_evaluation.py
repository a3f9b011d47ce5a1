import csv
import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.record.trajectories import SpatialTrajectory, write_trajectory
from taskslam.studies.run_comparability import diverged
from taskslam.studies.study import load_study
from taskslam.studies.study_evaluation import evaluate_study
from taskslam.studies.study_results import write_results
from taskslam.studies.study_settings import Settings

RNG = np.random.default_rng(11)
COUNT = 400
STAMPS = 1_403_636_580_000_000_000 + np.arange(COUNT) * 50_000_000
WAY = np.cumsum(np.random.default_rng(5).normal(0.02, 0.05, (COUNT, 3)), axis=0)
TURNS = Rotation.from_rotvec(np.cumsum(np.random.default_rng(6).normal(0, 0.03, (COUNT, 3)), axis=0))


def estimate(noise, bias=0.0, rows=slice(None), seed=0):
    """The way with `noise` m of independent noise and a smooth bias of `bias` m, in a frame of its own."""
    rng = np.random.default_rng(seed)
    wave = bias * np.column_stack([np.sin(np.arange(COUNT) / 9), np.cos(np.arange(COUNT) / 7), np.zeros(COUNT)])
    frame = Rotation.from_rotvec(rng.normal(size=3))
    positions = frame.apply(WAY + wave + rng.normal(0, noise, WAY.shape)) + rng.normal(0, 10, 3)
    turns = frame * TURNS * Rotation.from_rotvec(rng.normal(0, 0.1 * noise, WAY.shape))
    return SpatialTrajectory(STAMPS[rows], positions[rows], turns.as_quat()[rows])


@pytest.fixture
def folder(tmp_path):
    write_trajectory(tmp_path / "groundtruth.tum", SpatialTrajectory(STAMPS, WAY, TURNS.as_quat()))
    return tmp_path


def add(folder, method, *runs):
    for number, run in enumerate(runs):
        write_trajectory(folder / f"{method}_run{number}.tum", run)


def only(results):
    (result,) = results.results
    return result


def test_a_bias_that_all_runs_share_costs_accuracy_and_not_precision(folder):
    add(folder, "biased", *(estimate(0.01, bias=0.2, seed=seed) for seed in range(6)))
    result = only(evaluate_study(load_study(str(folder)), Settings()))
    assert result.common.frames == COUNT
    assert result.common.share == 1.0
    expected = 0.01 * math.sqrt(8 / math.pi) * math.sqrt(5 / 6)  # mean length of a deviation from a mean of six
    assert result.common.precision_m == pytest.approx(expected, rel=0.1)
    assert result.common.precision_unbiased_m == pytest.approx(0.01 * math.sqrt(8 / math.pi), rel=0.1)
    assert result.common.accuracy_m > 0.15
    assert result.common.precise > 0.95
    assert result.position.low > 5


def test_independent_errors_make_precision_as_large_as_accuracy(folder):
    add(folder, "plain", *(estimate(0.05, seed=seed) for seed in range(8)))
    result = only(evaluate_study(load_study(str(folder)), Settings()))
    assert result.position.value == pytest.approx(1.0, abs=0.03)
    assert result.position.low < 1 < result.position.high
    assert [run.ate_m.rmse for run in result.runs] == pytest.approx([0.05 * math.sqrt(3)] * 8, rel=0.1)


def test_runs_in_frames_of_their_own_are_compared_after_alignment_alone(folder):
    add(folder, "plain", *(estimate(0.0, seed=seed) for seed in range(3)))
    aligned = only(evaluate_study(load_study(str(folder)), Settings()))
    assert aligned.common.precision_m < 1e-9
    apart = only(evaluate_study(load_study(str(folder)), Settings(align=Alignment.NONE)))
    assert apart.common.precision_m > 1


def test_the_published_formula_is_reported_beside_the_right_one(folder):
    add(folder, "plain", *(estimate(0.05, seed=seed) for seed in range(5)))
    assert only(evaluate_study(load_study(str(folder)), Settings())).published is None
    result = only(evaluate_study(load_study(str(folder)), Settings(upstream_compat=True)))
    assert result.published.lever_arm_m > result.common.precision_m
    assert result.published.own_frames_m > 1


def test_keyframes_that_hardly_agree_are_compared_where_two_runs_have_them(folder):
    rng = np.random.default_rng(3)
    chosen = [np.sort(rng.choice(COUNT, 60, replace=False)) for _ in range(5)]
    add(folder, "keyframes", *(estimate(0.05, rows=rows, seed=seed) for seed, rows in enumerate(chosen)))
    study = load_study(str(folder))
    result = only(evaluate_study(study, Settings()))
    everywhere = set.intersection(*(set(rows) for rows in chosen))
    counts = np.bincount(np.concatenate(chosen), minlength=COUNT)
    assert result.common.frames == len(everywhere)
    assert result.shared.frames == np.count_nonzero(counts >= 2)
    assert result.shared.runs == pytest.approx(counts[counts >= 2].mean())
    assert result.shared.share == pytest.approx(np.count_nonzero(counts >= 2) / np.count_nonzero(counts))
    assert result.compared_frames is result.shared
    assert result.shared.precision_unbiased_m == pytest.approx(0.05 * math.sqrt(8 / math.pi), rel=0.1)


def test_completeness_is_of_the_frames_that_the_study_names_or_else_of_those_seen(folder):
    add(folder, "half", estimate(0.05, rows=slice(0, 200), seed=1), estimate(0.05, rows=slice(0, 300), seed=2))
    study = load_study(str(folder))
    results = evaluate_study(study, Settings())
    assert [run.completeness for run in only(results).runs] == pytest.approx([2 / 3, 1.0])
    assert list(results.counted.values()) == [False]
    name, sequence = next(iter(study.sequences.items()))
    counted = study.model_copy(update={"sequences": {name: sequence.model_copy(update={"frames": 1000})}})
    assert [run.completeness for run in only(evaluate_study(counted, Settings())).runs] == [0.2, 0.3]
    assert [run.time_covered for run in only(results).runs] == pytest.approx([199 / 399, 299 / 399])


def test_one_run_has_accuracy_and_no_precision(folder):
    add(folder, "single", estimate(0.05))
    results = evaluate_study(load_study(str(folder)), Settings(rpe=("1m", "5s")))
    result = only(results)
    assert result.common.precision_m is None
    assert result.common.accuracy_m > 0
    assert result.position is None
    assert results.verdict.compared == 0
    assert [each.delta for each in result.runs[0].rpe] == ["1 m", "5 s"]
    assert result.runs[0].rpe[0].pairs > 10
    assert result.runs[0].rpe[1].pairs == 3


def test_what_cannot_be_evaluated_is_named_and_the_rest_is_evaluated(folder):
    add(folder, "plain", estimate(0.05, seed=1), estimate(0.05, seed=2))
    (folder / "plain_run2.tum").write_text("")
    (folder / "plain_run3.tum").write_text("0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n")
    (folder / "plain_run4.tum").write_text("rubbish\n")
    straight = SpatialTrajectory(STAMPS, np.arange(COUNT)[:, None] * [1.0, 0, 0], TURNS.as_quat())
    write_trajectory(folder / "plain_run5.tum", straight)
    results = evaluate_study(load_study(str(folder)), Settings())
    assert len(only(results).runs) == 2
    reasons = {left.file.rpartition("/")[2]: left.reason for left in results.left_out}
    assert "holds no pose" in reasons["plain_run2.tum"]
    assert "do not overlap in time" in reasons["plain_run3.tum"]
    assert "line 1: expected eight numbers" in reasons["plain_run4.tum"]
    assert "lie on a line" in reasons["plain_run5.tum"]
    assert all(name in reason for name, reason in reasons.items())


def test_an_rpe_that_no_pair_allows_is_a_note(folder):
    add(folder, "plain", estimate(0.05))
    run = only(evaluate_study(load_study(str(folder)), Settings(rpe=("1e6m",)))).runs[0]
    assert run.rpe == ()
    assert "none of the 400 poses" in run.notes[0]


def test_a_sequence_without_its_ground_truth_does_not_end_the_study(folder, tmp_path):
    add(folder, "plain", estimate(0.05))
    (tmp_path / "study.yaml").write_text(
        "sequences:\n"
        "  good: {groundtruth: groundtruth.tum, runs: {m: plain_run0.tum}}\n"
        "  bad: {groundtruth: nowhere.tum, runs: {m: plain_run0.tum}}\n"
    )
    results = evaluate_study(load_study(str(tmp_path / "study.yaml")), Settings())
    assert [result.sequence for result in results.results] == ["good"]
    assert "nowhere.tum: cannot read the" in results.left_out[0].reason


def test_nothing_at_all_is_an_error(folder):
    (folder / "plain_run0.tum").write_text("")
    with pytest.raises(TrajectoryError, match=r"nothing can be evaluated: .*holds no pose"):
        evaluate_study(load_study(str(folder)), Settings())


def test_the_files_hold_the_results(folder):
    add(folder, "many", *(estimate(0.05, seed=seed) for seed in range(3)))
    add(folder, "single", estimate(0.05, seed=9))
    results = evaluate_study(load_study(str(folder)), Settings(upstream_compat=True, rpe=("1s",)))
    paths = {path.name: path for path in write_results(folder, results)}
    content = json.loads(paths["open_loop.json"].read_text())
    assert content["format"] == "taskslam-open-loop/2"
    many = next(result for result in content["results"] if result["method"] == "many")
    rows = {row["method"]: row for row in csv.DictReader(paths["sequences.csv"].open())}
    assert float(rows["many"]["common_precision_m"]) == many["common"]["precision_m"]
    assert float(rows["many"]["common_precision_D"]) == pytest.approx(many["common"]["precision_m"] / 0.3)
    assert rows["single"]["common_precision_m"] == ""
    assert len(list(csv.DictReader(paths["runs.csv"].open()))) == 4


def test_the_real_runs_of_euroc(data):
    """What the study of docs/trajectories.md says, on the ten runs of two estimators on one sequence."""
    study = load_study(str(data / "euroc" / "MH_03"))
    results = evaluate_study(study, Settings(align=Alignment.YAW))
    by_method = {result.method: result for result in results.results}
    assert {name: len(result.runs) for name, result in by_method.items()} == {"vislam_ba": 10, "vislam_rp": 10}
    frames = by_method["vislam_rp"].compared_frames
    assert frames is by_method["vislam_rp"].common
    assert frames.frames == 2009
    assert frames.precision_m < frames.accuracy_m
    assert by_method["vislam_ba"].compared_frames is by_method["vislam_ba"].shared
    assert by_method["vislam_ba"].common.frames < 10
    assert not results.left_out


def shifted(run, nanoseconds, step=1):
    """The same drive, seen at other times: interpolated by scipy, an independent implementation."""
    stamps = run.stamps[:-1:step] + nanoseconds
    at = (stamps - STAMPS[0]) / 1e9
    own = (run.stamps - STAMPS[0]) / 1e9
    positions = np.column_stack([np.interp(at, own, axis) for axis in run.positions.T])
    turns = Slerp(own, Rotation.from_quat(run.quaternions))(at)
    return SpatialTrajectory(stamps, positions, turns.as_quat())


def test_live_runs_that_share_no_stamps_are_compared_at_common_times(folder):
    runs = [estimate(0.05, seed=seed) for seed in range(5)]
    add(folder, "plain", *runs)
    add(folder, "live", *(shifted(run, 3_000_000 * number) for number, run in enumerate(runs)))
    live, plain = sorted(evaluate_study(load_study(str(folder)), Settings()).results, key=lambda result: result.method)
    assert live.interpolated
    assert not plain.interpolated
    assert live.common.frames == pytest.approx(COUNT, abs=3)
    assert live.common.precision_m == pytest.approx(plain.common.precision_m, rel=0.25)  # between poses noise averages
    assert live.common.precision_m < plain.common.precision_m
    wide = evaluate_study(load_study(str(folder)), Settings(frame_tolerance=0.0125))
    live = next(result for result in wide.results if result.method == "live")
    assert not live.interpolated
    assert live.common.frames == COUNT - 1


def test_frames_in_a_gap_of_a_run_are_not_interpolated(folder):
    runs = [estimate(0.01, seed=seed) for seed in range(3)]
    lost = shifted(runs[2], 7_000_000)
    lost = lost[np.r_[0:100, 160 : len(lost)]]
    add(folder, "live", runs[0], shifted(runs[1], 3_000_000), lost)
    result = only(evaluate_study(load_study(str(folder)), Settings()))
    assert result.interpolated
    assert result.common.frames == pytest.approx(COUNT - 60, abs=3)


def test_one_run_of_ten_that_diverged_is_named_and_precision_given_without_it(folder):
    runs = [estimate(0.02, seed=seed) for seed in range(10)]
    add(folder, "good", *runs[:9])
    add(folder, "once", *runs[:9], SpatialTrajectory(STAMPS, runs[9].positions * 1.5, runs[9].quaternions))
    good, once = sorted(evaluate_study(load_study(str(folder)), Settings()).results, key=lambda result: result.method)
    assert (good.diverged, good.without_diverged) == ((), None)
    assert [file.rpartition("/")[2] for file in once.diverged] == ["once_run9.tum"]
    assert once.without_diverged.precision_m == pytest.approx(good.common.precision_m, rel=1e-9)
    assert once.common.precision_m > 1.5 * once.without_diverged.precision_m


@pytest.mark.parametrize(
    ("rmse", "expected"),
    [([1.0, 1.1, 0.9, 40.0], [3]), ([1.0, 40.0, 40.0], []), ([1.0, 2.0, 3.0, 4.0, 5.0], []), ([0.0] * 5, []), ([], [])],
)
def test_a_run_diverged_only_where_the_others_agree(rmse, expected):
    assert diverged(rmse) == expected


def test_completeness_is_capped_and_gaps_are_measured(folder):
    lost = np.r_[0:100, 300:COUNT]
    add(folder, "whole", estimate(0.01))
    add(folder, "lost", estimate(0.01, rows=lost))
    dense = np.arange(STAMPS[0], STAMPS[-1], 5_000_000)
    positions = np.column_stack([np.interp(dense, STAMPS, axis) for axis in WAY.T])
    add(folder, "dense", SpatialTrajectory(dense, positions, np.tile([0.0, 0, 0, 1], (len(dense), 1))))
    (folder / "study.yaml").write_text(
        "sequences: {s: {groundtruth: groundtruth.tum, frames: 400,"
        " runs: {whole: whole_run0.tum, lost: lost_run0.tum, dense: dense_run0.tum}}}"
    )
    runs = {
        result.method: result.runs[0]
        for result in evaluate_study(load_study(str(folder / "study.yaml")), Settings()).results
    }
    assert (runs["whole"].completeness, runs["whole"].gaps, runs["whole"].time_covered) == (1.0, 0, 1.0)
    assert runs["lost"].completeness == pytest.approx(0.5)
    assert runs["lost"].time_covered == pytest.approx(0.5, abs=0.01)
    assert (runs["lost"].gaps, runs["lost"].longest_gap_s) == (1, pytest.approx(10.05))
    assert runs["dense"].completeness == pytest.approx(1.0, abs=0.01)
    assert runs["dense"].completeness <= 1.0


def smooth(shift_s=0.0):
    """A smooth drive and an estimate of it, a centimetre off, whose clock is late."""
    at = np.arange(COUNT) * 0.05

    def way(t):
        return np.column_stack([3 * np.sin(0.6 * t), 2 * np.cos(0.37 * t), 0.3 * np.sin(1.1 * t)])

    still = np.tile([0.0, 0, 0, 1], (COUNT, 1))
    noise = np.random.default_rng(1).normal(0, 0.01, (COUNT, 3))
    late = STAMPS + round(shift_s * 1e9)
    return SpatialTrajectory(STAMPS, way(at), still), SpatialTrajectory(late, way(at) + noise, still)


def test_a_clock_that_is_off_is_warned_of_and_can_be_set_right(tmp_path):
    truth, late = smooth(0.3)
    write_trajectory(tmp_path / "groundtruth.tum", truth)
    write_trajectory(tmp_path / "late.tum", late)
    study = load_study(str(tmp_path / "groundtruth.tum"), [str(tmp_path / "late.tum")])
    (as_it_stands,) = only(evaluate_study(study, Settings())).runs
    assert as_it_stands.ate_m.rmse > 0.2
    (note,) = as_it_stands.notes
    assert note.startswith("its clock may be off: with --time-offset -0.300 its ATE would be 1.7")
    for offset in (-0.3, "auto"):
        (run,) = only(evaluate_study(study, Settings(time_offset=offset))).runs
        assert run.ate_m.rmse == pytest.approx(0.01 * math.sqrt(3), rel=0.1)
        assert run.time_offset_s == pytest.approx(-0.3, abs=2e-3)
        assert run.associated == COUNT
        assert [("added to its stamps" in note) for note in run.notes] == ([True] if offset == "auto" else [])


def test_a_clock_that_counts_from_the_start_needs_auto(tmp_path):
    truth, run = smooth()
    write_trajectory(tmp_path / "groundtruth.tum", truth)
    write_trajectory(tmp_path / "run.tum", SpatialTrajectory(run.stamps - STAMPS[0], run.positions, run.quaternions))
    study = load_study(str(tmp_path / "groundtruth.tum"), [str(tmp_path / "run.tum")])
    with pytest.raises(TrajectoryError, match="do not overlap in time"):
        evaluate_study(study, Settings())
    (found,) = only(evaluate_study(study, Settings(time_offset="auto"))).runs
    assert found.ate_m.rmse == pytest.approx(0.01 * math.sqrt(3), rel=0.1)


def test_a_straight_drive_says_that_its_turn_is_open(tmp_path):
    at = np.arange(COUNT) * 0.05
    still = np.tile([0.0, 0, 0, 1], (COUNT, 1))
    way = np.column_stack([at, 1e-5 * np.sin(at), 0 * at])
    noise = np.random.default_rng(1).normal(0, 0.001, (COUNT, 3))
    write_trajectory(tmp_path / "gt.tum", SpatialTrajectory(STAMPS, way, still))
    write_trajectory(tmp_path / "est.tum", SpatialTrajectory(STAMPS, way + noise, still))
    study = load_study(str(tmp_path / "gt.tum"), [str(tmp_path / "est.tum")])
    (run,) = only(evaluate_study(study, Settings())).runs
    assert any(note.startswith("it drove along a line (0.00") for note in run.notes)
    (run,) = only(evaluate_study(study, Settings(align=Alignment.YAW))).runs
    assert run.notes == ()
    assert run.rotation_rad.rmse < 0.01


def test_what_is_left_out_of_the_ground_truth_is_said(folder):
    add(folder, "plain", estimate(0.01))
    path = folder / "groundtruth.tum"
    path.write_text(path.read_text().replace("\n", "\nno pose at all\n", 3))
    results = evaluate_study(load_study(str(folder)), Settings())
    assert list(results.groundtruth_notes.values()) == [("3 lines are no poses and left out (first: line 2)",)]


def test_a_typical_run_has_an_interval_of_student_over_logarithms(folder):
    add(folder, "plain", *(estimate(noise, seed=seed) for seed, noise in enumerate((0.01, 0.02, 0.03))))
    add(folder, "two", *(estimate(noise, seed=seed) for seed, noise in enumerate((0.01, 0.02))))
    plain, two = evaluate_study(load_study(str(folder)), Settings(rpe=("1m", "1000m"))).results
    logs = np.log([run.ate_m.rmse for run in plain.runs])
    half = 4.302653 * logs.std(ddof=1) / math.sqrt(3)  # Student's t for 95 % and two degrees of freedom
    expected = np.exp(logs.mean() + np.array([0, -half, half]))
    assert [plain.ate_m.value, plain.ate_m.low, plain.ate_m.high] == pytest.approx(expected)
    assert (two.ate_m.low, two.ate_m.high) == (None, None)
    assert [(each.delta, each.runs) for each in plain.rpe] == [("1 m", 3)]  # nobody went 1000 m
