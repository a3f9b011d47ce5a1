"""Several seeds of a method on the page: one row and one curve, and below them each run with its seed."""

import pytest

from browser import DESKTOP, PHONE, act, needs_chromium
from taskslam.report import write_report
from taskslam.report.results import read_results
from taskslam.report.tables.latex import methods_latex
from taskslam.report.tables.markdown import methods_markdown
from taskslam.report.tables.table_files import methods_csv


@pytest.fixture
def seeds(make_run, tmp_path):
    """karto with three seeds in two places, hector with two seeds in one of them."""
    for place in ("house", "hall"):
        for seed in range(3):
            make_run(f"{place}/karto{seed}", scenario=place, title=place, seed=seed, spread=0.01 * (1 + seed))
    for seed in range(2):
        make_run(f"house/hector{seed}", method="hector", scenario="house", title="house", seed=seed, failed=seed == 1)
    return tmp_path / "results"


def test_the_tables_have_a_row_a_method_and_say_how_many_seeds(seeds):
    results = read_results([seeds])
    assert [(result.label, result.pooled.seeds) for result in results.in_mode("without-map")] == [
        ("karto", (0, 1, 2)),
        ("hector", (0, 1)),
    ]
    assert results.pooled[0].pooled.uncertainty.seeds == 3
    assert "karto & 3 seeds & " in methods_latex(results)
    assert "over seeds, rounds and waypoints" in methods_latex(results)
    assert methods_markdown(results).count("3 seeds") == 2  # a table for each place
    assert "2 seeds" in methods_markdown(results)
    head, first = (line.split(",") for line in methods_csv(results).splitlines()[:2])
    assert dict(zip(head, first, strict=True))["seeds"] == "3"


@needs_chromium
@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_row_leads_to_the_run_of_each_seed(seeds, tmp_path, size):
    page = write_report([seeds], tmp_path / "report.html")
    found = act(
        page,
        size,
        """
        const rows = seen(".scenario table.results tbody tr").map((row) => row.cells[0]);
        return {
          rows: rows.map((cell) => cell.innerText.replace(/\\s+/g, " ").trim()),
          links: rows.flatMap((cell) => [...cell.querySelectorAll("a")]).map((a) => !!document.querySelector(a.hash)),
          runs: text("details.run > summary small"),
          matrix: text("table.matrix tbody th small"),
          wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        };
        """,
    )
    assert sorted(row.split(", ")[0] for row in found["rows"]) == ["hector", "karto", "karto"]
    assert any("3 seeds: 0, 1, 2" in row for row in found["rows"])
    assert found["links"] == [True] * 8
    assert sorted(found["runs"]) == ["seed 0"] * 3 + ["seed 1"] * 3 + ["seed 2"] * 2
    assert set(found["matrix"]) == {"seed 0", "seed 1", "seed 2"}
    assert found["wide"] == 0
