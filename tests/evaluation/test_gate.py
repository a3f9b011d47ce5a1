import itertools
import re
import xml.etree.ElementTree as ET

import pytest

from taskslam.errors import InputError
from taskslam.evaluation.gate import GateReport, judge, parse_rules
from taskslam.evaluation.gate_files import headline, junit, markdown
from taskslam.evaluation.metrics_file import LeftOut

RULES = parse_rules("precision:+10%,completeness:-0")


def statuses(report):
    return {finding.metric: finding.status for finding in report.findings}


@pytest.fixture
def pair(scattered):
    """Runs of one method before and after: directories differ, all else is the same."""

    count = itertools.count()

    def make(before, after):
        old, new = (scattered(f"run{next(count)}", **options) for options in (before, after))
        return [run.model_copy(update={"method": "karto"}) for run in (old, new)]

    return make


def test_the_same_results_pass(pair):
    old, _ = pair({"spread": 0.02}, {"spread": 0.02})
    report = judge([old], [old], RULES)
    assert report.passed
    assert statuses(report) == {"precision": "fine", "completeness": "fine"}
    assert headline(report) == "no regression"


def test_a_difference_within_the_interval_is_no_regression(pair):
    old, new = pair({"spread": 0.02}, {"spread": 0.024, "seed": 1})
    assert new.position.precision_m > 1.1 * old.position.precision_m
    report = judge([old], [new], RULES)
    assert statuses(report)["precision"] == "within noise"
    assert report.passed


def test_a_clear_loss_is_a_regression_and_a_clear_gain_is_named(pair):
    old, new = pair({"spread": 0.02}, {"spread": 0.1, "seed": 1})
    report = judge([old], [new], RULES)
    assert not report.passed
    assert statuses(report) == {"precision": "regression", "completeness": "fine"}
    assert "base is more repeatable than new" in report.regressions[0].reason
    assert statuses(judge([new], [old], RULES))["precision"] == "better"


def test_a_clear_loss_within_the_tolerance_passes(pair):
    old, new = pair({"spread": 0.02}, {"spread": 0.1, "seed": 1})
    assert judge([old], [new], parse_rules("precision:+900%")).passed
    assert judge([old], [new], parse_rules("precision:+50cm")).passed
    assert not judge([old], [new], parse_rules("precision:+1cm")).passed


def test_a_waypoint_that_is_no_longer_reached_is_never_noise(pair):
    old, new = pair({"spread": 0.02}, {"spread": 0.02, "fails_at": 5})
    report = judge([old], [new], RULES)
    assert statuses(report)["completeness"] == "regression"
    assert "5/6 waypoints reached in all 5 rounds, before 6/6" in report.regressions[0].reason
    assert "1 of 30 legs failed, before 0 of 30" in report.regressions[0].reason
    assert judge([old], [new], parse_rules("completeness:-20%")).passed
    assert judge([old], [new], parse_rules("n_auc:-0.001")).regressions
    assert judge([new], [old], RULES).passed


def test_n_auc_without_a_failure_follows_the_noise(pair):
    old, new = pair({"spread": 0.02}, {"spread": 0.024, "seed": 1})
    assert statuses(judge([old], [new], parse_rules("n_auc:-0"))) == {"n_auc": "within noise"}
    old, new = pair({"spread": 0.02}, {"spread": 0.2, "seed": 1})
    assert statuses(judge([old], [new], parse_rules("n_auc:-0"))) == {"n_auc": "regression"}


def test_nothing_reached_any_more_is_a_regression_of_precision_too(pair):
    old, new = pair({"spread": 0.02}, {"spread": 0.02, "fails_at": 0})
    assert statuses(judge([old], [new], RULES)) == {"precision": "regression", "completeness": "regression"}


def test_runs_of_one_round_cannot_be_judged_and_say_so(pair):
    old, new = pair({"spread": 0.02, "rounds": 1}, {"spread": 0.5, "rounds": 1})
    assert statuses(judge([old], [new], RULES))["precision"] == "undetermined"


def test_missing_runs_are_regressions_by_name_and_new_ones_are_not_judged(scattered):
    karto, hector = scattered("karto", 0.02), scattered("hector", 0.02)
    report = judge([karto, hector], [karto], RULES)
    assert not report.passed
    assert [(missing.method, missing.reason) for missing in report.missing] == [("hector", "no such run")]
    assert headline(report) == "1 missing run"
    report = judge([karto], [karto, hector], RULES)
    assert report.passed
    assert report.added == ("synthetic / hector / without-map / seed 0",)


def test_a_run_that_could_not_be_read_says_why_it_is_missing(scattered):
    karto = scattered("karto", 0.02)
    (missing,) = judge([karto], [], RULES, [LeftOut(directory="karto", reason="half-written")]).missing
    assert missing.reason == "half-written"


def test_a_small_loss_everywhere_shows_in_all_runs_together(scattered):
    def runs(name, spread, seed):
        found = [scattered(f"{name}{n}", spread, goals=4, seed=seed + n, seed_name=n) for n in range(8)]
        return [run.model_copy(update={"method": "karto"}) for run in found]

    base, new = runs("a", 0.02, 0), runs("b", 0.027, 50)
    report = judge(base, new, parse_rules("precision:+10%"))
    assert [finding.scenario for finding in report.regressions] == ["all 8 runs"]


def test_a_run_twice_other_goals_or_another_planner_are_refused(scattered):
    run = scattered("karto", 0.02)
    with pytest.raises(InputError, match="NEW holds synthetic / karto / without-map / seed 0 twice, in karto and in"):
        judge([run], [run, run], RULES)
    other = run.model_copy(update={"waypoints": run.waypoints[:-1]})
    with pytest.raises(InputError, match="driven to different goals"):
        judge([run], [other], RULES)
    teb, dwa = (run.model_copy(update={"planner": name}) for name in ("teb", "dwa"))
    with pytest.raises(InputError, match="BASE was steered by planner teb and NEW by dwa"):
        judge([teb], [dwa], RULES)


@pytest.mark.parametrize(
    "wrong", ["precision", "precision:-10%", "precision:+10", "completeness:+1%", "completeness:-1cm", "precision:+x%"]
)
def test_a_rule_that_makes_no_sense_says_what_was_expected(wrong):
    with pytest.raises(InputError, match=r"--fail-on .*: expected (precision:\+10%|completeness:-10%)"):
        parse_rules(wrong)


def test_unknown_metrics_second_rules_and_none_at_all_are_refused():
    with pytest.raises(InputError, match="Did you mean 'precision'"):
        parse_rules("precison:+10%")
    with pytest.raises(InputError, match="a second rule for precision"):
        parse_rules("precision:+10%,precision:+20%")
    with pytest.raises(InputError, match="no rule"):
        parse_rules(",")
    assert [str(rule) for rule in parse_rules("accuracy:+1cm,n_auc:-0.02,precision:+10%")] == [
        "accuracy:+1cm",
        "n_auc:-0.02",
        "precision:+10%",
    ]


def test_files_say_what_the_report_says(pair, scattered):
    old, new = pair({"spread": 0.02}, {"spread": 0.1, "seed": 1})
    gone = scattered("gone", 0.02, scenario_name="a|<b>")
    report = judge([old, gone], [new], RULES)
    text = markdown(report)
    assert text.startswith("## TaskSLAM-Bench: 1 regression, 1 missing run\n")
    assert "| **regression** | synthetic / karto / without-map / seed 0 | precision |" in text
    assert "a\\|&lt;b>" in text
    root = ET.fromstring(junit(report))
    assert [case.get("name") for case in root.iter("testcase")] == ["precision", "completeness", "run"]
    assert [failure.get("type") for failure in root.iter("failure")] == ["regression", "missing"]
    assert sum(int(suite.get("failures")) for suite in root) == 2
    assert GateReport.model_validate_json(report.model_dump_json()) == report


def test_names_that_act_on_a_terminal_leave_the_files_readable(pair, scattered):
    evil = "\x1b[31mred\x1b]0;owned\x07\x00\x0b\u202e[bold]\ufffe"
    old, new = pair({"spread": 0.02}, {"spread": 0.1, "seed": 1})
    report = judge([old, scattered("gone", 0.02, scenario_name=evil)], [new], RULES)
    text = junit(report)
    assert any("red[bold]" in str(suite.get("name")) for suite in ET.fromstring(text))
    assert not re.search("[\x00-\x08\x0b-\x1f\u202e\ufffe]", text + markdown(report))
