"""`fast_lio2` on recorded tours, open loop: its error against the truth, and processor time of a scan on one core.

    python benchmarks/fast_lio2.py --places house hospital:5 --option preset=indoor

A number behind a place is how many goals of its tour are driven. AWS worlds are found under TASKSLAM_DATA.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np
import yaml

from common import machine_line, pin_to_one_core
from recorded_drives import Drive, record
from taskslam.geometry import FloatArray, wrap_angle
from taskslam.measurements import PointCloud
from taskslam.slam.methods.fast_lio2 import FastLio2

PLACES = ("aws_small_house", "hospital:5", "office:4", "house")
FIRST = 25  # scans that are not timed: those of the standing start


def follow(drive: Drive, options: dict[str, object]) -> tuple[FloatArray, list[str]]:
    """(N, 4) position error m, height m, heading error rad and milliseconds of each scan; and the statuses."""
    method = FastLio2(**options)
    method.start(drive.robot.rig)
    rows, statuses, truth = [], [], iter(drive.truth)
    for measurement in drive.measurements:
        began = time.process_time()
        estimate = method.feed(measurement)
        took = (time.process_time() - began) * 1e3
        if not isinstance(measurement, PointCloud):
            continue
        assert estimate is not None
        T, (x, y, theta) = estimate.T_start_base, next(truth)
        heading = wrap_angle(math.atan2(T[1, 0], T[0, 0]) - theta)
        rows.append((math.hypot(T[0, 3] - x, T[1, 3] - y), T[2, 3], heading, took))
        statuses.append(estimate.status.value)
    return np.array(rows), statuses


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--places", nargs="+", default=PLACES)
    parser.add_argument("--option", action="append", default=[], help="of the method: preset=indoor; may be repeated")
    asked = parser.parse_args()
    options = {key: yaml.safe_load(value) for key, _, value in (text.partition("=") for text in asked.option)}
    pin_to_one_core()
    print(machine_line())
    for place in asked.places:
        name, _, goals = place.partition(":")
        rows, statuses = follow(record(name, seed=1, goals=int(goals) if goals else None, rolling=True), options)
        errors, heights, headings, took = rows.T
        print(
            f"{name}: {100 * errors.mean():.1f} cm on average, {100 * errors.max():.1f} at most; "
            f"height {100 * np.abs(heights).max():.0f} cm, heading {np.degrees(np.abs(headings)).max():.2f} degrees; "
            f"{took[FIRST:].mean():.2f} ms, p95 {np.percentile(took[FIRST:], 95):.2f}; lost {statuses.count('lost')}"
        )


if __name__ == "__main__":
    main()
