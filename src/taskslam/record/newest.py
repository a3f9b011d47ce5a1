"""The newest state of a run that is under way, for whoever watches: `newest.json` in its hidden folder.

It is written about once a second of a clock, holds no more than a page shows, and goes when the run is finished: no
result rests on it. A reader may meet it half-written, and then looks again.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from taskslam.errors import RecordError
from taskslam.geometry import SE2, FloatArray
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_bytes

NEWEST = "newest.json"
MOST_SHOWN = 240  # points of a scan, and of a way
_MILLIMETRES = 3  # decimals
T = TypeVar("T")

Number = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = tuple[Number, Number]
Pose = tuple[Number, Number, Number]


class Newest(BaseModel):
    """Where the robot is, and what it sees.

    t: ns of simulated time; round: from 0, as in the journal; truth, estimate: x, y and heading in `map`, None where it
    is not known; scan: points in `map` that the newest scan has hit, where the estimate puts them; way: where the robot
    truly went in this round so far, or was estimated to where nobody knows.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    t: Annotated[int, Field(ge=0)]
    round: Annotated[int, Field(ge=0)]
    truth: Pose | None = None
    estimate: Pose | None = None
    scan: Annotated[tuple[Place, ...], Field(max_length=MOST_SHOWN)] = ()
    way: Annotated[tuple[Place, ...], Field(max_length=MOST_SHOWN)] = ()


def newest_state(
    t: int,
    round: int,  # noqa: A002 its word
    truth: SE2 | None,
    estimate: SE2 | None,
    scan: FloatArray,
) -> Newest:
    """The state of this instant, without the way. scan: (N, 2) points in `map`."""
    return Newest.model_construct(
        t=t, round=round, truth=_pose(truth), estimate=_pose(estimate), scan=_places(few(scan.tolist()))
    )


def with_way(state: Newest, way: Sequence[SE2 | FloatArray]) -> Newest:
    """The same with where the robot went: few planar poses, or (4, 4) in space."""
    planar = [(at.x, at.y) if isinstance(at, SE2) else (float(at[0, 3]), float(at[1, 3])) for at in way]
    return state.model_copy(update={"way": _places(planar)})


def few(rows: Sequence[T]) -> Sequence[T]:
    """Every second, third … of the rows, with the last one, so that they are few enough to be shown."""
    step = -(-len(rows) // MOST_SHOWN) or 1
    return rows[::-step][::-1]


def write_newest(folder: Path, state: Newest) -> None:
    """Write it into a run's hidden folder. That it cannot be written is no reason to end a run."""
    with contextlib.suppress(OSError):
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC
        descriptor = os.open(folder / NEWEST, flags, 0o666)
        try:
            os.write(descriptor, state.model_dump_json().encode())
        finally:
            os.close(descriptor)


def read_newest(folder: Path) -> Newest | None:
    """What stands in a run's hidden folder; None where nothing does, or nothing whole."""
    try:
        return Newest.model_validate_json(read_bytes(folder / NEWEST, "state", RecordError, LARGEST_WRITTEN_BY_HAND))
    except (RecordError, ValidationError):
        return None


def _pose(pose: SE2 | None) -> Pose | None:
    return None if pose is None else (round(pose.x, 4), round(pose.y, 4), round(pose.theta, 4))


def _places(points: Sequence[Sequence[float]]) -> tuple[Place, ...]:
    return tuple((round(x, _MILLIMETRES), round(y, _MILLIMETRES)) for x, y in points)
