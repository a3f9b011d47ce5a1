"""Where a second of simulated time goes, on tours: shares by stage that add up to the whole, start-up apart.

    python benchmarks/tour_profile.py [--suites odometry 2d 3d stereo] [--goals 3] [--methods karto ...]

One core. A stage's time is its own: what it calls and has a name here is counted there. The other eye is drawn on a
thread of its own; on one core, waiting for it is its drawing. Looking at the clock costs about a microsecond a stage.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from common import machine_line, pin_to_one_core, small_house
from real_time_factor import SUITES
from stopwatch import Stopwatch
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.navigation.navigator import Navigator
from taskslam.observer import Observer
from taskslam.processes.guest import GuestProcess
from taskslam.record.run_directory import RunWriter
from taskslam.simulation.rendering import scene
from taskslam.simulation.sensors import camera
from taskslam.simulation.sensors.exposure import AutomaticExposure
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.simulation.simulator import Simulator
from taskslam.slam.guest.host import MethodHost

# What is timed, under which name. A simulator's `advance` is a generator: its steps are timed.
STAGES: tuple[tuple[Any, str, str], ...] = (
    (Simulator, "advance", "simulator"),
    (camera.StereoCameraSensor, "views", "the other eye"),
    (scene, "visible_blocks", "culling"),
    (scene, "rasterize", "rasterising"),
    (scene, "shade", "shading"),
    (AutomaticExposure, "gain", "exposure"),
    (camera, "develop", "noise and grey levels"),
    (RayCaster, "distances", "rays"),
    (RayCaster, "hits", "rays"),
    (MethodHost, "feed", "hand-over"),
    (MethodHost, "collect", "hand-over"),
    (GuestProcess, "exchange", "waiting for the method"),
    (Navigator, "sense", "navigation"),
    (Navigator, "step", "navigation"),
    (RunWriter, "pose", "record"),
    (RunWriter, "event", "record"),
)


class Lap(Observer):
    """Begins at the first beat of the loop, ends with the last: what comes before and after is not the tour."""

    def __init__(self, watch: Stopwatch) -> None:
        self._watch = watch
        self.began, self.last, self.spent = -1, -1, dict[str, float]()

    def ticked(self, now: int) -> None:
        """A beat of the loop is over."""
        if self.began < 0:
            self.began = now
            self._watch.restart()
        self.last, self.spent = now, dict(self._watch.spent)


def profile(stage: Stage, method: str, folder: Path) -> None:
    """Drive once with the watch on, and print the table."""
    watch = Stopwatch("the loop")
    lap = Lap(watch)
    with watch.watching(STAGES):
        run(stage, stage.spec(method, Mode.WITHOUT_MAP), folder, lap, overwrite=True)
    seconds = (lap.last - lap.began) / NANOSECONDS
    whole = sum(lap.spent.values())
    what = "the loop alone" if ":" in method else method
    print(f"  {what}: {seconds:.0f} s simulated, {seconds / whole:.2f} x real time")
    for name, spent in sorted(lap.spent.items(), key=lambda item: -item[1]):
        print(f"    {name:24} {1e3 * spent / seconds:8.2f} ms a simulated second {100 * spent / whole:6.1f} %")
    print(f"    {'the whole':24} {1e3 * whole / seconds:8.2f} ms", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goals", type=int, default=3, help="how many goals of the tour")
    parser.add_argument("--suites", nargs="+", choices=SUITES, default=list(SUITES))
    parser.add_argument("--methods", nargs="+", metavar="NAME", help="these methods, instead of suites")
    asked = parser.parse_args()
    suites = {"": ("methods", tuple(asked.methods))} if asked.methods else {name: SUITES[name] for name in asked.suites}
    name, stage = small_house(asked.goals)
    with tempfile.TemporaryDirectory() as folder:
        run(stage, stage.spec("karto", Mode.WITHOUT_MAP, seed=99), Path(folder))  # compiles and fills caches
        pin_to_one_core()
        print(machine_line())
        print(f"{name}, {asked.goals} goals, one core")
        for title, methods in suites.values():
            print(f"{title}:")
            for method in methods:
                profile(stage, method, Path(folder))


if __name__ == "__main__":
    main()
