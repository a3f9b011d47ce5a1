import shutil
from pathlib import Path

import pytest

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.studies.run_names import Grouping, method_names
from taskslam.studies.study import load_study
from taskslam.studies.study_evaluation import evaluate_study
from taskslam.studies.study_settings import Settings


def touch(folder, *names):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("0 0 0 0 0 0 0 1\n")


def runs(study, sequence):
    return {
        method: [file.rpartition("/")[2] for file in files] for method, files in study.sequences[sequence].runs.items()
    }


def test_a_folder_of_sequences_names_methods_by_what_stands_before_the_number(tmp_path):
    touch(
        tmp_path, "MH_01/groundtruth.tum", *(f"MH_01/vins_mono_run{n}.tum" for n in (0, 2, 10)), "MH_01/orb_slam3.txt"
    )
    touch(tmp_path, "MH_02/groundtruth.csv", "MH_02/msckf/a.tum", "MH_02/msckf/b.tum", "MH_02/notes.md")
    touch(tmp_path, "MH_03/groundtruth.tum", "other/run0.tum")
    study = load_study(str(tmp_path))
    assert list(study.sequences) == ["MH_01", "MH_02"]
    assert runs(study, "MH_01") == {
        "orb_slam3": ["orb_slam3.txt"],
        "vins_mono": ["vins_mono_run0.tum", "vins_mono_run10.tum", "vins_mono_run2.tum"],
    }
    assert runs(study, "MH_02") == {"msckf": ["a.tum", "b.tum"]}


def test_a_folder_may_be_one_sequence(tmp_path):
    touch(tmp_path, "groundtruth.tum", "karto_1.tum", "karto_2.tum")
    assert runs(load_study(str(tmp_path)), tmp_path.name) == {"karto": ["karto_1.tum", "karto_2.tum"]}


def test_files_are_grouped_in_the_same_way(tmp_path):
    touch(tmp_path, "MH_04/gt.tum", "a/run0.tum", "a/run1.tum", "b/round00/estimate.tum", "b/round01/estimate.tum")
    files = [str(tmp_path / name) for name in ("a/run0.tum", "a/run1.tum", "b")]
    study = load_study(str(tmp_path / "MH_04/gt.tum"), files)
    assert runs(study, "MH_04") == {"a": ["run0.tum", "run1.tum"], "b": ["estimate.tum", "estimate.tum"]}
    files[2:] = [str(tmp_path / f"b/round0{n}/estimate.tum") for n in (0, 1)]
    assert load_study(str(tmp_path / "MH_04/gt.tum"), files).sequences == study.sequences


def names(*stems, grouping=Grouping.BY_NAME, folder="f"):
    return method_names([Path(folder) / f"{stem}.txt" for stem in stems], grouping)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("before", ["stamped_traj_estimate", "vins-", "karto_", "okvis2_v", "a.b."])
def test_a_number_at_the_end_is_a_runs_where_siblings_count_from_0_or_1(before, first):
    found = names(*(f"{before}{first + number}" for number in range(4)))
    assert found == [before.rstrip("_.-")] * 4


def test_a_bare_number_without_siblings_or_counting_from_2_belongs_to_the_name():
    assert names("orb_slam2", "orb_slam3") == ["orb_slam2", "orb_slam3"]
    assert names("okvis2") == ["okvis2"]
    assert names("kitti0", "kitti55") == ["kitti0", "kitti55"]
    assert names("orb_slam3_run7", "orb_slam2_run7", "orb_slam3-trial2") == ["orb_slam3", "orb_slam2", "orb_slam3"]


def test_a_registered_method_is_no_run(monkeypatch):
    monkeypatch.setattr("taskslam.studies.run_names.registered", lambda group: {"slam1": group, "slam2": group})
    assert names("slam1", "slam2") == ["slam1", "slam2"]
    assert names("slam10", "slam11") == ["slam10", "slam11"]


def test_the_user_overrules_what_names_say():
    assert names("orb_slam2", "orb_slam3", grouping=Grouping.ONE_METHOD) == ["orb_slam"] * 2
    assert names("live_a", "live_b", grouping=Grouping.ONE_METHOD) == ["live"] * 2
    assert names("x", "y", grouping=Grouping.ONE_METHOD) == ["method"] * 2
    assert names("est_run0", "est_run1", grouping=Grouping.APART) == ["est_run0", "est_run1"]
    apart = method_names([Path("a/est.tum"), Path("b/est.tum")], Grouping.APART)
    assert apart == ["a/est", "b/est"]


def test_a_folder_of_rpg_trajectory_evaluation_is_a_sequence(tmp_path):
    files = [f"stamped_traj_estimate{n}.txt" for n in range(3)]
    touch(tmp_path, "stamped_groundtruth.txt", *files)
    assert runs(load_study(str(tmp_path)), tmp_path.name) == {"stamped_traj_estimate": files}
    touch(tmp_path, "other_gt.txt")
    with pytest.raises(TrajectoryError, match="no sequence"):  # which of the two is not for us to say
        load_study(str(tmp_path))


def test_topics_of_the_bag_that_holds_the_ground_truth_are_methods():
    study = load_study("drive.bag:/gt", ["drive.bag:/odom", "drive.bag:/slam", "other.bag:/slam"])
    assert study.sequences["drive"].runs == {
        "odom": ("drive.bag:/odom",),
        "slam": ("drive.bag:/slam",),
        "other": ("other.bag:/slam",),
    }


def test_a_yaml_file_says_what_a_folder_cannot(tmp_path):
    touch(tmp_path, "MH_01/gt.tum", "MH_01/vins_2.tum", "MH_01/vins_10.tum")
    (tmp_path / "study.yaml").write_text(
        """
        sequences:
          first:
            groundtruth: MH_01/gt.tum
            frames: 3682
            runs:
              vins: MH_01/vins_*.tum
              lost: [MH_01/nowhere.tum]
        methods: {vins: {align: yaw}}
        units: {robot_diameter: 0.4}
        """
    )
    study = load_study(str(tmp_path / "study.yaml"))
    assert runs(study, "first") == {"vins": ["vins_2.tum", "vins_10.tum"], "lost": ["nowhere.tum"]}
    assert study.sequences["first"].frames == 3682
    assert study.alignment("vins", Alignment.SE3) is Alignment.YAW
    assert study.alignment("lost", Alignment.SE3) is Alignment.SE3
    assert (study.units.robot_diameter, study.units.field_of_view) == (0.4, 70.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "empty; expected the keys sequences"),
        ("sequences: {}", "at least 1 item"),
        ("sequences: {a: {groundtruth: x.tum, runs: {m: 5}}}", r"sequences\.a\.runs\.m"),
        ("sequences: {a: {groundtruth: x.tum, runs: {m: '*.nope'}}}", r"a, m: no file matches \*\.nope"),
        ("sequences: {a: {groundtruth: x.tum, runs: {m: '/**x'}}}", "a, m"),
        ("sequences: {a: {groundtruth: x.tum, run: {}}}", r"unknown key 'sequences\.a\.run'.*Did you mean 'runs'"),
        ("sequences: {}\nmethods: {m: {align: diagonal}}", "at least 1 item"),
        ("sequences: {a: {groundtruth: x, runs: {}}}\nmethods: {m: {align: up}}", r"methods\.m\.align: .*'up'"),
        ("a: [", "not valid YAML"),
        ("&a [*a]", "refers to what holds it"),
        ("[" * 3000, "not valid YAML"),
        ("\x00", "not valid YAML"),
    ],
)
def test_a_wrong_yaml_file_is_one_sentence(tmp_path, content, message):
    (tmp_path / "study.yaml").write_text(content)
    with pytest.raises(TrajectoryError, match=rf"study\.yaml: .*({message})") as caught:
        load_study(str(tmp_path / "study.yaml"))
    assert "\n" not in str(caught.value)


def test_nothing_to_compare_is_said(tmp_path):
    touch(tmp_path, "groundtruth.tum")
    for source, message in ((tmp_path, "no sequence"), (tmp_path / "groundtruth.tum", "one argument alone is a study")):
        with pytest.raises(TrajectoryError, match=message):
            load_study(str(source))
    shutil.rmtree(tmp_path)
    with pytest.raises(TrajectoryError, match="one argument alone is a study"):
        load_study(str(tmp_path))
    with pytest.raises(TrajectoryError, match="cannot read the study"):
        load_study(str(tmp_path / "study.yaml"))


def test_a_name_that_is_too_long_for_a_file_is_a_sentence(tmp_path):
    touch(tmp_path, "groundtruth.tum")
    runs = f"{{a: {'x' * 5000}}}"
    (tmp_path / "study.yaml").write_text(f"sequences:\n  one: {{groundtruth: groundtruth.tum, runs: {runs}}}\n")
    with pytest.raises(TrajectoryError, match=r"nothing can be evaluated: .*File name too long"):
        evaluate_study(load_study(str(tmp_path / "study.yaml")), Settings())
    with pytest.raises(TrajectoryError, match="one argument alone is a study"):
        load_study("x" * 5000)
