"""measured/arrivals.json of a measured run: every arrival with its verdict, its pose as measured, and the picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from taskslam.errors import RecordError
from taskslam.reading import LARGEST_LOG, is_there, read_bytes
from taskslam.record import RunRecord
from taskslam.user_files import complaint

FOLDER, FILE = "measured", "arrivals.json"
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ArrivalRow(_Part):
    """One logged arrival. round, goal: as in the journal, from 0. image: of the camera; picture: beside this.

    pose: of the base in the station's frame, m and rad; sd: of x, y and heading, from one image; spread_m: of the
    images used; other_heading: rad, by the pose in space. None unless measured.
    """

    round: int
    goal: int
    priming: bool
    station: str
    verdict: Literal["measured", "not seen", "ambiguous"]
    reason: str
    image: str | None
    picture: str | None
    frames: int
    pose: tuple[Number, Number, Number] | None
    sd: tuple[Number, Number, Number] | None
    residual_px: Number | None
    margin_px: Number | None
    spread_m: Number | None
    other_heading: Number | None


class PlaneRow(_Part):
    """The plane of a camera: tilt of its axis against the plane's normal, degrees; height above it, m; how sure."""

    camera: str
    tilt: Number
    height: Number
    sd_tilt: Number
    sd_height: Number
    residual_px: Number
    places: int


class MeasuredFile(_Part):
    """The content of measured/arrivals.json. clock_offsets: s, by camera. notes: what the user should know."""

    format: Literal["taskslam-measured/1"] = "taskslam-measured/1"
    direction: Literal["outside-in", "inside-out"]
    published: bool
    clock_offsets: dict[str, Number]
    planes: tuple[PlaneRow, ...]
    notes: tuple[str, ...]
    arrivals: tuple[ArrivalRow, ...]


def dump_measured(content: MeasuredFile) -> bytes:
    """As JSON."""
    return (json.dumps(content.model_dump(mode="json"), indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def load_measured(record: RunRecord) -> MeasuredFile | None:
    """What was measured in a run; None for a run that was not. Raises RecordError if the file is damaged."""
    path: Path = record.directory / FOLDER / FILE
    if record.manifest.source != "measured" or not is_there(path):
        return None
    data = read_bytes(path, "list of arrivals", RecordError, LARGEST_LOG)
    try:
        return MeasuredFile.model_validate_json(data)
    except ValidationError as error:
        raise RecordError(f"{path}: {complaint(error, MeasuredFile)}") from None
