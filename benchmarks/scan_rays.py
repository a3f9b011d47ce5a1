"""The simulator's 2D scans against raw embreex on the same rays, side by side in one run.

    python benchmarks/scan_rays.py [--world FILE]

Limit: Embree itself. Ours adds turning the rays, noise and the limits. Prints the ratio of the medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from common import aws_world, machine_line, pin_to_one_core
from taskslam.geometry import SE2
from taskslam.robot import load_robot
from taskslam.simulation.lidar import LaserScanner
from taskslam.simulation.motion import Motion
from taskslam.simulation.raytracing import RayCaster
from taskslam.world.loading import load_world


def seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", type=Path, default=aws_world("aws_small_house"))
    world = load_world(parser.parse_args().world or "house")
    pin_to_one_core()
    lidar = load_robot("turtlebot2").rig.lidar_2d
    assert lidar is not None
    rays = RayCaster(world.visual)
    scanner = LaserScanner(lidar, rays, seed=0)
    places = np.random.default_rng(0).uniform((-6, -3, -3), (6, 1, 3), (200, 3))
    ours, raw = [], []
    for repeat in range(20):
        for place in places:
            pose = place[None, :]
            motion = Motion(0, SE2(*place))
            origins, directions = scanner.fan.at(pose)
            turns = [
                (ours, lambda motion=motion: scanner.measure(0, motion)),
                (raw, lambda o=origins, d=directions: rays.scene.run(o, d, query="DISTANCE")),
            ]
            # Whoever comes second finds the tree's nodes in the cache, so they take turns.
            for times, work in turns if repeat % 2 else reversed(turns):
                times.append(seconds(work))
        if repeat == 0:
            ours.clear()
            raw.clear()
    print(machine_line())
    print(f"{world.name}: {len(world.visual):,} triangles, {lidar.samples} rays a scan, {len(raw)} scans each")
    for name, times in (("raw embreex", raw), ("simulator", ours)):
        median = statistics.median(times)
        print(f"{name:12} {1e6 * median:7.0f} us a scan, {lidar.samples / median / 1e6:5.2f} M rays/s")
    print(f"rate of the simulator over raw embreex: {statistics.median(raw) / statistics.median(ours):.2f}")


if __name__ == "__main__":
    main()
