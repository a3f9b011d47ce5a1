"""The trajectories of one run, each file read once; what cannot be read is named and drawn without."""

from __future__ import annotations

import numpy as np

from taskslam.errors import RecordError
from taskslam.record import PoseName, RunRecord, Trajectory

NOTHING = Trajectory(np.empty(0, dtype=np.int64), np.empty((0, 3)))


class Tracks:
    """Reads trajectories of a run in `map` when first asked for, and keeps them. damage: why a file was left out."""

    def __init__(self, record: RunRecord) -> None:
        """Nothing is read yet."""
        self._record = record
        self._kept: dict[tuple[int, PoseName], Trajectory] = {}
        self.damage: list[str] = []

    def get(self, round_number: int, name: PoseName) -> Trajectory:
        """A round's trajectory; empty if none was recorded, or if its file is damaged."""
        key = (round_number, name)
        if key not in self._kept:
            try:
                self._kept[key] = self._record.trajectory(round_number, name)
            except RecordError as error:
                self._kept[key] = NOTHING
                self.damage.append(str(error))
        return self._kept[key]
