"""`Table`: columns of equal length, as plain arrays; a data frame for those who have pandas or polars."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError, did_you_mean
from taskslam.stopping import waits_are_interrupted


@dataclass(frozen=True)
class Table:
    """columns: (N,) arrays by name: float64 with NaN where a value is not known, int64, bool, or text."""

    columns: Mapping[str, npt.NDArray[Any]]

    @classmethod
    def of_rows(cls, names: Iterable[str], rows: Iterable[Iterable[object]]) -> Table:
        """A table of rows; None becomes NaN among numbers and an empty text among texts."""
        names = list(names)
        lists: list[list[object]] = [[] for _ in names]
        for row in rows:
            for values, value in zip(lists, row, strict=True):
                values.append(value)
        return cls({name: _column(values) for name, values in zip(names, lists, strict=True)})

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if name not in self.columns:
            raise InputError(
                f"no column '{name}'; expected one of {', '.join(self.columns)}.{did_you_mean(name, self.columns)}"
            )
        return self.columns[name]

    def where(self, **values: object) -> Table:
        """The rows in which these columns have these values: `arrivals.where(method="karto", round=0)`."""
        keep = np.ones(len(self), dtype=bool)
        for name, value in values.items():
            keep &= self[name] == value
        return Table({name: column[keep] for name, column in self.columns.items()})

    def to_pandas(self) -> Any:
        """A pandas DataFrame. Raises InputError if pandas is not installed."""
        try:
            import pandas as pd
        except ModuleNotFoundError:
            raise InputError("pandas is not installed: pip install pandas") from None
        return pd.DataFrame(dict(self.columns))

    def to_polars(self) -> Any:
        """A polars DataFrame. Raises InputError if polars is not installed."""
        try:
            import polars as pl
        except ModuleNotFoundError:
            raise InputError("polars is not installed: pip install polars") from None
        waits_are_interrupted()
        return pl.DataFrame(dict(self.columns))


def _column(values: list[object]) -> npt.NDArray[Any]:
    known = [value for value in values if value is not None]
    if known and all(isinstance(value, bool) for value in known) and len(known) == len(values):
        return np.array(values, dtype=np.bool_)
    if known and all(isinstance(value, int) and not isinstance(value, bool) for value in known):
        return np.array(values, dtype=np.int64) if len(known) == len(values) else _floats(values)
    if all(isinstance(value, int | float) for value in known):
        return _floats(values)
    return np.array(["" if value is None else str(value) for value in values], dtype=np.str_)


def _floats(values: list[Any]) -> npt.NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
