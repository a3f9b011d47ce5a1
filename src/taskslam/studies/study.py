"""What an open-loop study compares: sequences with their ground truth, methods, and the runs of each.

A study is given as files (ground truth and runs), as a folder, or as a YAML file that says what a folder cannot:

    sequences:
      MH_01:
        groundtruth: MH_01/data.csv            # a bag's topic: drive.bag:/groundtruth
        frames: 3682                           # images of the sequence, for completeness
        runs:
          orb_slam3: [MH_01/orb_run0.tum, MH_01/orb_run1.tum]
          vins: MH_01/vins_*.tum               # or a pattern
    methods:
      vins: {align: yaw}                       # what the method cannot observe; see `Alignment`
    settings: {rpe: [1m, 5s], max_difference: 0.02}   # as the options of the command line, which overrule them
    units: {robot_diameter: 0.30, field_of_view: 70}

A folder holds one folder a sequence (or is one): a ground truth in it, named so, and runs named METHOD_run0.tum,
METHOD_run1.tum and so on (`run_names.py`), or in a folder that bears the method's name.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import yaml
from pydantic import BaseModel, ConfigDict, Field, field_validator

from taskslam.datasets.bag_trajectories import is_bag
from taskslam.datasets.trajectory_files import split_topic
from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.field_types import Positive
from taskslam.reading import is_file, is_folder, is_there
from taskslam.studies.replayed_sequences import replayed_sequences
from taskslam.studies.run_names import Grouping, method_names
from taskslam.studies.study_settings import Settings
from taskslam.task import TaskUnits
from taskslam.user_files import read_model

_GROUND_TRUTH = re.compile(r"ground[_-]?truth|gt", re.IGNORECASE)
_IN_A_NAME = re.compile(r"(?:^|[_.-])(?:ground[_-]?truth|gt)(?:$|[_.-])", re.IGNORECASE)
_SUFFIXES = {".tum", ".txt", ".csv", ".npy", ".bag", ".mcap", ".db3"}


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class SequenceRuns(_Part):
    """One sequence. runs: files of each method; frames: how many images or scans it has; times: for KITTI files.

    map: a floor plan (map_server's YAML) in the frame of the ground truth, to draw below.
    """

    groundtruth: str
    runs: dict[str, tuple[str, ...]]
    frames: int | None = Field(default=None, gt=0)
    times: str | None = None
    map: str | None = None

    @field_validator("runs", mode="before")
    @classmethod
    def _one_or_many(cls, value: object) -> object:
        if not isinstance(value, dict):
            return value
        return {name: [files] if isinstance(files, str) else files for name, files in value.items()}


class MethodSettings(_Part):
    """What is known of a method. align: what it cannot observe."""

    align: Alignment


class StudyUnits(TaskUnits):
    """The paper's units for EuRoC (protocol 5.5): robot diameter D in metres, field of view in degrees."""

    field_of_view: Positive = 70.0


class Study(_Part):
    """All that is compared. Paths are as they can be opened."""

    sequences: dict[str, SequenceRuns] = Field(min_length=1)
    methods: dict[str, MethodSettings] = {}
    units: StudyUnits = StudyUnits()
    settings: Settings = Settings()

    def alignment(self, method: str, default: Alignment) -> Alignment:
        """A method's own alignment, or the default."""
        return self.methods[method].align if method in self.methods else default

    def on_map(self, file: str) -> Study:
        """The same, with this map for every sequence."""
        sequences = {name: own.model_copy(update={"map": file}) for name, own in self.sequences.items()}
        return self.model_copy(update={"sequences": sequences})


def load_study(
    source: str, runs: Sequence[str] = (), times: str | None = None, grouping: Grouping = Grouping.BY_NAME
) -> Study:
    """The study that the command line names: GROUNDTRUTH RUN..., a folder, or a YAML file.

    grouping: which files are runs of one method; a YAML file says that itself.

    Raises TrajectoryError: nothing is there, or the YAML file is not valid.
    """
    path = Path(source)
    if path.suffix.lower() in (".yaml", ".yml") and not runs:
        return _from_yaml(path)
    if not runs:
        if not is_folder(path) or is_bag(path):
            raise TrajectoryError(
                f"{source}: one argument alone is a study; expected a folder of sequences, or a YAML file "
                "(a ground truth is followed by its runs)"
            )
        return _from_replays(path, times) or _from_folder(path, times, grouping)
    name = split_topic(source)[0]
    named = name.resolve().parent.name if _GROUND_TRUTH.search(name.stem) else name.stem
    found = _by_method(runs, source, grouping)
    return Study(sequences={named or "sequence": SequenceRuns(groundtruth=source, runs=found, times=times)})


def _from_yaml(path: Path) -> Study:
    study = read_model(path, Study, "study", TrajectoryError)
    sequences = {
        name: SequenceRuns(
            groundtruth=str(path.parent / sequence.groundtruth),
            runs={
                method: tuple(file for pattern in patterns for file in _matching(path, f"{name}, {method}", pattern))
                for method, patterns in sequence.runs.items()
            },
            frames=sequence.frames,
            times=None if sequence.times is None else str(path.parent / sequence.times),
            map=None if sequence.map is None else str(path.parent / sequence.map),
        )
        for name, sequence in study.sequences.items()
    }
    return study.model_copy(update={"sequences": sequences})


def dump_study(study: Study, settings: Settings, folder: Path) -> str:
    """The study as YAML for a file in `folder`, with the settings that it was evaluated by and every run by name."""

    def beside(file: str) -> str:
        path, topic = split_topic(file)
        place = os.path.relpath(path.parent.resolve() / path.name, folder.resolve())
        return place if topic is None else f"{place}:{topic}"

    sequences = {
        name: SequenceRuns(
            groundtruth=beside(sequence.groundtruth),
            runs={method: tuple(map(beside, files)) for method, files in sequence.runs.items()},
            frames=sequence.frames,
            times=None if sequence.times is None else beside(sequence.times),
            map=None if sequence.map is None else beside(sequence.map),
        )
        for name, sequence in study.sequences.items()
    }
    content = study.model_copy(update={"sequences": sequences}).model_dump(
        mode="json", exclude_defaults=True, exclude={"settings"}
    )
    if settings.written():
        content["settings"] = settings.written()
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def _matching(study: Path, whose: str, pattern: str) -> list[str]:
    """Files of a pattern, in the order of their numbers; what is no pattern stands for itself, there or not."""
    if not any(sign in pattern for sign in "*?[") or is_there(split_topic(str(study.parent / pattern))[0]):
        return [str(study.parent / pattern)]
    try:
        found = sorted(map(str, study.parent.glob(pattern)), key=_natural)
    except (ValueError, NotImplementedError) as error:
        raise TrajectoryError(f"{study}: {whose}: {pattern}: {error}") from None
    if not found:
        raise TrajectoryError(f"{study}: {whose}: no file matches {pattern}")
    return found


def _from_replays(folder: Path, times: str | None) -> Study | None:
    """The replays at or below this folder, or None if there is none."""
    sequences = {
        name: SequenceRuns(groundtruth=found.groundtruth, runs=found.runs, times=times)
        for name, found in replayed_sequences(folder).items()
    }
    return Study(sequences=sequences) if sequences else None


def _from_folder(folder: Path, times: str | None, grouping: Grouping) -> Study:
    """Every folder with a ground truth in it, at or below this one."""
    sequences = {}
    for place in (folder, *sorted(path for path in folder.iterdir() if is_folder(path))):
        truths = _ground_truths([path for path in sorted(place.iterdir()) if _readable(path)])
        if not truths:
            continue
        files = [str(path) for path in sorted(place.iterdir()) if path not in truths and _readable(path)]
        files += [str(path) for path in sorted(place.iterdir()) if is_folder(path) and not is_bag(path)]
        if files:
            runs = _by_method(files, str(truths[0]), grouping)
            own = place / "times.txt"
            clock = str(own) if is_file(own) else times
            sequences[place.resolve().name] = SequenceRuns(groundtruth=str(truths[0]), runs=runs, times=clock)
    if not sequences:
        raise TrajectoryError(
            f"{folder}: no sequence; expected folders that hold groundtruth.tum (or .csv, .txt, .bag, .mcap) and runs"
        )
    return Study(sequences=sequences)


def _ground_truths(files: Sequence[Path]) -> list[Path]:
    """The files that are called ground truth, or else the only one that has it in its name."""
    exact = [path for path in files if _GROUND_TRUTH.fullmatch(path.stem)]
    loose = [path for path in files if _IN_A_NAME.search(path.stem)]
    return exact or (loose if len(loose) == 1 else [])


def _by_method(runs: Sequence[str], groundtruth: str, grouping: Grouping) -> dict[str, tuple[str, ...]]:
    """Runs by the method that their names tell (`method_names`), else by the folder's name."""
    found: dict[str, list[str]] = {}
    names = dict(zip(runs, method_names([split_topic(run)[0] for run in runs], grouping), strict=True))
    for run in runs:
        path, topic = split_topic(run)
        if is_folder(path) and not is_bag(path):
            inside = [str(file) for file in path.glob("round*/estimate.tum")]
            inside = inside or [str(file) for file in path.iterdir() if _readable(file)]
            found.setdefault(path.resolve().name, []).extend(sorted(inside, key=_natural))
            continue
        same_bag = topic is not None and path == split_topic(groundtruth)[0]
        name = topic.strip("/") if topic and same_bag and grouping is not Grouping.ONE_METHOD else names[run]
        if path.name == "estimate.tum" and grouping is Grouping.BY_NAME:  # a round of a run directory
            name = path.resolve().parent.parent.name
        found.setdefault(name or path.resolve().parent.name, []).append(run)
    return {name: tuple(files) for name, files in found.items() if files}


def _readable(path: Path) -> bool:
    named = path.suffix.lower() in _SUFFIXES and path.name != "times.txt" and not path.name.startswith(".")
    return (named and is_file(path)) or (is_folder(path) and is_bag(path))


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Sorts run2 before run10."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", name)]
