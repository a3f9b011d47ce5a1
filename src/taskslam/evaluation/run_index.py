"""The runs under a folder as a table, kept in FOLDER/runs.parquet: a row each, with what it was and what it reached.

The run directories are the results, and the index nothing but a copy of what they say: a row is read anew where
run.json is not the file that it was, and the whole is built again where it is missing, damaged or of another format.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taskslam.errors import DiskFullError, InputError, RecordError
from taskslam.evaluation.metrics_file import LeftOut
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.files import write_whole
from taskslam.printable import printable
from taskslam.reading import LARGEST_METRICS, is_there, read_bytes
from taskslam.record import RunRecord, find_runs, load_run
from taskslam.record.run_directory import MANIFEST
from taskslam.stopping import waits_are_interrupted

if TYPE_CHECKING:
    import polars as pl

INDEX_FILE = "runs.parquet"
_CENTIMETRES, _DEGREES = 100.0, 180.0 / math.pi
COLUMNS = {
    "directory": str, "scenario": str, "robot": str, "method": str, "options": str, "latency": str, "mode": str,
    "seed": int, "rounds": int, "complete": bool, "completeness": float, "precision_cm": float, "accuracy_cm": float,
    "precision_deg": float, "accuracy_deg": float, "n_auc": float, "failure": str, "simulated_s": float,
    "wall_s": float, "method_cpu_s": float, "behaviour": int, "version": str, "processor": str, "started_utc": str,
    "sealed": bool, "spec_hash": str, "stamp_ns": int, "bytes": int,
}  # fmt: skip
"""Of the table. completeness: share of waypoints; precision, accuracy: E and e; stamp_ns, bytes: of run.json, by which
a row is known to be up to date."""


@dataclass(frozen=True)
class RunIndex:
    """table: a row a run, sorted by directory, which is relative to the folder. left_out: runs that cannot be read."""

    table: pl.DataFrame
    left_out: tuple[LeftOut, ...]


def index_runs(folder: Path) -> RunIndex:
    """The finished runs at or below a folder; what has not changed since the last time is not read again.

    Raises:
        InputError: polars is not installed. RecordError: the folder holds no run.
    """
    pl = _polars()
    found = {path.relative_to(folder).as_posix(): path for path in find_runs(folder)}
    if not found:
        raise RecordError(f"{folder}: holds no finished run; expected a folder with run.json in it or below")
    stamps = {name: _stamp(path) for name, path in found.items()}
    known = {row["directory"]: row for row in _kept(folder, pl)}
    rows, left_out = [], []
    for name in sorted(found):
        row = known.get(name)
        if row is None or (row["stamp_ns"], row["bytes"]) != stamps[name]:
            try:
                row = _row(name, load_run(found[name], damaged=True), stamps[name])
            except RecordError as error:
                left_out.append(LeftOut(directory=printable(name), reason=printable(str(error))))
                continue
        rows.append(row)
    table = pl.DataFrame(rows, schema=_schema(pl), orient="row")
    if len(rows) != len(known) or any(row is not known.get(row["directory"]) for row in rows):
        _keep(folder, table)
    return RunIndex(table, tuple(left_out))


def chosen(table: pl.DataFrame, where: str) -> pl.DataFrame:
    """The rows for which a condition holds, written as in SQL: `method = 'karto' and precision_cm > 1`.

    Raises InputError: it is no condition on these columns.
    """
    pl = _polars()
    try:
        return table.filter(pl.sql_expr(where))
    except (pl.exceptions.PolarsError, TypeError, ValueError) as error:
        said = re.split(r"[;\n]", str(error))[0][:200]
        raise InputError(
            f"--where {where}: {said}; expected a condition on the columns {', '.join(COLUMNS)}, as in SQL:"
            " method = 'karto' and seed < 3"
        ) from None


def _row(name: str, record: RunRecord, stamp: tuple[int, int]) -> dict[str, Any]:
    manifest, metrics = record.manifest, run_metrics(record, name)
    headline = metrics.headline
    return {
        "directory": name,
        "scenario": manifest.scenario_name,
        "robot": manifest.robot_name,
        "method": manifest.method,
        "options": json.dumps(manifest.method_options, sort_keys=True) if manifest.method_options else "",
        "latency": manifest.latency,
        "mode": str(manifest.mode),
        "seed": manifest.seed,
        "rounds": manifest.rounds,
        "complete": manifest.complete,
        "completeness": headline.completeness,
        "precision_cm": _times(headline.precision_m, _CENTIMETRES),
        "accuracy_cm": _times(headline.accuracy_m, _CENTIMETRES),
        "precision_deg": _times(headline.precision_rad, _DEGREES),
        "accuracy_deg": _times(headline.accuracy_rad, _DEGREES),
        "n_auc": headline.n_auc,
        "failure": manifest.failure,
        "simulated_s": manifest.simulated_s,
        "wall_s": manifest.wall_s,
        "method_cpu_s": manifest.method_cpu_s,
        "behaviour": manifest.behaviour,
        "version": manifest.versions.get("taskslam"),
        "processor": manifest.machine.get("processor"),
        "started_utc": manifest.started_utc,
        "sealed": manifest.sealed,
        "spec_hash": manifest.spec_hash,
        "stamp_ns": stamp[0],
        "bytes": stamp[1],
    }


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _stamp(directory: Path) -> tuple[int, int]:
    stat = (directory / MANIFEST).stat()
    return stat.st_mtime_ns, stat.st_size


def _kept(folder: Path, pl: Any) -> Sequence[Mapping[str, Any]]:
    """The rows of the index; none where it is missing, damaged or of another format: it is built again."""
    path = folder / INDEX_FILE
    if not is_there(path):
        return []
    try:
        data = read_bytes(path, "index of runs", RecordError, LARGEST_METRICS)
        table = pl.read_parquet(io.BytesIO(data))
    except (RecordError, pl.exceptions.PolarsError):
        return []
    rows: list[dict[str, Any]] = table.to_dicts() if table.schema == pl.Schema(_schema(pl)) else []
    return rows


def _keep(folder: Path, table: pl.DataFrame) -> None:
    """Write the index; a folder of somebody else's results, where nothing can be written, does without."""
    data = io.BytesIO()
    table.write_parquet(data)
    with contextlib.suppress(DiskFullError):
        write_whole(folder / INDEX_FILE, data.getvalue())


def _schema(pl: Any) -> dict[str, Any]:
    kinds = {str: pl.String, int: pl.Int64, bool: pl.Boolean, float: pl.Float64}
    return {name: kinds[kind] for name, kind in COLUMNS.items()}


def _polars() -> Any:
    try:
        import polars as pl
    except ModuleNotFoundError:
        raise InputError(
            "the table of runs needs polars, which is not installed: pip install 'taskslam[runs]'"
        ) from None
    waits_are_interrupted()
    return pl
