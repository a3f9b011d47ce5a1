"""The list of quantities: the same numbers as the named fields, everywhere, and from other packages too."""

from __future__ import annotations

import json

import pytest

from guide import snippets
from taskslam.errors import InputError
from taskslam.evaluation import evaluate_runs, write_metrics
from taskslam.evaluation.gate import judge, parse_rules
from taskslam.evaluation.metrics_file import Measured, read_metrics
from taskslam.evaluation.quantities import quantities, quantity
from taskslam.evaluation.quantity import Dimension


@pytest.fixture
def run(scattered, tmp_path):
    scattered("a", 0.02)
    (found,) = evaluate_runs([tmp_path]).runs
    return found


def test_quantities_are_the_numbers_of_the_named_fields(run):
    sure = run.uncertainty
    assert run.quantities["completeness"].value == run.completeness
    assert run.quantities["precision"] == Measured(
        value=run.position.precision_m, low=sure.precision_m.low, high=sure.precision_m.high
    )
    assert run.quantities["accuracy"].value == run.position.accuracy_m
    assert run.quantities["heading_precision"].value == run.orientation.precision_rad
    assert run.quantities["heading_accuracy"].value == run.orientation.accuracy_rad
    assert run.quantities["n_auc"].value == run.n_auc.exact
    assert run.quantities["n_auc_published"].value == run.n_auc.published
    for waypoint in run.waypoints:
        assert waypoint.quantities["precision"] == waypoint.position.precision_m
        assert waypoint.quantities["heading_accuracy"] == waypoint.orientation.accuracy_rad


def test_each_quantity_has_a_key_and_a_symbol_of_its_own():
    ours = quantities()
    assert len({one.key for one in ours}) == len({one.symbol for one in ours}) == len(ours)
    assert all(one.words and not one.words.endswith(".") for one in ours)
    with pytest.raises(InputError, match=r"unknown quantity 'precison'; expected one of .* Did you mean 'precision'"):
        quantity("precison")


def test_metrics_json_holds_every_quantity_and_older_files_can_be_read(scattered, tmp_path):
    scattered("a", 0.02)
    path = write_metrics(tmp_path, evaluate_runs([tmp_path]))
    content = json.loads(path.read_text())
    (held,) = content["runs"]
    assert list(held["quantities"]) == [one.key for one in quantities()]
    assert read_metrics(path).runs[0].quantities["precision"].value == held["position"]["precision_m"]
    del held["quantities"], held["behaviour"]
    for waypoint in held["waypoints"]:
        del waypoint["quantities"]
    path.write_text(json.dumps(content | {"format": "taskslam-metrics/2"}))
    older = read_metrics(path)
    assert older.runs[0].quantities == {}
    report = judge(older.runs, evaluate_runs([tmp_path]).runs, parse_rules("precision:+10%,n_auc:-0.02"))
    assert report.passed


@pytest.mark.parametrize("one", quantities(), ids=lambda one: one.key)
def test_every_quantity_can_be_a_rule_of_the_gate(one, run):
    unit, factor = (one.dimension.value.unit, 1.0) if one.dimension.value.si else ("", 1.0)
    (rule,) = parse_rules(f"{one.key}:{one.worse_is.value}{0.5 * factor:g}{unit}")
    assert str(rule) == f"{one.key}:{one.worse_is.value}0.5{unit}"
    report = judge([run], [run], [rule])
    assert [finding.metric for finding in report.findings] == [one.key]
    assert report.passed
    wrong = "-" if one.worse_is.value == "+" else "+"
    with pytest.raises(InputError, match=f"expected {one.key}:"):
        parse_rules(f"{one.key}:{wrong}10%")


def test_runs_of_two_behaviour_versions_are_neither_pooled_nor_compared(run):
    other = run.model_copy(update={"behaviour": 2, "directory": "b"})
    one = run.model_copy(update={"behaviour": 1})
    from taskslam.evaluation.names import method_labels

    assert method_labels([one, other]) == [
        f"{run.method} (behaviour version 1)",
        f"{run.method} (behaviour version 2)",
    ]
    with pytest.raises(InputError, match="behaviour version 1 of taskslam and NEW under 2, which are never compared"):
        judge([one], [other], parse_rules("completeness:-0"))


@pytest.fixture
def toy(register, tmp_path_factory, monkeypatch):
    """A package from outside with a quantity."""

    def make(**points):
        site = tmp_path_factory.mktemp("site")
        (code,) = snippets("Add a quantity")
        (site / "toy_quantities.py").write_text(f"{code}\nBROKEN = 3\n")
        register(site, "toy-quantities", "1.0", {"taskslam.quantities": points})
        monkeypatch.syspath_prepend(str(site))

    return make


def test_a_quantity_from_outside_is_in_metrics_json_and_in_the_gate(toy, scattered, tmp_path):
    toy(farthest="toy_quantities:FARTHEST")
    scattered("a", 0.02)
    (run,) = evaluate_runs([tmp_path]).runs
    at = [waypoint.quantities["farthest"] for waypoint in run.waypoints]
    assert run.quantities["farthest"].value == pytest.approx(sum(at) / len(at))
    assert 0.01 < run.quantities["farthest"].value < 0.1
    assert quantity("farthest").dimension is Dimension.LENGTH
    (finding,) = judge([run], [run], parse_rules("farthest:+1cm")).findings
    assert (finding.metric, finding.status) == ("farthest", "fine")


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ({"farthest": "toy_quantities:NOTHING"}, "quantity 'farthest' .* cannot be loaded"),
        ({"farthest": "toy_quantities:BROKEN"}, "expected a Quantity whose key bears this name"),
        ({"nearest": "toy_quantities:FARTHEST"}, "expected a Quantity whose key bears this name"),
    ],
)
def test_a_broken_one_is_named(toy, points, words):
    toy(**points)
    with pytest.raises(InputError, match=words):
        quantities()
