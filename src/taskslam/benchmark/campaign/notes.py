"""Why runs could not be driven: a small file for each in OUT/campaign/notes, gone once the run is finished.

Engines that end before their runs do leave them for whoever asks later; each is written by the one who drove.
"""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from taskslam.benchmark.campaign.plan_file import campaign_folder
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.spec import RunSpec
from taskslam.errors import RecordError
from taskslam.files import forget, write_whole, writing
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_bytes

NOT_DRIVEN = (Ending.UNAVAILABLE, Ending.REFUSED, Ending.FAILED)


class Note(BaseModel):
    """What became of a run that could not be driven, in words, and the name of the machine that tried."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    ending: Ending
    detail: str
    machine: str = ""


def keep(out: Path, result: Result, machine: str | None = None) -> None:
    """Write down why a run could not be driven, or forget what was said before of one that is finished.

    machine: that tried; this one, if nothing is given. Raises DiskFullError.
    """
    if result.spec is None:
        return
    path = _folder(out) / f"{result.spec.digest}.json"
    if result.ending in NOT_DRIVEN:
        note = Note(title=result.title, ending=result.ending, detail=result.detail, machine=machine or platform.node())
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, note.model_dump_json() + "\n")
    elif result.ending is not Ending.SUBMITTED:
        forget(path)


def notes(out: Path) -> dict[str, Note]:
    """All that is kept, by the digests of the runs. One that cannot be read is left out: the run tells itself."""
    return dict(_read(_folder(out)))


@dataclass
class Keeping(Watcher):
    """A watcher that keeps notes of what it hears, and passes everything on."""

    out: Path
    watcher: Watcher

    def begins(self, spec: RunSpec) -> None:
        """A run starts."""
        self.watcher.begins(spec)

    def goes_on(self, spec: RunSpec, progress: dict[str, object]) -> None:
        """A line of progress from a run."""
        self.watcher.goes_on(spec, progress)

    def ends(self, result: Result) -> None:
        """A run is over."""
        try:
            keep(self.out, result)
        finally:
            self.watcher.ends(result)


def _read(folder: Path) -> Iterator[tuple[str, Note]]:
    for path in sorted(folder.glob("*.json")):
        try:
            data = read_bytes(path, "note", RecordError, LARGEST_WRITTEN_BY_HAND)
            yield path.stem, Note.model_validate_json(data)
        except (RecordError, ValidationError):
            continue


def _folder(out: Path) -> Path:
    return campaign_folder(out) / "notes"
