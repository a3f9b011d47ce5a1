"""The simulator's 2D scans and VLP-16 turns against raw embreex on the same rays, side by side in one run.

    python benchmarks/scan_rays.py [--world FILE]

Limit: Embree itself. Ours adds turning the rays, noise and the limits. Prints the ratio of the medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from common import aws_world, machine_line, pin_to_one_core
from taskslam.geometry import SE2
from taskslam.robot import load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.lidar import LaserScanner
from taskslam.simulation.sensors.lidar_3d import SpinningLidar
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world.loading import load_world


def seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def compare(name: str, sensor: LaserScanner | SpinningLidar, rays: RayCaster, places: np.ndarray) -> None:
    """Print the rate of one sensor and of raw embreex on its rays."""
    ours: list[float] = []
    raw: list[float] = []
    count = 0
    for repeat in range(20):
        for place in places:
            motion = Motion(0, SE2(*place))
            origins, directions = sensor.fan.at(place[None, :])
            count = len(origins)
            turns = [
                (ours, partial(sensor.measure, 0, motion)),
                (raw, partial(rays.scene.run, origins, directions, query="DISTANCE")),
            ]
            # Whoever comes second finds the tree's nodes in the cache, so they take turns.
            for times, work in turns if repeat % 2 else reversed(turns):
                times.append(seconds(work))
        if repeat == 0:
            ours.clear()
            raw.clear()
    print(f"{name}: {count} rays, {len(raw)} times each")
    for who, times in (("raw embreex", raw), ("simulator", ours)):
        median = statistics.median(times)
        print(f"  {who:12} {1e6 * median:7.0f} us, {count / median / 1e6:5.2f} M rays/s")
    print(f"  rate of the simulator over raw embreex: {statistics.median(raw) / statistics.median(ours):.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", type=Path, default=aws_world("aws_small_house"))
    world = load_world(parser.parse_args().world or "house")
    pin_to_one_core()
    rig = load_robot("turtlebot2").rig
    assert rig.lidar_2d is not None
    assert rig.lidar_3d is not None
    rays = RayCaster(world.visual)
    places = np.random.default_rng(0).uniform((-6, -3, -3), (6, 1, 3), (200, 3))
    print(machine_line())
    print(f"{world.name}: {len(world.visual):,} triangles, one core")
    compare("2D LiDAR scan", LaserScanner(rig.lidar_2d, rays, seed=0), rays, places)
    compare("VLP-16 turn", SpinningLidar(rig.lidar_3d, rays, seed=0), rays, places[:50])


if __name__ == "__main__":
    main()
