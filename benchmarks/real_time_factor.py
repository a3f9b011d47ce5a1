"""Real-time factor of the 2D LiDAR loop on one core, with and without the method's own compute time, and memory.

    python benchmarks/real_time_factor.py [--rounds 1]

One core holds everything: simulator, navigation, host and the method's process. `loop` leaves out the CPU time that the
method's process spent; `all` is what a user waits. Peak memory is the largest resident set of each process.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path

from common import aws_world, machine_line, pin_to_one_core
from taskslam.benchmark.observer import Observer
from taskslam.benchmark.protocol import Mode
from taskslam.benchmark.run import RunRequest, run
from taskslam.benchmark.stage import set_stage
from taskslam.record.run_directory import load_run
from taskslam.scenario import load_scenario


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=1)
    rounds = parser.parse_args().rounds
    world = aws_world("aws_small_house")
    name = "aws_small_house" if world else "house"
    scenario = load_scenario(name, [f"protocol.rounds={rounds}"])
    stage = set_stage(scenario, [world] if world else [], Observer())
    with tempfile.TemporaryDirectory() as folder:
        run(stage, RunRequest("karto", Mode.WITHOUT_MAP, seed=99), Path(folder))  # compiles and fills caches
        pin_to_one_core()
        print(machine_line())
        print(f"{name}, {rounds} round(s), one core")
        for method in ("wheel_odometry", "ground_truth", "karto"):
            begun = time.perf_counter()
            directory, complete = run(stage, RunRequest(method, Mode.WITHOUT_MAP), Path(folder))
            wall = time.perf_counter() - begun
            manifest = load_run(directory).manifest
            loop = manifest.simulated_s / (wall - manifest.compute_s)
            print(
                f"{method:15} {manifest.simulated_s:6.0f} s simulated, loop {loop:5.1f} x real time,"
                f" all {manifest.simulated_s / wall:5.1f} x; {'complete' if complete else manifest.failure}"
            )
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    child = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"peak memory: benchmark {own:.0f} MiB, method's process {child:.0f} MiB")


if __name__ == "__main__":
    main()
