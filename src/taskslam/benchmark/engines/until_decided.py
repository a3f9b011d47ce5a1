"""An engine that drives a comparison seed by seed, and stops once the data carry it (`evaluation/sequential.py`)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from taskslam.benchmark.engine import DRIVEN, Ending, Engine, Result, Watcher
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.errors import InputError, RecordError
from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.evaluation.sequential import Decision, decide, log_precisions
from taskslam.mode import Mode
from taskslam.record.run_directory import load_run


class UntilDecided:
    """Drives seed after seed with another engine, and in each mode no more of them once one method is the best.

    told: hears what was decided, in a sentence. References are driven and not compared. Results come in the order in
    which runs are driven; those that are not needed any more come last.
    """

    def __init__(self, engine: Engine, told: Callable[[str], None]) -> None:
        self._engine, self._told = engine, told

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Iterator[Result]:
        """As any engine's. Raises InputError: fewer than two methods are to be compared."""
        check_comparable(specs)
        found: dict[Mode, dict[str, list[RunMetrics]]] = defaultdict(lambda: defaultdict(list))
        open_modes = {spec.mode for spec in specs}
        driven: set[RunSpec] = set()
        for seed in sorted({spec.seed for spec in specs}):
            batch = [spec for spec in specs if spec.seed == seed and spec.mode in open_modes]
            for result in self._engine.run(batch, out, watcher):
                if result.spec is not None and result.ending in DRIVEN:
                    self._take(result.spec, out, found)
                yield result
            driven.update(batch)
            for mode in sorted(open_modes):
                if (decision := _decision(found[mode])) is not None and decision.decided:
                    open_modes.remove(mode)
                    self._told(f"{mode}, after seed {seed}: {decision.words}")
        for spec in specs:
            if spec not in driven:
                yield Result(spec.title, Ending.NOT_NEEDED, "its comparison was decided before", spec)

    def _take(self, spec: RunSpec, out: Path, found: dict[Mode, dict[str, list[RunMetrics]]]) -> None:
        folder = run_folder(out, spec)
        try:
            record = load_run(folder)
            if not record.manifest.is_reference:
                found[spec.mode][spec.way].append(run_metrics(record, str(folder)))
        except RecordError as error:
            self._told(f"{spec.title} is not in the comparison: {error}")


def check_comparable(specs: Sequence[RunSpec]) -> None:
    """Raise InputError where there is nothing to compare."""
    ways = {spec.way for spec in specs}
    if len(ways) < 2:
        raise InputError(
            f"--until-decided compares methods; this campaign has {len(ways)}: expected two or more, or ways of one"
        )


def _decision(runs: dict[str, list[RunMetrics]]) -> Decision | None:
    return decide(log_precisions(runs)) if len(runs) > 1 else None
