"""What lies in a folder of replays, as `taskslam replay` leaves it: per dataset the truth and everybody's rounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from taskslam.evaluation.names import options_in_words
from taskslam.mode import Mode
from taskslam.record import find_runs, load_run
from taskslam.record.manifest import Manifest
from taskslam.record.run_directory import round_folder


@dataclass
class ReplayedSequence:
    """groundtruth: a truth.tum; runs: by method, its way and mode, the estimate.tum of every round that counts."""

    groundtruth: str
    runs: dict[str, tuple[str, ...]] = field(default_factory=dict)


def replayed_sequences(folder: Path) -> dict[str, ReplayedSequence]:
    """By the dataset's name; empty if the folder holds no replay of a dataset with ground truth.

    The priming round of a replay with map is left out. Raises RecordError if a run directory cannot be read.
    """
    records = [record for record in map(load_run, find_runs(folder)) if record.manifest.source == "replay"]
    sequences: dict[str, ReplayedSequence] = {}
    for record in records:
        manifest = record.manifest
        truth = round_folder(record.directory, 0) / "truth.tum"
        if not truth.is_file():
            continue
        counted = [round_folder(record.directory, start.round) for start in record.rounds() if not start.priming]
        estimates = tuple(str(place / "estimate.tum") for place in counted if (place / "estimate.tum").is_file())
        if estimates:
            name = _name(manifest, [record.manifest for record in records])
            label = name if manifest.mode is Mode.WITHOUT_MAP else f"{name} with map"
            sequence = sequences.setdefault(manifest.scenario_name, ReplayedSequence(str(truth)))
            sequence.runs[label] = estimates
    return sequences


def _name(manifest: Manifest, among: Sequence[Manifest]) -> str:
    """The method, with the options or the latency that tell it from others of the same method."""
    same = [other for other in among if other.method == manifest.method]
    ways = zip(*map(_ways, same), strict=True)
    parts = [own for own, way in zip(_ways(manifest), ways, strict=True) if len(set(way)) > 1]
    return f"{manifest.method} ({', '.join(parts)})" if parts else manifest.method


def _ways(manifest: Manifest) -> tuple[str, ...]:
    return options_in_words(manifest.method_options), f"{manifest.latency} latency"
