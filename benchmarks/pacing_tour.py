"""Whether a closed-loop tour under ORB-SLAM3 depends on how fast the simulator renders (design D3).

    python benchmarks/pacing_tour.py [--goals 6] [--repeats 3] [--delays 0 0.1] [--robot turtlebot2_vga15]

The built-in house is toured with so many seconds of extra rendering per stereo pair. ORB-SLAM3 is not deterministic,
and in a closed loop a different pose makes a different drive, so single runs differ, by a factor of four; what must not
differ beyond that is how well the method localises and how well the robot arrives. Fast and slow tours take turns, so
that the load of the machine falls on both alike; a permutation test tells whether they differ, and an interval
(Welch's t) how much they may. Three tours each take a quarter of an hour and tell little, `--repeats 9` tells 1.5 cm.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import permutation_test, ttest_ind

from common import machine_line
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage, set_stage
from taskslam.measurements import StereoImages
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.record import Arrival, RoundEnded, load_run
from taskslam.scenario import load_scenario
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.camera import StereoCameraSensor


@dataclass
class Tour:
    """One run: goals reached, mean distance of arrivals from goals and of poses at arrivals from the truth (m)."""

    reached: int
    accuracy: float
    estimation: float
    dropped: int
    wall: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goals", type=int, default=6)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--delays", type=float, nargs="+", default=[0.0, 0.1])
    parser.add_argument("--robot", default="turtlebot2_vga15", help="a preset or a robot file")
    asked = parser.parse_args()
    common = ["protocol.rounds=1", f"robot={asked.robot}"]
    scenario = load_scenario("house", common)
    rows = [waypoint.pose.array().tolist() for waypoint in scenario.sequence.goals[: asked.goals]]
    scenario = load_scenario("house", [*common, f"sequence={{waypoints: {rows}}}"])
    stage = set_stage(scenario, [], Observer())
    print(machine_line())
    print(f"house, {asked.robot}, {asked.goals} goals, {asked.repeats} tours each, in turns")
    tours: dict[float, list[Tour]] = {delay: [] for delay in asked.delays}
    for _ in range(asked.repeats):
        for delay in asked.delays:
            tours[delay].append(tour := drive(stage, delay))
            print(
                f"  {1e3 * delay:4.0f} ms more per pair: {tour.wall:4.0f} s wall, {tour.reached} goals, arrived"
                f" {100 * tour.accuracy:.1f} cm from them with poses {100 * tour.estimation:.1f} cm from the truth,"
                f" {tour.dropped} frames dropped",
                flush=True,
            )
    for delay, own in tours.items():
        accuracy, estimation = np.array([[tour.accuracy, tour.estimation] for tour in own]).T * 100
        print(
            f"{1e3 * delay:4.0f} ms more per pair: {np.mean([tour.wall for tour in own]):.0f} s wall,"
            f" all goals reached in {sum(tour.reached == asked.goals for tour in own)} of {len(own)} tours;"
            f" arrivals {words(accuracy)} cm from the goals, poses {words(estimation)} cm from the truth"
        )
    first, last = (tours[delay] for delay in (min(tours), max(tours)))
    for what in ("accuracy", "estimation"):
        a, b = ([getattr(tour, what) for tour in own] for own in (first, last))
        test = permutation_test((a, b), lambda x, y: np.mean(x) - np.mean(y), rng=np.random.default_rng(0))
        interval = ttest_ind(a, b, equal_var=False).confidence_interval()
        print(
            f"{what}, fast less slow: {100 * test.statistic:+.1f} cm,"
            f" 95 % interval [{100 * interval.low:+.1f}, {100 * interval.high:+.1f}], p = {test.pvalue:.2f}"
        )


def words(values: np.ndarray) -> str:
    """Mean and standard deviation."""
    return f"{values.mean():.1f} ± {values.std(ddof=1):.1f}"


def drive(stage: Stage, delay: float) -> Tour:
    """One tour with a camera that takes `delay` seconds longer."""
    quick = StereoCameraSensor.measure

    def slow(camera: StereoCameraSensor, stamp: int, motion: Motion) -> StereoImages:
        time.sleep(delay)
        return quick(camera, stamp, motion)

    StereoCameraSensor.measure = slow  # type: ignore[method-assign, assignment]
    try:
        with tempfile.TemporaryDirectory() as folder:
            began = time.perf_counter()
            directory, _ = run(stage, stage.spec("orb_slam3", Mode.WITHOUT_MAP), Path(folder))
            wall = time.perf_counter() - began
            record = load_run(directory)
    finally:
        StereoCameraSensor.measure = quick  # type: ignore[method-assign]
    arrivals = [event for event in record.events if isinstance(event, Arrival)]
    accuracy = [a.truth.distance_to(a.target) for a in arrivals if a.truth]
    estimation = [a.truth.distance_to(a.estimate) for a in arrivals if a.truth and a.estimate]
    dropped = sum(event.dropped_frames for event in record.events if isinstance(event, RoundEnded))
    return Tour(len(arrivals), float(np.mean(accuracy)), float(np.mean(estimation)), dropped, wall)


if __name__ == "__main__":
    main()
