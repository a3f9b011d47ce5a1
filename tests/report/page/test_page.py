import base64
import hashlib
import html
import json
import re
from html.parser import HTMLParser

import pytest

from taskslam.errors import DiskFullError, RecordError
from taskslam.report import write_report

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Checker(HTMLParser):
    """Counts tags and notes where an end tag does not match."""

    def __init__(self):
        super().__init__()
        self.open, self.faults, self.tags, self.ids, self.classes = [], [], [], [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.ids += [value for name, value in attributes if name == "id"]
        self.classes += [word for name, value in attributes if name == "class" for word in value.split()]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.faults.append((tag, self.getpos()))


def parse(path):
    checker = Checker()
    checker.feed(path.read_text(encoding="utf-8"))
    return checker


@pytest.fixture
def page(make_run, tmp_path):
    make_run("karto/with", mode="with-map")
    make_run("karto/without")
    make_run("odometry", method="wheel_odometry", failed=True)
    return write_report([tmp_path / "results"], tmp_path / "out" / "report.html")


def test_the_page_is_well_formed(page):
    checker = parse(page)
    assert checker.faults == []
    assert checker.open == []
    assert len(checker.ids) == len(set(checker.ids))


def test_the_page_needs_nothing_from_outside(page):
    text = page.read_text()
    references = re.findall(r'(?:src|href|url)\s*[=(]\s*["\']?([^"\')\s>]+)', text)
    assert references
    assert [ref for ref in references if not ref.startswith(("#", "data:image/png;base64,"))] == []
    assert "@import" not in text
    assert " src=" not in text


def test_the_policy_lets_the_page_run_its_own_script_and_nothing_else(page):
    """A browser refuses any script or style sheet whose text has another hash (CSP level 2)."""
    text = page.read_text()
    policy = html.unescape(re.search(r'http-equiv="Content-Security-Policy" content="([^"]+)"', text).group(1))
    for tag, source in (("script", "script-src"), ("style", "style-src-elem")):
        own = re.search(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL).group(1)
        assert f"{source} 'sha256-{base64.b64encode(hashlib.sha256(own.encode()).digest()).decode()}';" in policy
    assert policy.startswith("default-src 'none';")
    assert "unsafe-eval" not in policy


def test_the_verdict_stands_before_the_pictures(page):
    text = page.read_text()
    assert text.index("Every waypoint was reached in all 3 rounds") < text.index("<svg")
    assert "2 of 3 waypoints were reached in all 3 rounds" in text


def test_every_run_has_a_map_a_panel_for_each_waypoint_and_its_bars(page):
    checker = parse(page)
    ids = [name for name in checker.ids if re.fullmatch(r"run-\d-w\d", name)]
    assert len(ids) == 3 * 3
    assert checker.classes.count("map") == 1 + 3  # the scenario's, and one for each run
    assert page.read_text().count('aria-label="Control and estimation error"') == 3 * (3 + 1)


def test_a_floor_plan_stands_on_the_page_once_and_every_map_refers_to_it(page):
    text = page.read_text()
    (key,) = re.findall(r'<image id="(plan-\w+)"', text)
    maps = 1 + 3 + 3 + 1  # the scenario's, one and a stage for each run, one for the failure
    assert text.count(f'<use href="#{key}"') == maps


def test_failures_are_shown_with_where_and_why_and_escaped(page):
    text = page.read_text()
    assert "&lt;b&gt;no plan&lt;/b&gt; &amp; so" in text
    assert "<b>no plan</b>" not in text
    assert "no path to the goal" in text
    assert "(5.97, 4.00) m" in text


def test_priming_rounds_are_named_and_the_others_counted_from_one(page):
    text = page.read_text()
    assert "priming round" in text
    assert "round 3" in text
    assert "round 4" not in text


def test_the_same_runs_give_the_same_bytes(page, tmp_path):
    again = write_report([tmp_path / "results"], tmp_path / "again.html")
    assert again.read_bytes() == page.read_bytes()


def test_a_title_from_a_scenario_cannot_inject(make_run, tmp_path):
    make_run(title="<script>alert(1)</script>")
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)" in text
    assert text.count("<script") == 3  # the data, the tour's, and the page's own


def test_text_that_looks_like_the_end_of_a_script_stays_inside_the_data(make_run, tmp_path):
    make_run(method="</script><script>alert(1)</script><!--")
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL).group(1)
    (run,) = json.loads(data)["runs"].values()
    assert run["name"] == "</script><script>alert(1)</script><!--, without map"
    assert "<" not in data


@pytest.mark.parametrize("options", [{"rounds": 1}, {"truth": False}, {"plan": False}, {"rounds": 1, "failed": True}])
def test_a_run_that_lacks_something_is_still_reported(make_run, tmp_path, options):
    make_run(**options)
    checker = parse(write_report([tmp_path / "results"], tmp_path / "r.html"))
    assert checker.faults == []


def test_nothing_undefined_or_not_finite_reaches_the_page(make_run, tmp_path):
    make_run(truth=False)
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert not re.search(r"\b(nan|inf|None)\b", re.sub(r"base64,[^\"]+", "", text))


def test_runs_that_cannot_be_read_are_named(make_run, tmp_path):
    make_run("good")
    (make_run("bad") / "journal.jsonl").write_text("nonsense\n")
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert "Left out" in text
    assert "journal.jsonl, line 1" in text


def test_a_journal_that_was_cut_off_is_said(make_run, tmp_path):
    journal = make_run() / "journal.jsonl"
    journal.write_bytes(journal.read_bytes()[:-20])
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert "the last line was cut off" in text[text.index('<section id="left-out">') :]


def test_a_damaged_line_of_a_journal_is_said(make_run, tmp_path):
    journal = make_run() / "journal.jsonl"
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join([*lines[:4], "{nonsense\n", *lines[5:]]))
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert text[text.index('<section id="left-out">') :].count("journal.jsonl, line 5") == 1


def test_if_no_run_can_be_read_there_is_no_page_but_the_reason(make_run, tmp_path):
    (make_run() / "journal.jsonl").write_text("nonsense\n")
    with pytest.raises(RecordError, match=r"no finished run to report on: .*journal\.jsonl, line 1"):
        write_report([tmp_path / "results"], tmp_path / "r.html")
    assert not (tmp_path / "r.html").exists()


def test_a_run_that_was_left_half_written_is_no_page(make_run, tmp_path):
    directory = make_run()
    (directory / "run.json").unlink()
    with pytest.raises(RecordError, match="half-written"):
        write_report([tmp_path / "results"], tmp_path / "r.html")


def test_a_waypoint_that_no_camera_judged_has_no_count_of_visits(make_run, tmp_path):
    make_run(unjudged={1: "no camera watched"})
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert text.count("<td>not judged</td>") == 1
    assert text.count("<td>3/3</td>") == 2  # the others


def test_a_folder_without_runs_is_refused(tmp_path):
    with pytest.raises(RecordError, match="holds no run"):
        write_report([tmp_path], tmp_path / "r.html")
    assert not (tmp_path / "r.html").exists()


def test_a_full_disk_is_named_and_leaves_no_half_page(make_run, tmp_path, full_disk):
    make_run()
    with full_disk(), pytest.raises(DiskFullError, match=r"r\.html: cannot be written"):
        write_report([tmp_path / "results"], tmp_path / "r.html")
    assert not (tmp_path / "r.html").exists()
