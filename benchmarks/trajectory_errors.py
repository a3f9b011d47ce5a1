"""Trajectory errors against evo, step by step on the same files, both in one run and taking turns at who goes first.

    python benchmarks/trajectory_errors.py [--poses 20000 1000000] [--repeats 3]

Steps: read two TUM files, associate, align by SE(3), ATE (position and angle), RPE over 1 frame and over 1 m (position
and angle). Seconds are processor time, because a shared machine's wall clock would compare its other users. Printed
beside: the same work at the limit of the machine, reading the bytes and touching every number once, which is what a
step that does nothing else would cost. The results are compared too, to 1e-9.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from evo.core import metrics, sync
from evo.core.units import Unit
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from common import machine_line, pin_to_one_core
from taskslam.evaluation.trajectory_alignment import Alignment, align
from taskslam.evaluation.trajectory_association import associate_trajectories
from taskslam.evaluation.trajectory_errors import absolute_errors, relative_errors
from taskslam.evaluation.trajectory_pairs import DeltaUnit, pairs
from taskslam.record.trajectories import SpatialTrajectory, read_spatial_trajectory, write_trajectory

STEPS = ("read", "associate", "align", "ATE", "RPE 1 frame", "RPE 1 m")


class Ours:
    """Each step leaves in `state` what the next one needs."""

    def __init__(self) -> None:
        self.state: Any = None

    def run(self, step: str, files: tuple[Path, Path]) -> list[np.ndarray]:
        """Do one step; returns its errors, position first."""
        if step == "read":
            self.state = tuple(read_spatial_trajectory(path) for path in files)
        elif step == "associate":
            self.state = associate_trajectories(*self.state)
        elif step == "align":
            reference, estimate = self.state
            self.state = reference, align(estimate, reference, Alignment.SE3).apply(estimate)
        else:
            reference, estimate = self.state
            if step == "ATE":
                errors = absolute_errors(reference, estimate)
            else:
                unit = DeltaUnit.FRAMES if step == "RPE 1 frame" else DeltaUnit.METRES
                errors = relative_errors(reference, estimate, pairs(estimate, 1, unit))
            return [errors.translation, errors.rotation]
        return []


class Evo:
    """The same by evo's own functions, as its commands call them."""

    def __init__(self) -> None:
        self.state: Any = None

    def run(self, step: str, files: tuple[Path, Path]) -> list[np.ndarray]:
        """Do one step; returns its errors, position first."""
        if step == "read":
            self.state = tuple(file_interface.read_tum_trajectory_file(path) for path in files)
        elif step == "associate":
            self.state = sync.associate_trajectories(*self.state)
        elif step == "align":
            self.state[1].align(self.state[0])
        else:
            unit = Unit.meters if step == "RPE 1 m" else Unit.frames
            found = []
            for relation in (metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_rad):
                metric = metrics.APE(relation) if step == "ATE" else metrics.RPE(relation, 1, unit)
                metric.process_data(self.state)
                found.append(np.asarray(metric.error))
            return found
        return []


def seconds(work: Callable[[], list[np.ndarray]]) -> tuple[float, list[np.ndarray]]:
    begun = time.process_time()
    found = work()
    return time.process_time() - begun, found


def write_files(folder: Path, count: int) -> tuple[Path, Path]:
    """A smooth drive of `count` poses, and an estimate of it with noise and a frame of its own."""
    rng = np.random.default_rng(0)
    stamps = 1_403_636_580_000_000_000 + np.arange(count) * 5_000_000
    positions = np.cumsum(rng.normal(0.0, 0.01, (count, 3)), axis=0)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0.0, 0.002, (count, 3)), axis=0))
    frame = Rotation.from_rotvec([0.3, -1.0, 2.0])
    noisy = frame * turns * Rotation.from_rotvec(rng.normal(0, 0.01, (count, 3)))
    estimate = frame.apply(positions + rng.normal(0, 0.02, (count, 3))) + np.array([4.0, 5.0, 6.0])
    files = folder / "groundtruth.tum", folder / "estimate.tum"
    write_trajectory(files[0], SpatialTrajectory(stamps, positions, turns.as_quat()))
    write_trajectory(files[1], SpatialTrajectory(stamps + 1_000_000, estimate, noisy.as_quat()))
    return files


def compare(count: int, repeats: int) -> None:
    """Print a table for one number of poses."""
    times: dict[tuple[str, str], list[float]] = {}
    with tempfile.TemporaryDirectory() as place:
        files = write_files(Path(place), count)
        size = sum(path.stat().st_size for path in files)
        limit, _ = seconds(lambda: [np.bincount(np.fromfile(path, dtype=np.uint8), minlength=256) for path in files])
        for repeat in range(repeats):
            rivals: dict[str, Evo | Ours] = {"evo": Evo(), "taskslam": Ours()}
            for step in STEPS:
                found = {}
                for name in list(rivals)[:: 1 if repeat % 2 else -1]:
                    taken, found[name] = seconds(partial(rivals[name].run, step, files))
                    times.setdefault((name, step), []).append(taken)
                for wanted, got in zip(found["evo"], found["taskslam"], strict=True):
                    np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-9)
    print(f"\n{count:,} poses in each of two files, {size / 1e6:.0f} MB; median of {repeats}")
    print(f"  {'step':12} {'evo s':>9} {'taskslam s':>11} {'ratio':>7}")
    totals = {"evo": 0.0, "taskslam": 0.0}
    for step in STEPS:
        evo, ours = (statistics.median(times[name, step]) for name in ("evo", "taskslam"))
        totals["evo"] += evo
        totals["taskslam"] += ours
        print(f"  {step:12} {evo:9.3f} {ours:11.4f} {evo / ours:7.0f}")
    print(f"  {'all':12} {totals['evo']:9.3f} {totals['taskslam']:11.4f} {totals['evo'] / totals['taskslam']:7.0f}")
    print(f"  limit of reading: {limit:.4f} s to load the bytes and look at each once")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, nargs="+", default=[20_000, 1_000_000])
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    pin_to_one_core()
    print(machine_line())
    with tempfile.TemporaryDirectory() as place:
        ours, files = Ours(), write_files(Path(place), 500)
        for step in STEPS:  # compiled code is loaded before the clock runs
            ours.run(step, files)
    for count in options.poses:
        compare(count, options.repeats if count < 500_000 else 1)


if __name__ == "__main__":
    main()
