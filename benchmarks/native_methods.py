"""Our own methods of the paper on the same recorded tours, open loop: time, accuracy and memory, and what they rest on.

    python benchmarks/native_methods.py --places house:2 --methods msckf dsol:preset=indoor fast_lio2:deskew=false

One recording a place holds what all of them hear: stereo pairs, rolling turns of a VLP-16, IMU and wheels. A number
behind a place is how many goals of its tour are driven; behind a method stand its options. Each runs in a process of
its own on one core, and is given every frame. Times are processor times of a frame; the error is that of the position
against the truth; memory is what the process has for itself in the end. AWS worlds are found under TASKSLAM_DATA.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from common import machine_line, pin_to_one_core
from recorded_drives import Drive, record
from stopwatch import Stopwatch
from taskslam.geometry import FloatArray, wrap_angle
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.processes.guest import SINGLE_THREADED
from taskslam.sensors import fitted, sensor_kind
from taskslam.slam.base import SlamMethod
from taskslam.slam.dsol import odometry as dsol
from taskslam.slam.dsol.points import PointFinder
from taskslam.slam.fast_lio2 import odometry as fast_lio2
from taskslam.slam.fast_lio2.voxel_map import VoxelMap
from taskslam.slam.gf_gg.frame import FrameMaker
from taskslam.slam.gf_gg.local_mapping import LocalMapping
from taskslam.slam.gf_gg.loop_closing import LoopClosing
from taskslam.slam.gf_gg.tracking import Tracker
from taskslam.slam.methods.dsol import Dsol
from taskslam.slam.methods.fast_lio2 import FastLio2
from taskslam.slam.methods.gf_gg import GfGg
from taskslam.slam.methods.msckf import Msckf
from taskslam.slam.methods.svo import Svo
from taskslam.slam.msckf.filter import MultiStateFilter
from taskslam.slam.msckf.front_end import FrontEnd
from taskslam.slam.svo import odometry as svo

PLACES = ("aws_small_house:2", "house:2")
METHODS = (
    *("fast_lio2", "fast_lio2:preset=indoor", "fast_lio2:preset=indoor,deskew=false"),
    *("dsol", "dsol:preset=indoor", "dsol:adjust=false", "svo"),
    *("gf_gg", "gf_gg:features_wanted=100,full_frames=0", "gf_gg:good_features=false,good_graph=false"),
    *("msckf", "msckf:observability_constraints=false"),
)
KINDS: dict[str, type[SlamMethod]] = {kind.card.name: kind for kind in (FastLio2, Dsol, Svo, GfGg, Msckf)}
SENSORS = frozenset({Sensor.STEREO_IMAGES, Sensor.POINT_CLOUD, Sensor.IMU, Sensor.WHEEL_ODOMETRY})
STILL = 3 * NANOSECONDS
STEPS: dict[str, tuple[tuple[Any, str, str], ...]] = {
    "fast_lio2": (
        (fast_lio2, "carried", "propagation"),
        (fast_lio2, "deskewed", "back-propagation"),
        (fast_lio2, "centroids", "thinning"),
        (fast_lio2, "update", "matching and update"),
        (VoxelMap, "insert", "map"),
    ),
    "dsol": (
        (dsol, "build_pyramid", "pyramids"),
        (dsol, "align", "alignment"),
        (dsol, "correlations", "verdict"),
        (PointFinder, "find", "points"),
        (dsol, "adjust_window", "adjustment"),
    ),
    "svo": (
        (svo, "build_pyramid", "pyramids"),
        (svo, "align", "sparse alignment"),
        (svo, "match_points", "feature alignment"),
        (svo, "refine_pose", "pose"),
        (svo, "observe", "depth filter"),
        (svo.SvoOdometry, "_new_points", "new points"),
    ),
    "gf_gg": (
        (FrameMaker, "make", "features and disparities"),
        (Tracker, "track", "tracking"),
        (LocalMapping, "process", "local mapping"),
        (LoopClosing, "process", "loop closing"),
    ),
    "msckf": (
        (FrontEnd, "_tracked", "tracking in time"),
        (FrontEnd, "_matched", "left to right"),
        (FrontEnd, "_corners", "corners"),
        (MultiStateFilter, "carry", "propagation"),
        (MultiStateFilter, "enter", "cloning"),
        (MultiStateFilter, "tell", "update"),
    ),
}


@dataclass(frozen=True)
class Result:
    """Of each frame of a drive (N,): errors, m; headings, rad; took, s. megabytes: of the process; shares: of steps."""

    errors: FloatArray
    headings: FloatArray
    took: FloatArray
    lost: int
    megabytes: float
    shares: dict[str, float]

    def line(self, name: str) -> str:
        """Two rows for the screen."""
        ms, cm = 1e3 * self.took, 100 * self.errors
        shares = ", ".join(f"{title} {100 * s:.0f}" for title, s in sorted(self.shares.items(), key=lambda x: -x[1]))
        return (
            f"  {name:44} {ms.mean():6.2f} {np.median(ms):6.2f} {np.percentile(ms, 95):6.2f} ms"
            f" {cm.mean():7.2f} {cm.max():7.2f} cm {np.degrees(np.abs(self.headings).max()):6.2f} deg"
            f" {self.lost:4d} lost {self.megabytes:6.0f} MB\n      %: {shares}"
        )


def follow(drive: Drive, name: str, options: dict[str, object]) -> Result:
    """Feed a drive to a fresh method; the first three seconds are not timed."""
    method = KINDS[name](**options)
    rig = drive.robot.rig
    method.start(rig)
    hears = method.card.hears(fitted(rig))
    rows, lost, begin = [], 0, drive.measurements[0].stamp + STILL
    watch, truth = Stopwatch("the rest", time.process_time), iter(drive.truth)
    with watch.watching(STEPS[name]):
        for measurement in drive.measurements:
            place = next(truth) if sensor_kind(measurement.sensor).is_frame else None
            if measurement.sensor not in hears:
                continue
            if measurement.stamp < begin:
                watch.restart()
            began = time.process_time()
            estimate = method.feed(measurement)
            took = time.process_time() - began
            if estimate is None or place is None or measurement.stamp < begin:
                continue
            lost += estimate.status == "lost"
            T, (x, y, theta) = estimate.T_start_base, place
            heading = wrap_angle(math.atan2(T[1, 0], T[0, 0]) - theta)
            rows.append((math.hypot(T[0, 3] - x, T[1, 3] - y), heading, took))
    errors, headings, took = np.array(rows).T
    whole = sum(watch.spent.values())
    shares = {title: spent / whole for title, spent in watch.spent.items()}
    return Result(errors, headings, took, lost, own_memory(), shares)


def own_memory() -> float:
    """MB that no other process shares with this one."""
    lines = Path("/proc/self/smaps_rollup").read_text(encoding="ascii").splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_")) / 1024


def in_a_process(drive: Drive, name: str, options: dict[str, object]) -> Result:
    """The recording is the parent's, and not copied."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=lambda: theirs.send(follow(drive, name, options)))
    child.start()
    theirs.close()
    try:
        result: Result = ours.recv()
    except EOFError:
        raise SystemExit(f"{name}: its process ended with status {child.exitcode}") from None
    child.join()
    return result


def _in_one_thread() -> None:
    """Start again with linear algebra in one thread, as a method's own process has it: two on one core only wait."""
    alone = dict.fromkeys(SINGLE_THREADED, "1")
    if not alone.items() <= os.environ.items():
        os.execve(sys.executable, sys.orig_argv, {**os.environ, **alone})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--places", nargs="+", default=PLACES)
    parser.add_argument("--methods", nargs="+", default=METHODS, help=f"of {', '.join(STEPS)}; options behind a colon")
    parser.add_argument("--robot", default="turtlebot2")
    asked = parser.parse_args()
    _in_one_thread()
    pin_to_one_core()
    print(machine_line())
    for place in asked.places:
        scenario, _, goals = place.partition(":")
        robot = [f"robot={asked.robot}"]
        drive = record(scenario, 1, 1, int(goals) if goals else None, SENSORS, STILL, robot)
        way = np.hypot(*np.diff(drive.truth[:, :2], axis=0).T).sum()
        print(f"{place}, {way:.0f} m: ms a frame, mean, median and p95; error, mean and largest; heading, largest")
        for text in asked.methods:
            name, _, options = text.partition(":")
            pairs = (option.partition("=") for option in options.split(",") if option)
            result = in_a_process(drive, name, {key: yaml.safe_load(value) for key, _, value in pairs})
            print(result.line(text), flush=True)


if __name__ == "__main__":
    main()
