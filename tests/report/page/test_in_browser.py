"""The page of a suite in a real browser, as `browser.py` opens it."""

import re
import shutil
import subprocess

import pytest

from browser import DESKTOP, PHONE, act, chromium, needs_chromium
from taskslam.report import write_report

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def page(tmp_path_factory, write_synthetic_run):
    """Three methods in both modes, one that fails."""
    folder = tmp_path_factory.mktemp("browser")
    for method, spread in (("karto", 0.005), ("hector", 0.02), ("</script><b>odd", 0.05)):
        for mode in ("without-map", "with-map"):
            name = f"{method.strip('</>')[-4:].replace('>', '')}-{mode}"
            write_synthetic_run(
                folder / "results" / name, method=method, mode=mode, spread=spread, failed=method == "hector"
            )
    return write_report([folder / "results"], folder / "report.html")


def test_the_page_opens_under_its_own_policy_without_a_word_in_the_console(page):
    dom, console = chromium(page.as_uri(), "--dump-dom")
    assert console == []
    assert '<html lang="en" class="js">' in dom  # its script ran to the first line that leaves a trace
    assert 'tabindex="-1"' in dom  # and to the last
    assert "none</button>" in dom


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_nothing_is_wider_than_the_window(page, size):
    wide, window = act(page, size, "return [document.documentElement.scrollWidth, innerWidth];")
    assert window == size[0]
    assert wide <= window


def test_a_box_hides_a_method_in_figures_and_tables_together(page):
    before, after, count = act(
        page,
        DESKTOP,
        """const seenOf = () => [...new Set(seen('[data-method="m1"]').map((at) => at.tagName.toLowerCase()))].sort();
        const before = seenOf();
        document.getElementById("show-m1").click();
        return [before, seenOf(), document.querySelector(".how-many").textContent];""",
    )
    assert {"tr", "g", "details", "div"} <= set(before)
    assert after == []
    assert count == "2 of 3"


def test_the_switch_says_every_number_in_task_units(page):
    metric, task = act(
        page,
        DESKTOP,
        """const cells = () => text(".matrix td a").slice(0, 3);
        const metric = cells();
        document.getElementById("unit-tu").click();
        return [metric, cells()];""",
    )
    for centimetres, diameters in zip(map(float, metric), map(float, task), strict=True):
        assert diameters == pytest.approx(centimetres / 30, abs=6e-4)


def test_pointing_at_a_cell_shows_its_rounds_and_leaving_hides_them(page):
    card, hidden = act(
        page,
        DESKTOP,
        """const cell = document.querySelector(".matrix td a");
        cell.dispatchEvent(new PointerEvent("pointerenter", {pointerType: "mouse"}));
        const card = [...document.querySelectorAll("#card tbody tr")].map((row) => row.cells.length);
        cell.dispatchEvent(new PointerEvent("pointerleave", {pointerType: "mouse"}));
        return [card, document.getElementById("card").hidden];""",
    )
    assert card == [5, 5, 5]
    assert hidden


def test_the_card_of_a_waypoint_shows_what_the_filter_shows_and_escape_closes_it(page):
    all_methods, fewer, hidden = act(
        page,
        PHONE,
        """const rows = () => text("#card tbody td:first-child");
        document.querySelector("a.goal").dispatchEvent(new MouseEvent("click", {bubbles: true, cancelable: true}));
        const first = rows();
        document.getElementById("show-m2").click();
        const second = rows();
        document.dispatchEvent(new KeyboardEvent("keydown", {key: "Escape"}));
        return [first, second, document.getElementById("card").hidden];""",
    )
    assert sorted(all_methods) == ["</script><b>odd", "hector", "karto"]
    assert len(fewer) == 2
    assert hidden


def test_arrow_keys_walk_through_the_matrix_and_show_the_rounds(page):
    focused = act(
        page,
        DESKTOP,
        """const stops = document.querySelectorAll(".matrix td a[tabindex='0']").length;
        document.querySelector(".matrix td a").focus();
        const press = (key) => document.activeElement.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true}));
        press("ArrowRight"); press("ArrowDown");
        return [stops, document.activeElement.dataset.goal, document.querySelectorAll(".matrix tr").length > 2];""",
    )
    assert focused == [1, "1", True]


def test_a_heading_sorts_its_column_up_and_down(page):
    up, down, state = act(
        page,
        DESKTOP,
        """const table = document.querySelector("#methods table");
        const column = [...table.tHead.rows[0].cells].findIndex((head) => head.textContent.startsWith("E"));
        const rows = () => [...table.tBodies[0].rows].slice(1);
        const values = () => rows().map((row) => parseFloat(row.cells[column].textContent));
        const head = table.tHead.rows[0].cells[column];
        head.querySelector("button").click();
        const up = values();
        head.querySelector("button").click();
        return [up, values(), head.getAttribute("aria-sort")];""",
    )
    assert up == sorted(up)
    assert len(set(up)) == 3
    assert down == up[::-1]
    assert state == "descending"


def test_the_filters_and_all_content_are_there_without_a_script(page):
    """The page's own script is taken out; the watching one clicks a box as a reader's browser would."""
    silent = page.with_name("silent.html")
    silent.write_text(re.sub(r"<script>\s*\"use strict\".*?</script>", "", page.read_text(), flags=re.DOTALL))
    before, after, stories = act(
        silent,
        DESKTOP,
        """const rows = () => seen('[data-mode="with-map"]').length;
        const before = rows();
        document.getElementById("show-with-map").click();
        return [before, rows(), document.querySelectorAll("details.story .timeline li").length];""",
    )
    assert before > 10
    assert after == 0
    assert stories >= 4


def test_printing_opens_what_is_folded_and_loses_nothing(page, tmp_path):
    pdftotext = shutil.which("pdftotext")
    if pdftotext is None:
        pytest.skip("needs pdftotext: apt install poppler-utils")
    target = tmp_path / "page.pdf"
    chromium(page.as_uri(), f"--print-to-pdf={target}", "--no-pdf-header-footer")
    text = subprocess.run([pdftotext, "-layout", target, "-"], capture_output=True, text=True, check=True).stdout
    for wanted in ("Who is more repeatable", "sets out from waypoint", "Every waypoint in numbers", "How to read this"):
        assert wanted in text
    assert text.count("Arrivals at each waypoint") == 6


@pytest.mark.parametrize(
    ("preferred", "ground", "ink"),
    [(0, "rgb(20, 24, 31)", "rgb(230, 233, 238)"), (1, "rgb(255, 255, 255)", "rgb(28, 36, 48)")],
)
def test_the_page_is_as_dark_as_the_reader_prefers(page, preferred, ground, ink):
    script = """
      const style = (selector) => getComputedStyle(document.querySelector(selector));
      return [style("body").backgroundColor, style("body").color, style('.icon [fill="var(--paper)"]').fill];
    """
    seen = act(page, DESKTOP, script, f"--blink-settings=preferredColorScheme={preferred}")
    assert seen == [ground, ink, ground]
