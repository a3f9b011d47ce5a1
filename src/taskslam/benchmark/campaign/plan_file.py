"""The runs of a campaign in a file beside its results, OUT/campaign/plan.json: whoever has the folder can go on.

A tour is written once, however many runs are driven on it, so that ten thousand runs are a few megabytes.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from taskslam.benchmark.campaign.campaign_file import Campaign
from taskslam.benchmark.campaign.planning import Plan
from taskslam.benchmark.engine import Ending, Result
from taskslam.benchmark.spec import Drive, RunSpec
from taskslam.errors import RecordError
from taskslam.files import write_whole, writing
from taskslam.mode import Mode
from taskslam.reading import LARGEST_JOURNAL, is_there, read_bytes
from taskslam.slam.guest.latency import LatencyModel
from taskslam.user_files import complaint


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Run(_Part):
    """A spec without its task, whose place in the list of tours is `tour`."""

    tour: int
    method: str
    mode: Mode
    seed: int
    options: dict[str, Any]
    latency: LatencyModel
    sealed: bool
    behaviour: int


class _Refused(_Part):
    title: str
    detail: str


class _File(_Part):
    format: Literal["taskslam-campaign/1"] = "taskslam-campaign/1"
    campaign: Campaign
    folders: tuple[str, ...]
    refused: tuple[_Refused, ...]
    tours: tuple[Drive, ...]
    runs: tuple[_Run, ...]


@dataclass(frozen=True)
class KeptPlan:
    """A campaign and its runs, as they were planned."""

    campaign: Campaign
    plan: Plan


def campaign_folder(out: Path) -> Path:
    """Where a campaign keeps what is no result: plan, notes, scripts and logs of jobs."""
    return out / "campaign"


def write_plan(out: Path, campaign: Campaign, plan: Plan) -> Path:
    """Write the plan into the folder of the results; its path. Raises DiskFullError."""
    tours: dict[str, int] = {}
    runs = []
    for spec in plan.specs:
        assert isinstance(spec.task, Drive)
        tour = tours.setdefault(spec.task.model_dump_json(), len(tours))
        runs.append(_Run(tour=tour, **{name: getattr(spec, name) for name in _Run.model_fields if name != "tour"}))
    head = {
        "campaign": campaign.model_dump(mode="json"),
        "folders": [str(folder.absolute()) for folder in plan.folders],
        "format": "taskslam-campaign/1",
        "refused": [{"title": result.title, "detail": result.detail} for result in plan.refused],
        "tours": [json.loads(tour) for tour in tours],
    }
    rows = ",\n".join(run.model_dump_json() for run in runs)
    path = _path(out)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, f'{json.dumps(head, ensure_ascii=False)[:-1]}, "runs": [\n{rows}\n]}}\n')
    return path


def has_plan(out: Path) -> bool:
    """Whether a campaign was planned there."""
    return is_there(_path(out))


def read_plan(out: Path) -> KeptPlan:
    """The plan in a folder of results.

    Raises:
        RecordError: there is none, or it cannot be read; naming the file and what was expected.
    """
    path = _path(out)
    if not has_plan(out):
        raise RecordError(f"{out}: holds no campaign; expected the folder that `taskslam campaign run` wrote")
    try:
        content = _File.model_validate_json(read_bytes(path, "campaign's plan", RecordError, LARGEST_JOURNAL))
    except ValidationError as error:
        raise RecordError(f"{path}: {complaint(error, _File)}") from None
    specs = []
    for run in content.runs:
        if not 0 <= run.tour < len(content.tours):
            raise RecordError(f"{path}: a run names tour {run.tour} of {len(content.tours)}")
        said = {name: getattr(run, name) for name in _Run.model_fields if name != "tour"}
        specs.append(RunSpec(task=content.tours[run.tour], **said))
    refused = tuple(Result(one.title, Ending.REFUSED, one.detail) for one in content.refused)
    return KeptPlan(content.campaign, Plan(tuple(specs), refused, tuple(map(Path, content.folders))))


def _path(out: Path) -> Path:
    return campaign_folder(out) / "plan.json"
