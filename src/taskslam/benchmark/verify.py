"""A finished run driven again from its record: the same bytes, where that can be promised, or the same result.

Bytes agree where the method is deterministic, has no threads of its own and its latency is not measured (decision 003).
Elsewhere the numbers are compared: two runs of one configuration differ by less than their intervals allow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from taskslam.benchmark.run import run
from taskslam.benchmark.spec import BEHAVIOUR, RunSpec, run_folder
from taskslam.benchmark.stage import stage_of
from taskslam.errors import RecordError
from taskslam.evaluation import run_metrics
from taskslam.evaluation.metrics_file import Interval, RunMetrics
from taskslam.observer import Observer
from taskslam.processes.scratch import Scratch
from taskslam.reading import LARGEST_MANIFEST, LARGEST_TABLE, read_bytes, read_text
from taskslam.record import RunRecord, load_run
from taskslam.record.compression import plain_or_compressed
from taskslam.record.manifest import Manifest
from taskslam.record.run_directory import SPEC
from taskslam.slam.guest.latency import LatencyMode


class Agreement(StrEnum):
    """What driving a run again has shown."""

    SAME_BYTES = "the same bytes"
    SAME_RESULT = "another record with a result within the interval"
    DIFFERENT = "not what it says"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True)
class Verdict:
    """On a run. sentence: what was found; changes: what differs between then and now in versions and machine."""

    directory: Path
    agreement: Agreement
    sentence: str
    changes: tuple[str, ...] = ()


def verify(directory: Path, folders: Sequence[Path] = (), observer: Observer | None = None) -> Verdict:
    """Drive the run at `directory` again, in a folder that is gone afterwards, and compare.

    folders: where worlds and maps of the user's lie.

    Raises:
        RecordError: the run or its spec cannot be read. InputError: it was not driven in the simulator, or its world is
            not at hand or another. InfrastructureError: as `benchmark.run.run`.
    """
    observer = observer or Observer()
    then = load_run(directory, damaged=True)
    spec = spec_of(directory, then.manifest)
    if then.changed:
        return Verdict(directory, Agreement.DIFFERENT, then.changed[0])
    if spec.behaviour != BEHAVIOUR:
        return Verdict(
            directory,
            Agreement.NOT_JUDGED,
            f"behaviour version {spec.behaviour} drove it, and this is {BEHAVIOUR}: the version of taskslam that drove"
            f" it ({then.manifest.versions.get('taskslam', 'not known')}) can verify it",
        )
    stage = stage_of(spec, folders, observer)
    observer.notice(f"driving again: {spec.title}")
    with Scratch("verify") as scratch:
        run(stage, spec, scratch.folder, observer, salt=then.manifest.salt)
        now = load_run(run_folder(scratch.folder, spec))
        return _compared(then, now, spec)


def spec_of(directory: Path, manifest: Manifest) -> RunSpec:
    """The spec that a finished run kept. Raises RecordError, InputError: it cannot be read, or is not run.json's."""
    spec = RunSpec.from_json(read_text(directory / SPEC, "run's spec", RecordError, LARGEST_MANIFEST))
    if spec.digest != manifest.spec_hash and spec.behaviour == BEHAVIOUR:
        raise RecordError(f"{directory}: spec.json is not the spec of run.json, whose spec_hash is another")
    return spec


def _compared(then: RunRecord, now: RunRecord, spec: RunSpec) -> Verdict:
    changes = _changes(then.manifest, now.manifest)
    if then.manifest.files == now.manifest.files:
        count = len(now.manifest.files)
        return Verdict(then.directory, Agreement.SAME_BYTES, f"all {count} files of its record agree", changes)
    where = _first_difference(then, now)
    apart = _apart(run_metrics(then, "then"), run_metrics(now, "now"))
    if _repeats(now.manifest, spec):
        why = f"{where}, though the method is deterministic"
        more = "; its numbers lie within the interval all the same" if apart == "" else f"; {apart}" if apart else ""
        return Verdict(then.directory, Agreement.DIFFERENT, why + more, changes)
    if apart is None:
        few = "too few rounds or arrivals for an interval"
        return Verdict(then.directory, Agreement.NOT_JUDGED, f"{where}, as may be with this method; {few}", changes)
    if apart:
        return Verdict(then.directory, Agreement.DIFFERENT, apart, changes)
    return Verdict(then.directory, Agreement.SAME_RESULT, f"{where}, as may be with this method", changes)


def _repeats(manifest: Manifest, spec: RunSpec) -> bool:
    """Whether the same spec must leave the same bytes."""
    card = manifest.method_card
    return (
        bool(card.get("deterministic", True))
        and not card.get("asynchronous")
        and (spec.latency.mode is not LatencyMode.MEASURED)
    )


def _first_difference(then: RunRecord, now: RunRecord) -> str:
    for name in sorted(then.manifest.files.keys() | now.manifest.files.keys()):
        if then.manifest.files.get(name) == now.manifest.files.get(name):
            continue
        pair = [plain_or_compressed(record.directory / name) for record in (then, now)]
        if not all(path.is_file() for path in pair):
            return f"{name} is there only {'then' if pair[0].is_file() else 'now'}"
        lines = [read_bytes(path, "record", RecordError, LARGEST_TABLE).splitlines() for path in pair]
        number = next((n for n, (a, b) in enumerate(zip(*lines, strict=False)) if a != b), min(map(len, lines)))
        return f"{name} differs from line {number + 1} on"
    return "the lists of files differ"


def _apart(then: RunMetrics, now: RunMetrics) -> str | None:
    """Which number is another by more than chance, in a sentence; empty if none is, None if nothing can be judged."""
    chances = then.uncertainty.completeness
    if not chances.low - 1e-9 <= now.completeness <= chances.high + 1e-9:
        return f"completeness was {then.completeness:.0%} and is {now.completeness:.0%}"
    judged = False
    for words, value, interval in (
        ("E", "precision_m", "precision_here_m"),
        ("e", "accuracy_m", "accuracy_m"),
    ):
        before, after = (getattr(one.position, value) for one in (then, now))
        widths = [_width(getattr(one.uncertainty, interval)) for one in (then, now)]
        if not before or not after or None in widths:
            continue
        judged = True
        if abs(math.log(before / after)) > math.hypot(*(width or 0.0 for width in widths)):
            return f"{words} was {100 * before:.2f} cm and is {100 * after:.2f} cm, more than the intervals allow"
    return "" if judged else None


def _width(interval: Interval | None) -> float | None:
    """Half of an interval's width on a logarithmic scale."""
    if interval is None or interval.low <= 0:
        return None
    return math.log(interval.high / interval.low) / 2


def _changes(then: Manifest, now: Manifest) -> tuple[str, ...]:
    """What differs between the two in versions and machine, each as `numpy 1.26 became 2.0`."""
    facts = [
        {**one.versions, "method": one.method_card.get("version"), "processor": one.machine.get("processor")}
        for one in (then, now)
    ]
    before, after = facts
    return tuple(
        f"{name} {before.get(name, 'absent')} became {after.get(name, 'absent')}"
        for name in sorted(before.keys() | after.keys())
        if before.get(name) != after.get(name)
    )
