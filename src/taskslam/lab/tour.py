"""A finished run as the virtual lab relives it: where the robot was at any instant, and when pictures are taken."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.geometry import FloatArray
from taskslam.lab.robot import Floor, Sway, travelled
from taskslam.measurements import NANOSECONDS
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.record import Arrival, RunRecord
from taskslam.simulation.streams import stream

_JITTER = 0.15  # of the period: cameras that are read over USB or a network are not metronomes

Times = npt.NDArray[np.float64]


class Motion:
    """Where the robot was in one round. Times are s of simulated time within the run."""

    def __init__(self, record: RunRecord, number: int, sway: Sway, seed: int) -> None:
        trajectory = record.trajectory(number, "truth")
        if len(trajectory) < 2:
            raise InputError(
                f"{record.directory}: round {number} has no true trajectory; the lab needs a simulated run"
            )
        self._stamps = trajectory.stamps / NANOSECONDS
        self._poses = trajectory.poses.copy()
        self._poses[:, 2] = np.unwrap(self._poses[:, 2])
        self._way = travelled(self._poses)
        self._floor = Floor(sway, seed, number)
        self.begin, self.end = float(self._stamps[0]), float(self._stamps[-1])

    def planar(self, times: Times) -> FloatArray:
        """(N, 3) true x, y, theta in `map`."""
        return np.column_stack([np.interp(times, self._stamps, self._poses[:, axis]) for axis in range(3)])

    def poses(self, times: Times) -> FloatArray:
        """(N, 4, 4) true poses of the base in `map`, with the sway of an uneven floor."""
        return self._floor.poses(self.planar(times), np.interp(times, self._stamps, self._way))


@dataclass(frozen=True)
class RelivedTour:
    """arrivals: in time order; motions: of every round begun; priming: rounds that only built the map."""

    record: RunRecord
    arrivals: tuple[Arrival, ...]
    motions: dict[int, Motion]
    priming: frozenset[int]


def relive(record: RunRecord, sway: Sway, seed: int) -> RelivedTour:
    """The tour of a finished run.

    Raises:
        InputError: the run holds no arrival or no true trajectory.
    """
    arrivals = tuple(event for event in record.events if isinstance(event, Arrival))
    if not arrivals:
        raise InputError(f"{record.directory}: the run holds no arrival; there is nothing to photograph")
    numbers = sorted({arrival.round for arrival in arrivals})
    motions = {number: Motion(record, number, sway, seed) for number in numbers}
    priming = frozenset(started.round for started in record.rounds() if started.priming)
    return RelivedTour(record, arrivals, motions, priming)


@dataclass(frozen=True)
class Shutter:
    """One picture to be taken: its middle instant, s of simulated time, the round, and whose arrival it belongs to."""

    time: float
    round: int
    arrival: Arrival


class Kept:
    """Which of the pictures taken a recorder keeps: those that show a tag, and others as a heartbeat."""

    def __init__(self, heartbeat: float | None) -> None:
        """heartbeat: s after which a picture is kept though it shows no tag."""
        self._heartbeat = heartbeat
        self._last = -np.inf

    def keeps(self, time: float, corners: FloatArray, camera: Camera) -> bool:
        """Whether the picture taken at `time`, with true corners of tags (N, 4, 2) px, is kept; in order of time."""
        size = np.array([camera.width, camera.height]) - 0.5
        with np.errstate(invalid="ignore"):  # what is behind the camera is NaN, thus not inside
            shown = ((corners > -0.5) & (corners < size)).all(axis=(-2, -1)).any()
        due = self._heartbeat is not None and time - self._last >= self._heartbeat
        if not (shown or due):
            return False
        self._last = time
        return True


def shutters(
    tour: RelivedTour,
    goals: Iterable[int],
    rate: float,
    before: float,
    after: float,
    dropped: float,
    seed: int,
    name: str,
) -> list[Shutter]:
    """When camera `name` takes pictures around arrivals at `goals` (from 0), in time order; some frames are lost."""
    wanted = frozenset(goals)
    dice = stream(seed, f"lab/{name}/shutter")
    first = dice.uniform(0, 1 / rate)
    chosen: list[Shutter] = []
    taken = -1
    for arrival in tour.arrivals:
        if arrival.goal not in wanted:
            continue
        motion, at = tour.motions[arrival.round], arrival.t / NANOSECONDS
        begin, end = max(at - before, motion.begin), min(at + after, motion.end)
        for tick in range(max(taken + 1, int(np.ceil((begin - first) * rate))), int((end - first) * rate) + 1):
            taken = tick
            lost = dice.uniform() < dropped
            time = first + (tick + _JITTER * dice.uniform(-0.5, 0.5)) / rate
            if not lost and motion.begin <= time <= motion.end:
                chosen.append(Shutter(time, arrival.round, arrival))
    return chosen
