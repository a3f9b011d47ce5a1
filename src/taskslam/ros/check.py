"""Trying a node file: start, handshake, ten frames that want answers; then, in words, what is missing and likely wrong.

It goes through the same host and behind the same wall as a run.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.processes.guest import Limits
from taskslam.processes.scratch import Scratch
from taskslam.reading import LARGEST_LOG, read_text
from taskslam.robot import SensorRig
from taskslam.ros.lockstep import Answers
from taskslam.ros.node_file import load_node
from taskslam.ros.notes import FINDING
from taskslam.sensors import fitted, sensor_kind
from taskslam.slam.cards import card_of
from taskslam.slam.conformance.drive import BY_FORMULA, ConformanceDrive, Look
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel

MakeLooks: TypeAlias = Callable[[SensorRig, Collection[Sensor]], Mapping[Sensor, Look]]

FRAMES = 10
_LONGEST_DRIVE_S = 60.0
_STILL_S = 0.2


@dataclass(frozen=True, slots=True)
class NodeCheck:
    """What the frames showed.

    frames: given; poses: answered; wall_ms: on the wall's clock for each frame; failure: how it ended, if it did;
    findings: a sentence for each thing that may be wrong, whether it answered or not.
    """

    frames: int
    poses: int
    wall_ms: tuple[float, ...]
    failure: str
    findings: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether it lived and answered."""
        return not self.failure and self.poses > 0


def check_node(reference: str, rig: SensorRig, make_looks: MakeLooks, limits: Limits | None = None) -> NodeCheck:
    """Try a node file, by its path or by the name of one that ships. make_looks: makes cameras' images.

    Raises InputError: it is no node file, does not fit the robot, or the node does not start and connect, in words.
    """
    node, method = load_node(reference), f"ros:{reference}"
    card = card_of(method)
    if missing := [sensor for sensor in card.sensors if sensor not in fitted(rig)]:
        raise InputError(f"{node.name} needs {', '.join(missing)}, which the robot has not")
    seen = [sensor for sensor in card.sensors if sensor not in BY_FORMULA]
    may_be_silent = math.ceil(node.silent_start * sensor_kind(node.awaited).part_of(rig).rate)
    wanted = may_be_silent + FRAMES
    still = max(_STILL_S, card.needs_still_start)
    drive = ConformanceDrive(rig, still, sensors=card.sensors, looks=make_looks(rig, seen) if seen else None)
    with Scratch("check") as scratch:
        log = scratch.folder / "method.log"
        host = MethodHost(method, {}, rig, log, LatencyModel(LatencyMode.ZERO), limits, described=card)
        wall_ms: list[float] = []
        poses, failure = 0, ""
        try:
            with host:
                for measurement in drive.measurements(0, round(_LONGEST_DRIVE_S * NANOSECONDS)):
                    began = time.perf_counter()
                    host.feed(measurement)
                    if measurement.sensor == node.awaited:
                        poses += len(host.collect(measurement.stamp))
                        wall_ms.append((time.perf_counter() - began) * 1e3)
                        if len(wall_ms) == wanted:
                            break
        except MethodFailedError as error:
            failure = str(error)
        findings = list(_findings(log))
    silent = len(wall_ms) - poses
    if not failure and node.answers is Answers.EVERY_FRAME and silent > may_be_silent:
        hint = "answers: sparse, or silent_start: for how many seconds at its start"
        findings.insert(0, f"{silent} frames had no answer; a node that may be silent says {hint}")
    return NodeCheck(len(wall_ms), poses, tuple(wall_ms), failure or host.stop_failure, tuple(findings))


def _findings(log: Path) -> list[str]:
    text = read_text(log, "method's log", InputError, LARGEST_LOG)
    return [line.removeprefix(FINDING) for line in text.splitlines() if line.startswith(FINDING)]
