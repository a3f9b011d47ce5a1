"""The page of a watched campaign: what it answers, and a person with it in a real browser at both widths."""

from __future__ import annotations

import html
import json
from typing import Any

import pytest

from browser import DESKTOP, PHONE, WATCH, needs_chromium, served, told_when_served, without_policy
from taskslam.benchmark.campaign.watching import Watched
from taskslam.errors import RecordError
from taskslam.report.page.watch_page import WatchPage
from watched import write_watched


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> WatchPage:
    out = tmp_path_factory.mktemp("watched") / "<b>out"
    write_watched(out)
    return WatchPage(Watched(out))


def test_the_list_of_runs_is_said_once_and_then_a_letter_for_each(page: WatchPage) -> None:
    first = page.look(b"{}")
    assert [run[:2] for run in first["runs"]] == [["house", "karto"], ["house", "hector"]] * 2
    assert first["states"] == "munw"
    assert first["chosen"] == 1
    assert first["counts"] == "4 runs: 1 finished, 1 under way, 1 could not be driven, 1 waiting"
    assert first["run"]["where"] == "round 2 of 2 · goal 2 of 12 · 17 min 50 s simulated"
    assert first["run"]["reached"] == [0]
    again = page.look(json.dumps({"known": first["known"], "run": 0}).encode())
    assert "runs" not in again
    assert (again["chosen"], again["run"]["where"]) == (0, "round 0, goal 11: no_plan: no way")
    assert [told["what"] for told in again["run"]["happened"] if told["kind"] == "failure"] == [
        "goal 12: no path to the goal. no way"
    ]


def test_a_choice_of_another_list_is_not_taken(page: WatchPage) -> None:
    assert page.look(json.dumps({"known": "of old", "run": 3}).encode())["chosen"] == 1


@pytest.mark.parametrize("said", [b"", b"[]", b'{"run": -1}', b'{"run": 99}', b'{"file": "/etc/passwd"}', b"{}"])
def test_what_is_no_question_is_refused_in_a_sentence(page: WatchPage, said: bytes) -> None:
    with pytest.raises(RecordError, match="the question: "):
        page.plan(said)


def test_a_name_cannot_act_on_the_page(page: WatchPage) -> None:
    assert "<b>out" not in page.page()


ACTING = """<script>
const seen = (selector) => [...document.querySelectorAll(selector)].filter((at) => at.getClientRects().length > 0);
const settled = async (done) => {
  for (let i = 0; i < 400 && !done(); i++) await new Promise((go) => setTimeout(go, 25));
};
(async () => { %s })().then((told) => parent.postMessage(JSON.stringify({noted, told}), "*"));
</script></body>"""
FRAME = """<!doctype html><pre id="told"></pre>
<script>onmessage = (event) => { document.getElementById("told").textContent = event.data; };</script>
<iframe srcdoc="%s" style="width: %dpx; height: %dpx; border: 0"></iframe>"""


def asked(page: WatchPage, size: tuple[int, int], script: str) -> Any:
    """What a script tells that runs in the page as it is served, in a frame of some size; no error was noted."""
    text = without_policy(page.page()).replace("<head>", f"<head>{WATCH}", 1).replace("</body>", ACTING % script)
    frame = FRAME % (html.escape(text), *size)
    report = told_when_served(lambda: frame, page.acts)
    assert report["noted"] == []
    return report["told"]


@needs_chromium
@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_person_sees_the_robot_and_chooses_another_run(page: WatchPage, size: tuple[int, int]) -> None:
    under_way, finished, boxes, back, wide = asked(
        page,
        size,
        """const title = () => document.getElementById("run-title").textContent;
        const count = (...selectors) => selectors.map((selector) => seen(selector).length);
        const told = () => [title(), ...count(
          ".seen circle.truth", ".seen circle.belief", ".goal.reached", ".goal.failed", ".goal.next")];
        await settled(() => document.querySelector(".seen circle.truth"));
        const underWay = [...told(), seen(".seen circle.hit").length > 100];
        const boxes = [...document.querySelectorAll("button.cell")];
        boxes.find((box) => box.title.includes("a goal missed")).click();
        await settled(() => title().includes("karto") && document.querySelectorAll(".goal.reached").length === 12);
        const finished = [...told(), document.getElementById("run-where").textContent];
        document.getElementById("follow").click();
        await settled(() => title().includes("hector"));
        return [underWay, finished, boxes.map((box) => box.textContent), title(),
          document.documentElement.scrollWidth <= innerWidth];""",
    )
    assert under_way == ["house · hector", 1, 1, 1, 0, 1, True]
    assert finished == ["house · karto", 1, 0, 12, 0, 0, "round 0, goal 11: no_plan: no way"]  # as of its last round
    assert sorted(boxes) == ["", "", "!", "✗"]
    assert back == "house · hector"
    assert wide


@needs_chromium
def test_the_page_opens_under_its_own_policy(page: WatchPage) -> None:
    dom, console = served(page.page, page.acts)
    assert console == []
    assert "data-looks=" in dom
    assert dom.count("&lt;b&gt;out") >= 2
