"""How a sensor is truly fitted: where it sits, and how late its stamps are. Methods are told the data sheet."""

from __future__ import annotations

from typing import Any

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.robot import Mount
from taskslam.robot.imperfections import Fitting
from taskslam.robot.parts import Vector3
from taskslam.simulation.streams import stream


def truly_mounted(part: Any, wrong: Fitting, seed: int, name: str) -> Any:
    """The part of sensor `name` with its mount as it truly is in a run with this seed."""
    if not (wrong.misplaced or wrong.misaligned):
        return part
    off = stream(seed, f"{name}/mount").uniform(-1.0, 1.0, 6)
    moved = _off(part.mount.xyz, wrong.misplaced, off[:3])
    turned = _off(part.mount.rpy, wrong.misaligned, off[3:])
    return part.model_copy(update={"mount": Mount(xyz=moved, rpy=turned)})


def _off(nominal: Vector3, most: float | None, share: FloatArray) -> Vector3:
    a, b, c = (np.asarray(nominal) + (most or 0.0) * share).tolist()
    return a, b, c


class LateClock:
    """Stamps of sensor `name` come after what they stand for: by an offset of the run's, and by a jitter."""

    def __init__(self, wrong: Fitting, seed: int, name: str) -> None:
        self._wrong, self._seed, self._name = wrong, seed, name
        self._offset = (wrong.late or 0.0) * stream(seed, f"{name}/clock").random()
        self.reset(0)

    def reset(self, count: int) -> None:
        """A fresh jitter after the count-th reset; the offset stays."""
        self._jitter = stream(self._seed, f"{self._name}/clock_jitter", count)

    def next(self) -> int:
        """How late the next stamp is, ns."""
        jitter = self._wrong.jitter * self._jitter.random() if self._wrong.jitter else 0.0
        return round((self._offset + jitter) * NANOSECONDS)
