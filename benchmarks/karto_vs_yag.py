"""`karto` beside yag-slam (the OpenKarto matcher itself) on the same recorded drives, in one run, on one core.

    python benchmarks/karto_vs_yag.py [--rounds 1] [--scenarios aws_small_house aws_small_warehouse]

Error: planar distance to the truth, first poses aligned. Times are CPU times. Per keyframe: a scan that
went through the whole matching (karto's gates; yag-slam's keyframes). Per pose: all scans, of which yag-slam carries
most by odometry.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from common import aws_world, machine_line, pin_to_one_core
from recorded_drives import Drive, record
from taskslam.errors import MethodUnavailableError
from taskslam.geometry import SE2, FloatArray, compose, invert, wrap
from taskslam.measurements import LaserScan
from taskslam.slam.base import SlamMethod
from taskslam.slam.methods.karto import Karto
from taskslam.slam.methods.yag_slam import YagSlam


@dataclass(frozen=True)
class Result:
    """errors (N,) m, headings (N,) rad and seconds (N,) of every scan; keyframe (N,) whether it was matched in full."""

    errors: FloatArray
    headings: FloatArray
    seconds: FloatArray
    keyframe: np.ndarray

    def line(self, name: str) -> str:
        """One row for the screen."""
        cm, degrees, ms = 100 * self.errors, np.degrees(self.headings), 1e3 * self.seconds
        each = ms[self.keyframe]
        return (
            f"{name:10} error mean {cm.mean():5.2f} max {cm.max():5.2f} cm,"
            f" heading mean {degrees.mean():.3f} max {degrees.max():.3f} deg;"
            f" {len(each):5d} keyframes, {each.mean():6.2f} ms each (p95 {np.percentile(each, 95):.2f});"
            f" {ms.mean():.2f} ms per pose"
        )


def replay(method: SlamMethod, drive: Drive, processed: Callable[[], object]) -> Result:
    """Feed a drive; `processed` returns something that changes with every keyframe."""
    poses, seconds, keyframe = [], [], []
    for measurement in drive.measurements:
        before = processed()
        begun = time.process_time()
        estimate = method.feed(measurement)
        spent = time.process_time() - begun
        if isinstance(measurement, LaserScan) and estimate is not None:
            poses.append(SE2.from_matrix(estimate.T_start_base).array())
            seconds.append(spent)
            keyframe.append(processed() is not before and processed() != before)
    found = np.array(poses)
    # Both start at the identity, the truth at its first scan: aligned by the first pose.
    offset = compose(invert(drive.truth[0]), drive.truth)
    found = compose(invert(found[0]), found)
    errors = np.hypot(*(found - offset)[:, :2].T)
    return Result(errors, np.abs(wrap(found[:, 2] - offset[:, 2])), np.array(seconds), np.array(keyframe))


def run_karto(drive: Drive, **options: object) -> Result:
    """A fresh `karto` on a drive."""
    method = Karto(**options)
    method.start(drive.robot.rig)
    return replay(method, drive, lambda: method.scans_matched)


def run_yag(drive: Drive) -> Result:
    """A fresh `yag_slam` on a drive. Raises MethodUnavailableError where it is not installed."""
    method = YagSlam()
    method.start(drive.robot.rig)
    return replay(method, drive, lambda: method.keyframes)


def main() -> None:
    """Record, replay, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--scenarios", nargs="+", default=["aws_small_house", "aws_small_warehouse"])
    arguments = parser.parse_args()
    pin_to_one_core()
    print(machine_line())
    for name in arguments.scenarios:
        if name.startswith("aws_") and aws_world(name) is None:
            print(f"{name}: world not found under TASKSLAM_DATA, skipped")
            continue
        drive = record(name, arguments.rounds)
        print(f"\n{name}: {len(drive.truth)} scans, {drive.truth.shape[0] / 10:.0f} s")
        run_karto(Drive(drive.robot, drive.measurements[:600], drive.truth[:100]))  # compile
        ours = run_karto(drive)
        print(ours.line("karto"))
        try:
            theirs = run_yag(drive)
        except MethodUnavailableError as error:
            print(f"yag_slam: {error}")
            continue
        print(theirs.line("yag_slam"))
        per_keyframe = theirs.seconds[theirs.keyframe].mean() / ours.seconds[ours.keyframe].mean()
        per_match = theirs.seconds[theirs.keyframe].mean() / ours.seconds.mean()
        print(
            f"karto: {theirs.errors.mean() / ours.errors.mean():.1f} times as accurate,"
            f" {per_keyframe:.1f} times as fast per keyframe,"
            f" {per_match:.1f} times per scan matched (karto matches every scan)"
        )


if __name__ == "__main__":
    main()
