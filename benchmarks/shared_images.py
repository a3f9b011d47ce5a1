"""What it costs to hand a stereo pair to a method: through shared memory, and through the pipe.

    python benchmarks/shared_images.py [--pairs 300]

For a 752x480 grey pair: the host's time to hand it over, and the round trip until the method has answered without
having looked at it. Medians.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from common import machine_line
from taskslam.measurements import Measurement, Sensor, StereoImages
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.guest import host as host_module
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel


class Blind(SlamMethod):
    """Answers every pair without looking at it."""

    card = MethodCard("blind", "1", "Apache-2.0", Kind.ODOMETRY, (Sensor.STEREO_IMAGES,))

    def start(self, rig: SensorRig) -> None:
        """Nothing to prepare."""

    def feed(self, measurement: Measurement) -> PoseEstimate:
        """The origin."""
        return PoseEstimate(measurement.stamp, np.eye(4), Status.TRACKING)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=300)
    pairs = parser.parse_args().pairs
    rig = load_robot("turtlebot2").rig
    assert rig.stereo is not None
    size = (rig.stereo.height, rig.stereo.width)
    print(machine_line())
    print(f"a pair of {size[1]}x{size[0]}")
    slots = host_module._image_slots
    for way, make in (("shared memory", slots), ("pipe", lambda _: None)):
        host_module._image_slots = make
        handed, answered = times(rig, size, pairs)
        print(
            f"{way:14} {handed:7.0f} µs to hand over, {answered:7.0f} µs until answered, a pair of {size[1]}x{size[0]}"
        )
    host_module._image_slots = slots


def times(rig: SensorRig, size: tuple[int, int], pairs: int) -> tuple[float, float]:
    """Median microseconds of `feed`, and of `feed` and `collect`."""
    left, right = (np.random.default_rng(eye).integers(0, 256, size, dtype=np.uint8) for eye in (0, 1))
    handed, answered = [], []
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "method.log"
        with MethodHost("shared_images:Blind", {}, rig, log, LatencyModel(LatencyMode.ZERO)) as host:
            for n in range(pairs):
                began = time.perf_counter()
                host.feed(StereoImages(n * 33_333_333, left, right))
                handed.append(time.perf_counter() - began)
                host.collect(n * 33_333_333)
                answered.append(time.perf_counter() - began)
    return 1e6 * float(np.median(handed)), 1e6 * float(np.median(answered))


if __name__ == "__main__":
    main()
