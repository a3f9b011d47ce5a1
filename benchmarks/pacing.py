"""Whether ORB-SLAM3's result depends on how fast the simulator runs: the same images, handed over fast and slowly.

    python benchmarks/pacing.py [--seconds 10] [--repeats 3] [--delays 0 0.1 0.3]

A drive through the built-in house is rendered once and kept. Then it is replayed with so many seconds of simulator
between two frames, with pacing (design D3) and without. ORB-SLAM3 maps and closes loops in threads of its own: without
pacing they get more of the machine the slower the simulator is, and less the faster it is. Shown are the CPU time of
the method's whole process per frame and the error of the live poses, the smallest and the largest of the repeats.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from common import machine_line
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Sensor, StereoImages
from taskslam.robot import Robot, load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.slam.base import PoseEstimate, Status
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel
from taskslam.slam.methods.orb_slam3 import OrbSlam3
from taskslam.world.loading import load_world

TICK = NANOSECONDS // 20


class Unpaced(OrbSlam3):
    """The same method, whose threads run whenever they like."""

    card = replace(OrbSlam3.card, name="unpaced", asynchronous=False)


@dataclass
class Replay:
    """One replay: whole process's CPU ms per frame, share of frames tracked, mean error in m, wall s."""

    cpu_ms: float
    tracked: float
    error: float
    wall: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--delays", type=float, nargs="+", default=[0.0, 0.1, 0.3])
    asked = parser.parse_args()
    robot = load_robot("turtlebot2")
    frames = drive(robot, asked.seconds)
    print(machine_line())
    print(f"{len(frames)} pairs in {asked.seconds:g} s of simulated time, {asked.repeats} replays each")
    for method in ("orb_slam3", "pacing:Unpaced"):
        for delay in asked.delays:
            replays = [replay(method, robot, frames, delay) for _ in range(asked.repeats)]
            print(
                f"{method:15} {1e3 * delay:4.0f} ms of simulator a frame ({span([r.wall for r in replays], 1)} s wall):"
                f" {span([r.cpu_ms for r in replays], 1)} CPU ms a frame,"
                f" {span([100 * r.tracked for r in replays], 0)} % tracked,"
                f" mean error {span([1e3 * r.error for r in replays], 1)} mm"
            )


def span(values: list[float], digits: int) -> str:
    """The smallest to the largest."""
    return f"{min(values):.{digits}f} to {max(values):.{digits}f}"


def drive(robot: Robot, seconds: float) -> list[tuple[StereoImages, SE2]]:
    """Pairs and true poses since the start: a second at rest, then down the corridor in curves."""
    simulator = Simulator(load_world("house"), robot, 0, sensors={Sensor.STEREO_IMAGES})
    frames: list[tuple[StereoImages, SE2]] = []
    for beat in range(round(seconds * 20)):
        curve = 0.3 if beat // 30 % 4 in (1, 2) else -0.3
        simulator.drive(*((0.0, 0.0) if beat < 20 else (0.3, curve)))
        frames += [
            (measurement, simulator.true_pose())
            for measurement in simulator.advance(simulator.now + TICK)
            if isinstance(measurement, StereoImages)
        ]
    return frames


def replay(method: str, robot: Robot, frames: list[tuple[StereoImages, SE2]], delay: float) -> Replay:
    truth = {pair.stamp: pose for pair, pose in frames}
    estimates: list[PoseEstimate] = []
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "method.log"
        with MethodHost(method, {}, robot.rig, log, LatencyModel(LatencyMode.ZERO)) as host:
            began, before = time.perf_counter(), cpu_seconds(host)
            for pair, _ in frames:
                time.sleep(delay)
                host.feed(pair)
                estimates += host.collect(pair.stamp)
            wall, cpu = time.perf_counter() - began, cpu_seconds(host) - before
    tracked = [e for e in estimates if e.status is Status.TRACKING]
    errors = [truth[e.stamp].distance_to(SE2.from_matrix(e.T_start_base)) for e in tracked]
    return Replay(1e3 * cpu / len(frames), len(tracked) / len(frames), float(np.mean(errors)), wall)


def cpu_seconds(host: MethodHost) -> float:
    """CPU time that the method's process has used so far, all threads."""
    assert host._guest is not None
    stat = Path(f"/proc/{host._guest.pid}/stat").read_text(encoding="ascii")
    user, system = stat.rpartition(") ")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
