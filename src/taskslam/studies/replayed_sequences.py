"""What lies in a folder of replays, as `taskslam replay` leaves it: per dataset the truth and everybody's rounds."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from taskslam.mode import Mode
from taskslam.record import find_runs, load_run
from taskslam.record.run_directory import round_folder


@dataclass
class ReplayedSequence:
    """groundtruth: a truth.tum; runs: by method (and mode) the estimate.tum of every round that counts."""

    groundtruth: str
    runs: dict[str, tuple[str, ...]] = field(default_factory=dict)


def replayed_sequences(folder: Path) -> dict[str, ReplayedSequence]:
    """By the dataset's name; empty if the folder holds no replay of a dataset with ground truth.

    The priming round of a replay with map is left out. Raises RecordError if a run directory cannot be read.
    """
    sequences: dict[str, ReplayedSequence] = {}
    for directory in find_runs(folder):
        record = load_run(directory)
        manifest = record.manifest
        truth = round_folder(directory, 0) / "truth.tum"
        if manifest.source != "replay" or not truth.is_file():
            continue
        counted = [round_folder(directory, start.round) for start in record.rounds() if not start.priming]
        estimates = tuple(str(place / "estimate.tum") for place in counted if (place / "estimate.tum").is_file())
        if estimates:
            label = manifest.method if manifest.mode is Mode.WITHOUT_MAP else f"{manifest.method} with map"
            sequence = sequences.setdefault(manifest.scenario_name, ReplayedSequence(str(truth)))
            sequence.runs[label] = estimates
    return sequences
