"""The simulator's 2D scans and VLP-16 turns against Embree on the same rays, side by side in one run.

    python benchmarks/scan_rays.py [--world FILE]

Limit: Embree's packets of coherent rays. Ours adds turning the rays, noise and the limits. Prints ratios of medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from common import aws_world, machine_line, pin_to_one_core, single_rays
from taskslam.geometry import SE2
from taskslam.robot import load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.lidar import LaserScanner
from taskslam.simulation.sensors.lidar_3d import SpinningLidar
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import World
from taskslam.world.loading import load_world


def seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def compare(name: str, sensor: LaserScanner | SpinningLidar, world: World, rays: RayCaster, places: np.ndarray) -> None:
    """Print the rate of one sensor, and of Embree on its rays."""
    raw = single_rays(world.visual)
    times: dict[str, list[float]] = {"the simulator": [], "packets": [], "single rays": []}
    count = 0
    for repeat in range(20):
        for place in places:
            motion = Motion(0, SE2(*place))
            origins, directions = sensor.fan.at(place[None, :])
            count = len(origins)
            turns = [
                ("the simulator", partial(sensor.measure, 0, motion)),
                ("packets", partial(rays.distances, origins, directions)),
                ("single rays", partial(raw.run, origins, directions, query="DISTANCE")),
            ]
            # Whoever comes second finds the tree's nodes in the cache, so they take turns.
            for who, work in turns if repeat % 2 else reversed(turns):
                times[who].append(seconds(work))
        if repeat == 0:
            for spent in times.values():
                spent.clear()
    ours = statistics.median(times["the simulator"])
    print(f"{name}: {count} rays, {len(times['packets'])} times each")
    for who, spent in times.items():
        median = statistics.median(spent)
        rate = f"{count / median / 1e6:5.2f} M rays/s"
        print(f"  {who:14} {1e6 * median:7.0f} us, {rate}, the simulator at {median / ours:.2f} of it")


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
    compare("2D LiDAR scan", LaserScanner(rig.lidar_2d, rays, seed=0), world, rays, places)
    compare("VLP-16 turn", SpinningLidar(rig.lidar_3d, rays, seed=0), world, rays, places[:50])


if __name__ == "__main__":
    main()
