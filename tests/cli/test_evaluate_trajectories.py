import json

import numpy as np
import pytest
import typer
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from taskslam.cli.evaluate_trajectories import evaluate_trajectories
from taskslam.errors import FloorPlanError, InputError, TrajectoryError
from taskslam.record.trajectories import SpatialTrajectory, read_spatial_trajectory, write_trajectory


def invoke(*arguments):
    app = typer.Typer()
    app.command()(evaluate_trajectories)
    return CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "80"})


@pytest.fixture
def sequence(tmp_path):
    """A ground truth, three runs of one method with a shared bias, and one run of another (synthetic)."""
    rng = np.random.default_rng(1)
    stamps = 1_403_636_580_000_000_000 + np.arange(300) * 50_000_000
    way = np.cumsum(rng.normal(0.03, 0.05, (300, 3)), axis=0)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.02, (300, 3)), axis=0)).as_quat()
    bias = 0.1 * np.sin(np.arange(300) / 9)[:, None] * [1, 0, 0]
    folder = tmp_path / "MH_09"
    folder.mkdir()
    write_trajectory(folder / "groundtruth.tum", SpatialTrajectory(stamps, way, turns))
    for name in ("vins_run0", "vins_run1", "vins_run2", "alone_run0"):
        noisy = way + bias + rng.normal(0, 0.01, way.shape)
        write_trajectory(folder / f"{name}.tum", SpatialTrajectory(stamps, noisy, turns))
    return folder


def test_a_folder_is_one_command_with_numbers_tables_and_the_figure(sequence, tmp_path):
    result = invoke(sequence.parent, "--align", "yaw", "--rpe", "1m", "--upstream-compat", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    content = json.loads((tmp_path / "out" / "open_loop.json").read_text())
    assert [entry["method"] for entry in content["results"]] == ["alone", "vins"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "open_loop.json", "sequences.csv", "runs.csv", "table.tex", "study.yaml", "report.html",
        "precision_accuracy.pdf", "precision_accuracy.svg", "precision_accuracy.png",
    }  # fmt: skip
    vins = content["results"][1]
    assert f"{100 * vins['common']['precision_m']:.2f}" in result.output
    assert f"{100 * vins['common']['accuracy_m']:.2f}" in result.output
    assert "Aligned by yaw: alone, vins." in result.output
    assert "Precision beats accuracy in position for 1 of 1" in result.output.replace("\n", " ")
    assert all(len(line.rstrip()) <= 80 for line in result.output.splitlines() if "vins" in line and "/" not in line)


def test_runs_are_given_as_files_too_and_one_alone_has_no_figure(sequence, tmp_path):
    out = tmp_path / "out"
    result = invoke(sequence / "groundtruth.tum", sequence / "alone_run0.tum", "--out", out)
    assert result.exit_code == 0, result.output
    assert "Precision needs at least two runs" in result.output
    assert not (out / "precision_accuracy.pdf").exists()


def test_what_was_left_out_is_said(sequence, tmp_path):
    (sequence / "vins_run3.tum").write_text("1,2,3\n")
    result = invoke(sequence, "--out", tmp_path / "out")
    assert result.exit_code == 0
    assert "vins_run3.tum, line 1: expected at least eight numbers" in result.output


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--align", "yaww"), "Did you mean 'yaw'"),
        (("--rpe", "1 furlong"), "expected a number and a unit"),
        (("--rpe", "m"), "expected a number and a unit"),
        (("--plane", "xw"), "options: plane: expected one of xy, xz, yz. Did you mean 'xz'? (got 'xw')"),
        (("--body-sensor", "1,2,3"), "body_sensor: expected x,y,z,roll,pitch,yaw in metres and radians (got '1,2,3')"),
        (("--time-unit", "min"), "time_unit: expected one of s, ms, us, ns"),
        (("--time-offset", "soon"), "time_offset: expected seconds, or auto (got 'soon')"),
        (("--frame-tolerance", "-1"), "frame_tolerance: expected seconds, from 0 to 3600"),
        (("--t-start", "nan"), "t_start: should be a finite number"),
        (("--one-method", "--apart"), "--one-method and --apart contradict each other"),
        (("--max-difference", "-1"), "expected seconds"),
        (("--max-difference", "nan"), "expected seconds"),
    ],
)
def test_wrong_options_are_one_sentence(sequence, options, message):
    result = invoke(sequence, *options)
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)


def test_a_topic_may_be_given_once_for_all_bags(sequence, tmp_path):
    result = invoke(sequence / "groundtruth.tum", tmp_path / "a.bag", "--topic", "/odom")
    assert isinstance(result.exception, TrajectoryError)
    assert "a.bag: no such recording" in str(result.exception)


def test_the_odometry_of_a_real_recording_against_its_localization(data, tmp_path):
    bag = data / "bags" / "nav2_turtlebot.mcap"
    result = invoke(f"{bag}:/odom", f"{bag}:/amcl_pose", "--max-difference", "0.05", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    (entry,) = json.loads((tmp_path / "out" / "open_loop.json").read_text())["results"]
    assert (entry["method"], entry["runs"][0]["poses"]) == ("amcl_pose", 135)
    assert entry["runs"][0]["ate_m"]["rmse"] == pytest.approx(0.496, abs=0.01)  # odometry drifts


def test_relative_errors_over_several_distances_are_a_table(sequence, tmp_path):
    out = tmp_path / "out"
    result = invoke(sequence, "--rpe", "1m", "--rpe", "2s", "--rpe", "20frames", "--out", out)
    assert result.exit_code == 0
    assert "Relative errors" in result.output
    run = json.loads((out / "open_loop.json").read_text())["results"][0]["runs"][0]
    assert [each["delta"] for each in run["rpe"]] == ["1 m", "2 s", "20 frames"]
    assert "rpe_20frames_rmse_m" in (out / "runs.csv").read_text().splitlines()[0]


def test_aligned_trajectories_and_errors_of_poses_are_files(sequence, tmp_path):
    out = tmp_path / "out"
    result = invoke(sequence, "--poses", "--out", out)
    assert result.exit_code == 0
    found = sorted(path.relative_to(out / "poses").as_posix() for path in out.glob("poses/*/*/*"))
    assert found[:2] == ["MH_09/alone/alone_run0.csv", "MH_09/alone/alone_run0.tum"]
    assert len(found) == 8
    rows = np.loadtxt(out / "poses/MH_09/vins/vins_run1.csv", delimiter=",", skiprows=1)
    aligned = read_spatial_trajectory(out / "poses/MH_09/vins/vins_run1.tum")
    truth = read_spatial_trajectory(sequence / "groundtruth.tum")
    assert np.allclose(rows[:, 1], np.linalg.norm(aligned.positions - truth.positions, axis=1), atol=1e-12)
    results = json.loads((out / "open_loop.json").read_text())["results"]
    (vins,) = [result for result in results if result["method"] == "vins"]
    assert np.sqrt(np.mean(rows[:, 1] ** 2)) == pytest.approx(vins["runs"][1]["ate_m"]["rmse"])


def test_strict_is_an_exit_status_for_build_servers(sequence, tmp_path):
    assert invoke(sequence, "--strict", "--out", tmp_path / "out").exit_code == 0
    (sequence / "vins_run3.tum").write_text("nonsense\n")
    assert invoke(sequence, "--out", tmp_path / "out").exit_code == 0
    result = invoke(sequence, "--strict", "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "Something was left out or guessed (--strict)." in result.output


def test_the_study_file_repeats_the_evaluation(sequence, tmp_path):
    out, again = tmp_path / "out", tmp_path / "elsewhere" / "again"
    options = ("--align", "yaw", "--rpe", "1m", "--rpe", "2s", "--downsample", "200", "--body-sensor", "0,0,0.1,0,0,0")
    assert invoke(sequence, *options, "--out", out).exit_code == 0
    assert invoke(out / "study.yaml", "--out", again).exit_code == 0
    first, second = (json.loads((folder / "open_loop.json").read_text()) for folder in (out, again))
    for content in (first, second):
        for run in (run for result in content["results"] for run in result["runs"]):
            assert (out / run["file"]).exists() or (tmp_path / run["file"]).exists()
            run["file"] = run["file"].rpartition("/")[2]
    assert first == second
    assert [each["delta"] for each in first["results"][0]["runs"][0]["rpe"]] == ["1 m", "2 s"]
    assert invoke(again / "study.yaml", "--align", "none", "--out", tmp_path / "none").exit_code == 0  # is overruled
    assert json.loads((tmp_path / "none" / "open_loop.json").read_text())["results"][0]["alignment"] == "none"


def test_a_wrong_setting_in_a_study_file_is_guessed(sequence, tmp_path):
    assert invoke(sequence, "--rpe", "1m", "--out", tmp_path).exit_code == 0
    for wrong, guess in (("rpee: [1m]", "Did you mean 'rpe'?"), ("align: ya", "Did you mean 'yaw'?"),
                         ("rpe: [1 furlong]", "expected a number and a unit")):  # fmt: skip
        text = (tmp_path / "study.yaml").read_text().partition("settings:")[0]
        (tmp_path / "wrong.yaml").write_text(f"{text}settings:\n  {wrong}\n")
        result = invoke(tmp_path / "wrong.yaml", "--out", tmp_path / "out")
        assert isinstance(result.exception, TrajectoryError)
        assert guess in str(result.exception)
        assert "settings" in str(result.exception)


def test_a_map_that_is_none_is_one_sentence(sequence, tmp_path):
    result = invoke(sequence, "--map", tmp_path / "plan.yaml", "--out", tmp_path / "out")
    assert isinstance(result.exception, FloorPlanError)
    assert "plan.yaml" in str(result.exception)
