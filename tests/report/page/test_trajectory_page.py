import re

import pytest

from browser import DESKTOP, PHONE, act, chromium, needs_chromium
from recorded import write_study
from taskslam.report.trajectories import evaluate_into
from taskslam.studies.study import load_study


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    study = load_study(str(write_study(folder)))
    results, _ = evaluate_into(folder / "out", study, study.settings)
    return results, folder / "out" / "report.html"


@pytest.fixture(scope="module")
def page(evaluated):
    return evaluated[1]


def of(results, sequence, method):
    (result,) = [one for one in results.results if (one.sequence, one.method) == (sequence, method)]
    return result


def test_the_page_says_the_numbers_of_the_results(evaluated):
    results, page = evaluated
    text = page.read_text(encoding="utf-8")
    vins = of(results, "MH_08", "vins")
    row = re.search(r'<section id="errors">.*?vins</td>(.*?)</tr>', text, re.DOTALL)[1]
    shown = re.findall(r'<span class="si">([^<]*)</span>', row)
    assert shown[:3] == [f"{100 * value:.1f}" if value > 0.1 else f"{100 * value:.2f}"
                         for value in (vins.ate_m.value, vins.ate_m.low, vins.ate_m.high)]  # fmt: skip
    assert len(re.findall("<th[^>]*>RPE ", text)) == 3
    assert text.count("<h4>RPE over ") == 6


def test_a_diverged_run_is_named_and_precision_is_said_both_ways(evaluated):
    results, page = evaluated
    text = page.read_text(encoding="utf-8")
    vins = of(results, "MH_08", "vins")
    both = [f"{100 * frames.precision_m:.3g}" for frames in (vins.compared_frames, vins.without_diverged)]
    assert f"E is {both[0]} cm with and {both[1]} cm without" in text
    assert re.search(r'vins_run3.tum <span class="kind">diverged', text)


def test_what_was_left_out_is_said_and_names_are_text(page):
    text = page.read_text(encoding="utf-8")
    assert "2 files left out" in text
    assert text.count("orb_run9.tum, line 1: expected") == 2
    assert "<b>odd" not in text
    assert "&lt;b&gt;odd" in text


def test_lines_end_at_gaps_and_the_strip_shows_them(page):
    text = page.read_text(encoding="utf-8")
    assert len(re.findall(r'aria-label="When [^"]*orb_run\d.tum had poses: 2 stretches"', text)) == 8
    assert len(re.findall(r'aria-label="When [^"]*vins_run\d.tum had poses: 1 stretches"', text)) == 10


def test_a_map_is_drawn_below_where_there_is_one(page):
    text = page.read_text(encoding="utf-8")
    assert text.count("Runs over one another on the map, in x and y") == 1
    assert text.count('href="#plan-') == 1


def test_the_page_needs_nothing_from_outside(page):
    text = page.read_text(encoding="utf-8")
    assert re.findall(r'(?:src|href)="(?!#|data:)([^"]*)"', text) == []
    assert len(text) < 2_000_000


@needs_chromium
def test_the_page_opens_under_its_own_policy_without_a_word_in_the_console(page):
    dom, console = chromium(page.as_uri(), "--dump-dom")
    assert console == []
    assert '<html lang="en" class="js">' in dom
    assert "none</button>" in dom  # the script ran past the filter


@needs_chromium
@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_nothing_is_wider_than_the_window_and_no_label_hides_another(page, size):
    wide, window, hidden = act(
        page,
        size,
        """const boxes = (root) => [...root.querySelectorAll("text")].map((at) => at.getBoundingClientRect());
        const ticks = [...document.querySelectorAll(".box-axis")].map((axis) => [...axis.querySelectorAll("div span")]
          .map((at) => at.getBoundingClientRect()));
        const hit = (a, b) => a.left < b.right - 1 && b.left < a.right - 1
          && a.top < b.bottom - 1 && b.top < a.bottom - 1;
        let hidden = 0;
        for (const all of [...[...document.querySelectorAll("svg.drawing")].map(boxes), ...ticks])
          all.forEach((a, i) => all.slice(i + 1).forEach((b) => { hidden += hit(a, b); }));
        return [document.documentElement.scrollWidth, innerWidth, hidden];""",
    )
    assert window == size[0]
    assert wide <= window
    assert hidden == 0


@needs_chromium
def test_a_box_hides_a_method_everywhere_and_everything_that_acts_is_reached_by_keyboard(page):
    before, after, missed, buttons = act(
        page,
        DESKTOP,
        """const seenOf = () => [...new Set(seen('[data-method="m1"]').map((at) => at.tagName.toLowerCase()))].sort();
        const before = seenOf();
        document.querySelector(".pick").open = true;
        const acting = seen("a[href], button, input, summary");
        const missed = acting.filter((at) => { at.focus(); return document.activeElement !== at; });
        document.getElementById("show-m1").click();
        return [before, seenOf(), missed.map((at) => at.outerHTML.slice(0, 90)), seen("th button").length];""",
    )
    assert {"tr", "g", "div", "li"} <= set(before)
    assert after == []
    assert missed == []
    assert buttons > 20


@needs_chromium
@pytest.mark.parametrize(("preferred", "ground"), [(0, "rgb(20, 24, 31)"), (1, "rgb(255, 255, 255)")])
def test_the_page_is_as_dark_as_the_reader_prefers(page, preferred, ground):
    script = "return getComputedStyle(document.body).backgroundColor;"
    assert act(page, DESKTOP, script, f"--blink-settings=preferredColorScheme={preferred}") == ground
