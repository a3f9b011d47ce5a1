"""Columns as plain arrays, and as data frames."""

from __future__ import annotations

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.table import Table


@pytest.fixture
def table() -> Table:
    rows = [("karto", 1, 0.5, True, None), ("hector", 2, None, False, None), ("karto", 3, 1.5, True, None)]
    return Table.of_rows(["method", "round", "E", "complete", "note"], rows)


def test_each_column_is_an_array_of_its_kind_and_what_is_unknown_is_nan(table: Table) -> None:
    assert [table[name].dtype.kind for name in table] == ["U", "i", "f", "b", "f"]
    assert len(table) == 3
    np.testing.assert_array_equal(table["E"], [0.5, np.nan, 1.5])
    assert np.isnan(Table.of_rows(["n"], [(1,), (None,)])["n"][1])
    assert Table.of_rows(["text"], [("a",), (None,)])["text"].tolist() == ["a", ""]


def test_rows_are_chosen_by_value(table: Table) -> None:
    assert table.where(method="karto")["round"].tolist() == [1, 3]
    assert len(table.where(method="karto", round=2)) == 0


def test_a_wrong_column_is_told_with_a_guess(table: Table) -> None:
    with pytest.raises(InputError, match=r"no column 'metod'; expected one of method, .* Did you mean 'method'"):
        table["metod"]


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_data_frames_hold_the_same(table: Table, library: str) -> None:
    pytest.importorskip(library)
    frame = getattr(table, f"to_{library}")()
    assert list(frame.columns) == list(table)
    assert frame["round"].to_list() == [1, 2, 3]
    assert frame["method"].to_list() == ["karto", "hector", "karto"]


def test_a_table_without_rows_has_its_columns() -> None:
    empty = Table.of_rows(["a", "b"], [])
    assert len(empty) == 0
    assert list(empty) == ["a", "b"]
