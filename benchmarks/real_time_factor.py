"""Real-time factor of each sensor suite on one core, with and without a method's own compute time, and memory.

    python benchmarks/real_time_factor.py [--rounds 1] [--goals 12] [--suites odometry 2d 3d stereo]
    python benchmarks/real_time_factor.py --methods karto orb_slam3 ... [--robot turtlebot2_vga15]

One core holds everything: simulator, navigation, host and the method's process. For each suite first a witness drives:
a method that is handed all of the suite's measurements in its own process, and steers by the truth. That is the loop
alone. Then a real method drives on the same measurements. Memory is the largest resident set of each process.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from common import machine_line, pin_to_one_core, small_house
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage
from taskslam.measurements import Sensor
from taskslam.mode import Mode
from taskslam.processes.memory import own_peak_memory
from taskslam.record.run_directory import load_run
from taskslam.slam.methods.ground_truth import GroundTruth


class Planar(GroundTruth):
    """Is handed laser scans and odometry."""

    card = replace(
        GroundTruth.card, name="planar", sensors=(Sensor.TRUE_POSE, Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY)
    )


class Spatial(GroundTruth):
    """Is handed point clouds and inertial samples."""

    card = replace(GroundTruth.card, name="spatial", sensors=(Sensor.TRUE_POSE, Sensor.POINT_CLOUD, Sensor.IMU))


class Seeing(GroundTruth):
    """Is handed stereo images."""

    card = replace(GroundTruth.card, name="seeing", sensors=(Sensor.TRUE_POSE, Sensor.STEREO_IMAGES))


SUITES = {
    "odometry": ("odometry alone", ("ground_truth", "wheel_odometry")),
    "2d": ("2D LiDAR", ("real_time_factor:Planar", "karto", "hector")),
    "3d": ("VLP-16 and IMU", ("real_time_factor:Spatial", "fast_lio2", "rko_lio", "kiss_icp")),
    "stereo": ("stereo 752 x 480 at 30 Hz", ("real_time_factor:Seeing", "orb_slam3")),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--goals", type=int, default=3, help="how many goals of the tour")
    parser.add_argument("--suites", nargs="+", choices=SUITES, default=list(SUITES))
    parser.add_argument("--methods", nargs="+", metavar="NAME", help="these methods, instead of suites")
    parser.add_argument("--robot", default="turtlebot2", help="a preset or a robot file, of a slower camera say")
    asked = parser.parse_args()
    suites = {"": ("methods", tuple(asked.methods))} if asked.methods else {name: SUITES[name] for name in asked.suites}
    name, stage = small_house(asked.goals, asked.rounds, asked.robot)
    with tempfile.TemporaryDirectory() as folder:
        run(stage, stage.spec("karto", Mode.WITHOUT_MAP, seed=99), Path(folder))  # compiles and fills caches
        pin_to_one_core()
        print(machine_line())
        print(f"{name}, {asked.robot}, {asked.goals} goals, {asked.rounds} round(s), one core")
        for title, methods in suites.values():
            print(f"{title}:")
            for method in methods:
                measure(stage, method, Path(folder))
    print(f"peak memory of the benchmark: {mebibytes(own_peak_memory())}")


def measure(stage: Stage, method: str, folder: Path) -> None:
    """Drive once and print how much faster than real time that was."""
    began = time.perf_counter()
    directory, complete = run(stage, stage.spec(method, Mode.WITHOUT_MAP), folder)
    wall = time.perf_counter() - began
    manifest = load_run(directory).manifest
    what = "the loop alone" if ":" in method else method
    print(
        f"  {what:15} {manifest.simulated_s:6.0f} s simulated, {manifest.simulated_s / wall:6.2f} x real time;"
        f" its process {mebibytes(manifest.method_peak_bytes)}; {'complete' if complete else manifest.failure}",
        flush=True,
    )


def mebibytes(size: int | None) -> str:
    """Bytes in words."""
    return "of unknown size" if size is None else f"{size / 2**20:.0f} MiB"


if __name__ == "__main__":
    main()
