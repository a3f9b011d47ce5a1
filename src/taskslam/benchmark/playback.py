"""One pass over a dataset: its measurements go to a SLAM method as the closed loop would give them, without the loop.

Time is that of the stamps; what a method is given when, and which frames it misses while it is busy, is decided by its
host exactly as in the loop (design D3, D4). The ground truth goes into the record and to nobody but a reference.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from taskslam.benchmark.shifting import shifted
from taskslam.datasets.dataset import Dataset, TruthPose
from taskslam.errors import DatasetError
from taskslam.geometry import SE2, FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, Measurement, Sensor, TruePose, WheelOdometry
from taskslam.record import MethodNotice, RunWriter
from taskslam.sensors import sensor_kind
from taskslam.slam import Kind, MethodCard, Status
from taskslam.slam.guest.host import MethodHost

TICK = NANOSECONDS // 20
_NEAR = NANOSECONDS // 10  # the truth of the start may be so far in time from the first frame
LINGER = NANOSECONDS  # answers are awaited so long after the last measurement; so long the robot stands between passes


@dataclass(frozen=True)
class Beginning:
    """Where a dataset begins for one method.

    stamp: ns, of the first measurement that it gets. T_map_start: (4, 4) the true pose of the base then, which ties the
    method's start frame to that of the ground truth; None if the truth is not known there. T_odom_start: the wheel
    odometry's first pose, if it says any.
    """

    stamp: int
    T_map_start: FloatArray | None
    T_odom_start: SE2 | None


@dataclass
class Played:
    """What came of a pass. end: ns, the newest stamp; poses: estimates that were tracked."""

    end: int
    measurements: int = 0
    poses: int = 0


def needs_of(card: MethodCard) -> frozenset[Sensor]:
    """What a method must be fed, the truth aside."""
    return frozenset(card.sensors) - {Sensor.TRUE_POSE}


def check_sensors(dataset: Dataset, card: MethodCard) -> None:
    """Raise DatasetError if the dataset lacks a sensor of the method, or the truth that a reference is told."""
    has = ", ".join(sorted(dataset.sensors)) or "none that a method can use"
    if missing := sorted(needs_of(card) - dataset.sensors):
        reasons = "".join(f". {dataset.why_not[sensor]}" for sensor in missing if sensor in dataset.why_not)
        raise DatasetError(
            f"{dataset.path}: method '{card.name}' needs {', '.join(missing)}, which this recording does not give"
            f" (it gives {has}){reasons}"
        )
    if Sensor.TRUE_POSE in card.sensors and next(dataset.truth(), None) is None:
        raise DatasetError(
            f"{dataset.path}: method '{card.name}' is told the truth, which this recording does not hold"
        )


def find_beginning(dataset: Dataset, card: MethodCard) -> Beginning:
    """Look at the first frame, or at the first measurement for a method without frames.

    Raises DatasetError if the dataset holds nothing for this method.
    """
    needs = needs_of(card)
    if needs:
        frames = {sensor for sensor in needs if sensor_kind(sensor).is_frame}
        first = next(dataset.measurements(frames or needs), None)
        stamp = None if first is None else first.stamp
    else:
        truth = next(dataset.truth(), None)
        stamp = None if truth is None else truth.stamp
    if stamp is None:
        raise DatasetError(f"{dataset.path}: holds no measurement of {', '.join(sorted(needs)) or 'the true pose'}")
    odometry = next(dataset.measurements({Sensor.WHEEL_ODOMETRY}), None)
    T_odom_start = odometry.T_odom_base if isinstance(odometry, WheelOdometry) else None
    return Beginning(stamp, _true_pose_at(dataset, stamp), T_odom_start)


def play(
    dataset: Dataset,
    beginning: Beginning,
    method: MethodHost,
    record: RunWriter,
    number: int,
    shift: int,
    elapsed: Callable[[int], int],
    ticked: Callable[[int], None],
) -> Played:
    """Feed the whole dataset to a started method and record round `number`: truth, estimates, odometry.

    shift: ns added to every stamp on its way to the method, so that a second pass comes after the first; the record
    keeps the dataset's own stamps. elapsed: a stamp as time of the run, for the journal. ticked: hears that time.

    Raises:
        DatasetError: something cannot be read. MethodFailedError: the method failed.
    """
    needs = frozenset(method.card.hears(dataset.sensors)) - {Sensor.TRUE_POSE}
    T_map_start = np.eye(4) if beginning.T_map_start is None else beginning.T_map_start
    status = Status.STARTING
    played = Played(beginning.stamp)

    def collect(until: int) -> None:
        nonlocal status
        for estimate in method.collect(until + shift):
            stamp = estimate.stamp - shift
            if stamp < 0:
                continue  # a late answer to the pass before
            if estimate.status is not status:
                record.event(MethodNotice(elapsed(stamp), number, f"{status} -> {estimate.status}"))
                status = estimate.status
            if status is Status.TRACKING:
                played.poses += 1
                record.pose("estimate", number, stamp, T_map_start @ estimate.T_start_base)
        answered = [(stamp - shift, compute, late) for stamp, compute, late in method.answered() if stamp >= shift]
        record.frames(number, answered)

    # Odometry is recorded even if the method does not listen: it is what every method is compared with.
    recorded = needs | ({Sensor.WHEEL_ODOMETRY} & dataset.sensors)
    tick = 0
    for said in _with_truth(dataset.measurements(recorded), dataset.truth()):
        if said.stamp >= tick:
            collect(said.stamp)
            ticked(elapsed(said.stamp))
            tick = said.stamp + TICK
        played.end = max(played.end, said.stamp)
        if isinstance(said, TruthPose):
            _tell_truth(said, T_map_start, method, record, number, shift)
            continue
        played.measurements += 1
        if isinstance(said, WheelOdometry) and beginning.T_odom_start is not None:
            moved = beginning.T_odom_start.inverse() @ said.T_odom_base
            record.pose("odometry", number, said.stamp, T_map_start @ moved.matrix())
        method.feed(shifted(said, shift))
    collect(played.end + LINGER)
    return played


def _with_truth(measurements: Iterator[Measurement], truth: Iterator[TruthPose]) -> Iterator[Measurement | TruthPose]:
    return heapq.merge(measurements, truth, key=lambda said: said.stamp)


def _tell_truth(
    truth: TruthPose, T_map_start: FloatArray, method: MethodHost, record: RunWriter, number: int, shift: int
) -> None:
    record.pose("truth", number, truth.stamp, truth.T_world_base)
    if method.card.kind is Kind.REFERENCE:
        T_start_base = SE2.from_matrix(invert_se3(T_map_start) @ truth.T_world_base)
        method.feed(TruePose(truth.stamp + shift, T_start_base))


def _true_pose_at(dataset: Dataset, stamp: int) -> FloatArray | None:
    """The recorded truth nearest to an instant, if there is one within 0.1 s."""
    nearest: TruthPose | None = None
    for truth in dataset.truth():
        if nearest is None or abs(truth.stamp - stamp) <= abs(nearest.stamp - stamp):
            nearest = truth
        if truth.stamp > stamp:
            break
    return None if nearest is None or abs(nearest.stamp - stamp) > _NEAR else nearest.T_world_base
