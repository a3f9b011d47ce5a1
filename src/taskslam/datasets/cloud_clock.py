"""What the time field of a point cloud means, of the many that drivers write: told from a few clouds, once.

Velodyne `time` and Ouster `t` count from the header's stamp, Livox and Hesai `timestamp` since 1970, in seconds or
nanoseconds, as float or integer; others write microseconds or the share of a turn. A turn takes no longer than the time
from one cloud to the next: the reading that fits that is the right one, and what fits none is not believed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.measurements import NANOSECONDS

Cells = dict[str, npt.NDArray[Any]]

_NAMES = ("time", "t", "offset_time", "timestamp", "time_stamp")
_SOUNDS_LIKE = re.compile(r".*(time|stamp).*|t|ts|dt", re.IGNORECASE)
_SCALES = {"nanoseconds": 1.0, "microseconds": 1e3, "milliseconds": 1e6, "seconds": 1e9}
_NEAR_NS = 2e9  # what counts since 1970 lies so near to the header's stamp
_LONG_AFTER_1970_NS = 10**17
_ALIKE = 0.2
_FAR_NS = 4e18  # half of what int64 holds
_TURN = (0.3, 1.2)  # of the time between two clouds: what a turn may take
_LONGEST_TURN_NS = 1e9  # where the time between two clouds is not known


@dataclass(frozen=True)
class CloudClock:
    """field: the name, or None for clouds without times; scale: ns a unit; since_1970: else from the header's stamp.

    note: a sentence on what was guessed or not believed, or nothing.
    """

    field: str | None = None
    scale: float = 1.0
    since_1970: bool = False
    note: str = ""

    def offsets(self, cells: Cells, stamp: int) -> npt.NDArray[np.int64]:
        """(N,) ns of each point after the header's stamp (ns); zeros where there is no such field."""
        times = cells.get(self.field or "")
        if times is None:
            return np.zeros(len(cells["x"]), np.int64)
        if times.dtype.kind in "iu" and self.scale == 1.0:
            whole = times.astype(np.int64)
            return whole - stamp if self.since_1970 else whole
        scaled = times.astype(np.float64) * self.scale
        return np.round(_bounded(scaled - (stamp if self.since_1970 else 0))).astype(np.int64)


def _bounded(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.clip(np.nan_to_num(values, nan=_FAR_NS, posinf=_FAR_NS, neginf=-_FAR_NS), -_FAR_NS, _FAR_NS)


def cloud_clock(clouds: Sequence[tuple[Cells, int]], period_ns: float | None) -> CloudClock:
    """The clock of the first clouds: their columns and stamps (ns). period_ns: from one to the next, if it is known."""
    cells = next((cells for cells, _ in clouds if len(cells["x"]) > 1), None)
    if cells is None:
        return CloudClock()
    field = next((name for name in _NAMES if name in cells), None)
    guessed = field is None
    field = field or next((name for name in cells if _SOUNDS_LIKE.fullmatch(name)), None)
    if field is None:
        return CloudClock()
    times = [(_bounded(cells[field].astype(np.float64)), stamp) for cells, stamp in clouds if len(cells["x"]) > 1]
    usual = "nanoseconds" if cells[field].dtype.kind in "iu" else "seconds"
    longest = period_ns or _LONGEST_TURN_NS
    span = float(np.median([np.ptp(values) for values, _ in times]))
    since_1970 = any(_runs_with_the_header(times, scale) for scale in _SCALES.values())
    units = [unit for unit, scale in _SCALES.items() if not since_1970 or _runs_with_the_header(times, scale)]
    turns = [unit for unit in units if _TURN[0] * longest <= span * _SCALES[unit] <= _TURN[1] * longest]
    shorter = [unit for unit in units if span * _SCALES[unit] <= _TURN[1] * longest]
    unit = (
        next(iter(turns), None)
        or (usual if usual in shorter else None)
        or (shorter[0] if since_1970 and shorter else "")
    )
    if unit:
        since = " since 1970" if since_1970 else ""
        plain = not guessed and unit == usual and since_1970 == (field == "timestamp")
        note = "" if plain or not span else f"its field '{field}' is taken for {unit}{since}"
        return CloudClock(field, _SCALES[unit], since_1970, note)
    if period_ns and 0.9 <= span <= 1.0:
        note = f"its field '{field}' runs from 0 to 1 and is taken for the share of a turn"
        return CloudClock(field, period_ns, False, note)
    turn = f"a turn of {longest / NANOSECONDS:g} s"
    return CloudClock(note=f"its field '{field}' fits no unit of time, given {turn}, and is not believed")


def _runs_with_the_header(times: Sequence[tuple[npt.NDArray[np.float64], int]], scale: float) -> bool:
    """Whether the times of clouds grow as their stamps do and lie near them: they count since 1970, as those do."""
    (first, began), (last, ended) = times[0], times[-1]
    middles = float(np.median(first)) * scale, float(np.median(last)) * scale
    near = abs(middles[0] - began) < _NEAR_NS
    if ended == began:
        return near and began > _LONG_AFTER_1970_NS
    return near and abs((middles[1] - middles[0]) / (ended - began) - 1.0) < _ALIKE
