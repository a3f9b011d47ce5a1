"""Columns come from the list of quantities, in every table and on the page, for a quantity from outside too."""

from __future__ import annotations

import csv

import pytest

from taskslam.evaluation.quantities import quantities, quantity
from taskslam.report.page.page import write_report
from taskslam.report.results import read_results
from taskslam.report.tables.columns import quantity_columns, quantity_heading, quantity_text
from taskslam.report.tables.table_files import write_tables

TOY = """
from taskslam.evaluation.quantity import Dimension, Quantity, WorseIs, mean_over_complete

VISITS = Quantity(
    key="toy_visits", symbol="V&1", words="visits that a toy has counted", dimension=Dimension.NUMBER, digits=1,
    worse_is=WorseIs.LESS, of_runs=mean_over_complete(lambda waypoint: 7.0 + waypoint.visits),
    of_waypoint=lambda waypoint: 7.0 + waypoint.visits,
)
"""


@pytest.fixture
def toy(register, tmp_path_factory, monkeypatch):
    site = tmp_path_factory.mktemp("site")
    (site / "toy_quantity.py").write_text(TOY)
    register(site, "toy-quantity", "1.0", {"taskslam.quantities": {"toy_visits": "toy_quantity:VISITS"}})
    monkeypatch.syspath_prepend(str(site))


@pytest.fixture
def folder(make_run, tmp_path):
    make_run("a", method="karto", spread=0.002)
    make_run("b", method="hector", spread=0.02, failed=True)
    make_run("c", method="karto", mode="with-map", spread=0.004)
    make_run("d", method="kiss_icp", spread=0.01)
    return tmp_path / "results"


@pytest.mark.parametrize(
    ("key", "value", "shown"),
    [("precision", 0.01234, "1.23"), ("heading_precision", 0.0174533, "1.00"), ("completeness", 0.995, "99"),
     ("n_auc", 0.98765, "0.988"), ("success_2cm_2deg", None, "–")],
)  # fmt: skip
def test_values_are_written_by_their_dimension(key, value, shown):
    assert quantity_text(quantity(key), value) == shown


def test_headings_have_units():
    keys = ("precision", "heading_accuracy", "completeness", "n_auc")
    assert [quantity_heading(quantity(key)) for key in keys] == ["E, cm", "δ, °", "C, %", "N-AUC"]


def test_narrow_places_get_the_essential_ones():
    narrow = [column.quantity.key for column in quantity_columns(essential=True)]
    assert narrow == [one.key for one in quantities() if one.essential]
    assert len(narrow) < len(quantity_columns())


def test_a_quantity_from_outside_is_in_every_table_and_on_the_page(toy, folder, tmp_path):
    results = read_results([folder])
    write_tables(results, tmp_path / "tables")
    with (tmp_path / "tables" / "methods.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    (karto,) = (row for row in rows if (row["method"], row["mode"]) == ("karto", "without-map"))
    assert float(karto["toy_visits"]) == 7.0 + results.runs[0].metrics.waypoints[0].visits
    with (tmp_path / "tables" / "waypoints.csv").open(encoding="utf-8", newline="") as file:
        assert all(float(row["toy_visits"]) >= 7.0 for row in csv.DictReader(file))
    markdown = (tmp_path / "tables" / "methods.md").read_text(encoding="utf-8")
    assert "| V&1 |" in markdown
    assert "V&1: visits that a toy has counted" in markdown
    latex = (tmp_path / "tables" / "methods.tex").read_text(encoding="utf-8")
    assert r" & V\&1 & " in latex
    page = write_report([folder], tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'title="visits that a toy has counted">V&amp;1</th>' in page
    assert "Visits that a toy has counted." in page


def test_the_page_shows_success_over_tolerances(folder, tmp_path):
    page = write_report([folder], tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("position tolerance about the mean, cm") == 2  # a panel for each mode
    assert "Success within tolerance" in page
