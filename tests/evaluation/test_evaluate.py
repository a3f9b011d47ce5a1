import json

import pytest

from taskslam.errors import DiskFullError, RecordError
from taskslam.evaluation import evaluate_runs, write_metrics
from taskslam.evaluation.evaluate import by_method
from taskslam.evaluation.metrics_file import read_metrics
from taskslam.evaluation.upstream import ALL
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome


def two_rounds(builder):
    return builder.round(0, {0: SE2(0.1, 0, 0)}).round(1, {0: SE2(-0.1, 0, 0)})


def test_every_run_below_a_folder_is_evaluated_in_order(build, tmp_path):
    for name in ("b/with", "a/without", "c"):
        two_rounds(build(name, goals=1, rounds=2)).write()
    metrics = evaluate_runs([tmp_path / "results"])
    assert [run.directory for run in metrics.runs] == ["a/without", "b/with", "c"]
    assert metrics.left_out == ()


def test_a_run_directory_itself_can_be_named(build):
    directory = two_rounds(build(goals=1, rounds=2)).write()
    assert [run.directory for run in evaluate_runs([directory]).runs] == ["."]


def test_runs_that_cannot_be_read_are_named_and_left_out(build, tmp_path):
    two_rounds(build("good", goals=1, rounds=2)).write()
    damaged = two_rounds(build("damaged", goals=1, rounds=2)).write()
    (damaged / "journal.jsonl").write_text("nonsense\n")
    partial = two_rounds(build("stopped", goals=1, rounds=2)).write()
    (partial / "run.json").unlink()
    metrics = evaluate_runs([tmp_path / "results"])
    assert [run.directory for run in metrics.runs] == ["good"]
    reasons = {left.directory: left.reason for left in metrics.left_out}
    assert "journal.jsonl, line 1" in reasons["damaged"]
    assert "half-written" in reasons["stopped"]


def test_a_folder_without_runs_is_refused(tmp_path):
    with pytest.raises(RecordError, match="holds no run"):
        evaluate_runs([tmp_path])
    with pytest.raises(RecordError, match="no such folder"):
        evaluate_runs([tmp_path / "absent"])


def test_the_file_has_the_documented_keys_and_null_for_what_is_not_defined(build, tmp_path):
    build(goals=2, rounds=2).round(0, {}, failed=(0, Outcome.LOST)).write()
    path = write_metrics(tmp_path, evaluate_runs([tmp_path / "results"]))
    assert path == tmp_path / "metrics.json"
    text = path.read_text()
    assert "NaN" not in text
    content = json.loads(text)
    assert content["format"] == "taskslam-metrics/4"
    assert content["definitions"] == "paper"
    (run,) = content["runs"]
    assert {"scenario", "method", "mode", "seed", "completeness", "waypoints", "failures", "simulated_s"} <= run.keys()
    assert {"wall_s", "dropped_frames"} <= run.keys()
    assert run["position"] == {"precision_m": None, "accuracy_m": None}
    assert run["orientation"] == {"precision_rad": None, "accuracy_rad": None}
    assert run["n_auc"]["published"] == 0.0
    assert run["n_auc"]["exact"] == 0.0
    assert run["failures"][0]["outcome"] == "lost"


def test_runs_of_two_planners_are_never_pooled(build, tmp_path):
    two_rounds(build(goals=1, rounds=2)).write()
    (run,) = evaluate_runs([tmp_path / "results"]).runs
    teb, measured, other = (run.model_copy(update={"planner": name}) for name in ("teb", None, "dwa"))
    assert list(by_method([teb, measured.model_copy(update={"seed": 1})])) == ["karto"]
    assert list(by_method([teb, other])) == ["karto (teb planner)", "karto (dwa planner)"]


def test_a_tour_that_was_driven_twice_in_the_same_way_is_not_pooled_but_named_by_its_folder(build, tmp_path):
    for name in ("first", "second"):
        two_rounds(build(name, goals=1, rounds=2)).write()
    runs = evaluate_runs([tmp_path / "results"]).runs
    assert list(by_method(runs)) == ["karto (first)", "karto (second)"]


def test_the_file_says_in_which_way_a_method_was_run(build, tmp_path):
    two_rounds(build(goals=1, rounds=2)).write(method_options={"resolution": 0.1}, latency="zero")
    path = write_metrics(tmp_path, evaluate_runs([tmp_path / "results"]))
    (run,) = read_metrics(path).runs
    assert (run.method_options, run.latency, run.planner, run.robot) == ({"resolution": 0.1}, "zero", "teb", None)


def test_the_file_says_which_definitions_it_holds(build, tmp_path):
    two_rounds(build(goals=1, rounds=2)).write()
    assert evaluate_runs([tmp_path / "results"], deviations=ALL).definitions == "upstream"


def test_the_same_runs_give_the_same_bytes(build, tmp_path):
    two_rounds(build(goals=1, rounds=2)).write()
    texts = [write_metrics(tmp_path, evaluate_runs([tmp_path / "results"])).read_bytes() for _ in range(2)]
    assert texts[0] == texts[1]


def test_a_folder_that_cannot_be_written_is_named(build, tmp_path, full_disk):
    two_rounds(build(goals=1, rounds=2)).write()
    metrics = evaluate_runs([tmp_path / "results"])
    with full_disk(), pytest.raises(DiskFullError, match=r"metrics\.json: cannot be written"):
        write_metrics(tmp_path, metrics)


def test_a_file_that_has_changed_since_the_run_was_finished_is_named(build, tmp_path):
    """A flipped digit in a pose is a number as good as any: only the digest tells."""
    directory = two_rounds(build(goals=1, rounds=2)).write()
    (intact,) = evaluate_runs([directory]).runs
    journal = directory / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().replace(b'"frames":', b'"frames":1', 1))
    (changed,) = evaluate_runs([directory]).runs
    assert intact.files_changed == changed.journal_damaged == ()
    assert [str(journal) in sentence for sentence in changed.files_changed] == [True]
    journal.unlink()
    (left,) = evaluate_runs([directory]).left_out
    assert "journal" in left.reason


def test_neither_a_damaged_line_nor_a_cut_off_last_one_takes_the_run_out(build, tmp_path):
    for name in ("middle", "end"):
        journal = two_rounds(build(name, goals=1, rounds=2)).write() / "journal.jsonl"
        lines = journal.read_bytes().splitlines(keepends=True)
        lines[3 if name == "middle" else -1] = b'{"event":"arr' + (b"\n" if name == "middle" else b"")
        journal.write_bytes(b"".join(lines))
    metrics = evaluate_runs([tmp_path / "results"])
    assert [(run.directory, run.journal_truncated) for run in metrics.runs] == [("end", True), ("middle", False)]
    assert [len(run.journal_damaged) for run in metrics.runs] == [0, 1]
    assert "journal.jsonl, line 4" in metrics.runs[1].journal_damaged[0]
    assert not metrics.left_out


def test_one_run_alone_is_evaluated_and_compared_with_nothing(build, tmp_path):
    two_rounds(build(goals=1, rounds=2)).write()
    metrics = evaluate_runs([tmp_path / "results"])
    assert len(metrics.runs) == 1
    assert metrics.comparisons == ()


def test_methods_are_compared_and_runs_with_other_options_kept_apart(build, tmp_path):
    for name, method in (("a", "karto"), ("b", "hector"), ("c", "karto")):
        two_rounds(build(name, goals=1, rounds=2)).write(method=method)
    found = evaluate_runs([tmp_path / "results"]).comparisons
    assert {(c.a, c.b) for c in found if c.metric == "precision"} == {
        ("karto (a)", "hector"),
        ("karto (a)", "karto (c)"),
        ("hector", "karto (c)"),
    }


def test_the_file_comes_back_as_it_was(build, tmp_path):
    two_rounds(build(goals=2, rounds=2)).write()
    metrics = evaluate_runs([tmp_path / "results"])
    assert read_metrics(write_metrics(tmp_path, metrics)) == metrics


def test_a_reference_competes_with_nobody(build, tmp_path):
    for name, kind in (("karto", "slam"), ("hector", "slam"), ("ground_truth", "reference")):
        builder = build(name, goals=2, rounds=3)
        for number in range(3):
            builder.round(number, {0: SE2(0.1 * number, 0, 0), 1: SE2(0, 0.1 * number, 0)})
        builder.write(method=name, method_card={"name": name, "kind": kind})
    pairs = [{pair.a, pair.b} for pair in evaluate_runs([tmp_path / "results"]).comparisons]
    assert pairs == [{"hector", "karto"}] * 2  # precision and accuracy
