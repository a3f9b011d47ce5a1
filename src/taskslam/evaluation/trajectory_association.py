"""Which pose of one trajectory belongs to which of another, by their stamps, and which frames several runs share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from taskslam.errors import TrajectoryError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record.trajectories import SpatialTrajectory

Indices = npt.NDArray[np.int64]
Stamps = npt.NDArray[np.int64]

DEFAULT_MAX_DIFFERENCE_NS = 10_000_000
FRAME_TOLERANCE_NS = 1_000_000


def associate(reference: Stamps, estimate: Stamps, max_difference_ns: int) -> tuple[Indices, Indices]:
    """Rows of both (N,), (M,) ascending stamps (ns) that belong together: (K,) and (K,), the same that evo finds.

    Each pose of the shorter trajectory (of the estimate, if they are equally long) takes the pose of the other one that
    is nearest in time, if it is not farther than `max_difference_ns`. A pose of the longer one can be taken twice. Of
    two that are equally near (EuRoC's ground truth and images in MH_03), which one is taken hangs on the rounding of
    seconds to doubles, as in evo: either is half a step off, and numbers that others can reproduce are worth more.
    """
    if len(estimate) > len(reference):
        return _nearest(reference, estimate, max_difference_ns)
    taken_estimate, taken_reference = _nearest(estimate, reference, max_difference_ns)
    return taken_reference, taken_estimate


def associate_trajectories(
    reference: SpatialTrajectory, estimate: SpatialTrajectory, max_difference_ns: int = DEFAULT_MAX_DIFFERENCE_NS
) -> tuple[SpatialTrajectory, SpatialTrajectory]:
    """Both trajectories reduced to the poses that belong together, see `associate`.

    Raises TrajectoryError: one is empty, they do not overlap in time, or no two stamps are near enough.
    """
    for name, trajectory in (("ground truth", reference), ("trajectory", estimate)):
        if not len(trajectory):
            raise TrajectoryError(f"the {name} holds no pose; expected at least one")
    rows, matches = associate(reference.stamps, estimate.stamps, max_difference_ns)
    if not len(rows):
        spans = " and ".join(
            f"{stamps[0] / NANOSECONDS:.3f} s to {stamps[-1] / NANOSECONDS:.3f} s"
            for stamps in (reference.stamps, estimate.stamps)
        )
        apart = estimate.stamps[0] > reference.stamps[-1] or estimate.stamps[-1] < reference.stamps[0]
        why = "they do not overlap in time" if apart else "no two stamps are near enough"
        raise TrajectoryError(
            f"no pose within {max_difference_ns / 1e6:g} ms of the ground truth: {why} ({spans}); "
            "expected stamps of the same clock, in the same unit"
        )
    return reference[rows], estimate[matches]


def common_frames(runs: Sequence[Stamps], tolerance_ns: int = FRAME_TOLERANCE_NS) -> Indices:
    """(F, R) rows: frame f is pose [f, r] of run r, or -1 where run r has no pose of it; F frames of any run, in order.

    A frame is an image or scan of the dataset; runs that saw the same one stamp it alike, up to how their tools round.
    Stamps within `tolerance_ns` are the same frame, or closer ones if the runs themselves are sampled faster than every
    four times that.
    """
    steps = [np.diff(stamps).min() for stamps in runs if len(stamps) > 1]
    tolerance = min([tolerance_ns, *(int(step) // 4 for step in steps)])
    stamps = np.concatenate([np.empty(0, dtype=np.int64), *runs])
    owner = np.repeat(np.arange(len(runs)), [len(run) for run in runs])
    row = np.concatenate([np.empty(0, dtype=np.int64), *(np.arange(len(run)) for run in runs)])
    order = np.argsort(stamps, kind="stable")
    begins = np.diff(stamps[order], prepend=stamps[order][:1] - 2 * tolerance - 1) > tolerance
    frame = np.cumsum(begins) - 1
    table = np.full((int(frame[-1]) + 1 if len(frame) else 0, len(runs)), -1, dtype=np.int64)
    table[frame, owner[order]] = row[order]
    return table


def _nearest(stamps: Stamps, others: Stamps, limit: int) -> tuple[Indices, Indices]:
    if not len(stamps) or not len(others):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    at, near = _seconds(stamps), _seconds(others)
    after = np.minimum(np.searchsorted(near, at, side="right"), len(near) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(near[after] - at) < np.abs(at - near[before]), after, before)
    rows = np.flatnonzero(np.abs(near[nearest] - at) <= limit / NANOSECONDS)
    return rows, nearest[rows]


def _seconds(stamps: Stamps) -> FloatArray:
    """The doubles that the decimal text of these stamps stands for."""
    return stamps // NANOSECONDS + stamps % NANOSECONDS / NANOSECONDS
