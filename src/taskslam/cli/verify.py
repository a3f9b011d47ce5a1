"""`taskslam verify`: drive finished runs again from their records, and say whether they are what they say."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say
from taskslam.cli.options import WorldPaths


def verify(
    directory: Annotated[Path, typer.Argument(help="A run directory, or a folder that holds some at any depth.")],
    row: Annotated[list[int] | None, typer.Option(min=0, help="Of `taskslam runs`; may be repeated.")] = None,
    where: Annotated[str, typer.Option(help="Of which this is true, as for `taskslam runs`.")] = "",
    sample: Annotated[int, typer.Option(min=1, help="Of several runs, so many are drawn.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="By which they are drawn.")] = 0,
    world_path: WorldPaths = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Drive a sample of finished runs again, and compare what they leave with what stands there.

    Deterministic methods must leave the same bytes; the results of others must lie within the interval. What has
    changed since in versions or machine is named. Exit status: 0 all agree; 1 one does not; 2 wrong input, or a run
    that cannot be judged.

    Examples:
        taskslam verify results/house/karto/without-map/seed0

        taskslam verify results --sample 3 --where "method = 'karto'"
    """
    from taskslam.benchmark.verify import Agreement
    from taskslam.benchmark.verify import verify as verify_run
    from taskslam.cli.progress import progress

    verdicts = []
    for chosen in _chosen(directory, row or [], where, sample, seed):
        with progress(quiet) as observer:
            verdict = verify_run(chosen, world_path or [], observer)
        say(f"{chosen}: {verdict.agreement}: {verdict.sentence}")
        if verdict.changes:
            say(f"  since then: {'; '.join(verdict.changes)}")
        verdicts.append(verdict.agreement)
    raise typer.Exit(1 if Agreement.DIFFERENT in verdicts else 2 if Agreement.NOT_JUDGED in verdicts else 0)


def _chosen(directory: Path, rows: list[int], where: str, sample: int, seed: int) -> list[Path]:
    """The run directories that are to be verified. Raises InputError."""
    import random

    from taskslam.errors import InputError
    from taskslam.record.run_directory import MANIFEST

    if (directory / MANIFEST).exists():
        return [directory]
    from taskslam.evaluation.run_index import chosen, index_runs

    table = index_runs(directory).table.with_row_index("row")
    if wrong := [row for row in rows if row >= len(table)]:
        raise InputError(f"--row {wrong[0]}: {directory} has rows 0 to {len(table) - 1}")
    if rows:
        return [directory / table["directory"][row] for row in rows]
    names = list((chosen(table, where) if where else table)["directory"])
    if not names:
        raise InputError(f"--where {where}: of the {len(table)} runs in {directory} it is true of none")
    drawn = random.Random(seed).sample(names, min(sample, len(names)))  # noqa: S311 a sample is no secret
    return [directory / name for name in sorted(drawn)]
