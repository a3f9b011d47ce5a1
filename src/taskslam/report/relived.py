"""A finished run with its world, so that it can be looked at again from above and through the robot's own eye."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from taskslam.benchmark.spec import Drive
from taskslam.benchmark.stage import load_scenario_world
from taskslam.benchmark.verify import spec_of
from taskslam.errors import InputError
from taskslam.geometry import OPTICAL_IN_BODY, SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.observer import Observer
from taskslam.reading import is_there
from taskslam.record import RoundStarted, RunRecord
from taskslam.record.run_directory import SPEC
from taskslam.report.poses_over_time import poses_at
from taskslam.robot import Robot
from taskslam.scenario import Scenario
from taskslam.simulation.rendering.scene import Scene
from taskslam.simulation.sensors.camera import pinhole_of
from taskslam.simulation.sensors.exposure import exposure_of
from taskslam.world import World
from taskslam.world.digest import world_digest

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Relived:
    """A run in simulation, the world that it was driven in, and the robot that drove."""

    record: RunRecord
    world: World
    robot: Robot


def relive(record: RunRecord, world_paths: Sequence[Path], observer: Observer) -> Relived:
    """Load the world of a run as the run did, found in these folders where its scenario names a file.

    Raises InputError: it was not driven in our simulator, or the world found here has another content; WorldError.
    """
    manifest = record.manifest
    try:
        scenario = Scenario.model_validate(manifest.scenario)
        robot = Robot.model_validate(manifest.robot)
    except ValidationError as error:
        raise InputError(
            f"{record.directory}: not a run in the simulator, which would name its world and its robot; only such a run"
            " can be looked at again"
        ) from error
    observer.stage("loading the world")
    world = load_scenario_world(scenario, world_paths)
    wanted = _world_of(record)
    if wanted and (found := world_digest(world)) != wanted:
        raise InputError(
            f"{record.directory}: the world found here is not the one of the run: content {found[:12]}, expected"
            f" {wanted[:12]}"
        )
    return Relived(record, world, robot)


def _world_of(record: RunRecord) -> str:
    """The digest of the world that the run's spec names; empty for a run that kept no spec."""
    if not is_there(record.directory / SPEC):
        return ""
    spec = spec_of(record.directory, record.manifest)
    return spec.task.world if isinstance(spec.task, Drive) else ""


def chosen_round(record: RunRecord, which: str) -> RoundStarted:
    """A round that began, by `priming` or its number from 1 among those that count. Raises InputError."""
    counted = [start for start in record.rounds() if not start.priming]
    priming = [start for start in record.rounds() if start.priming]
    if which == "priming" and priming:
        return priming[0]
    if which.isdecimal() and 1 <= int(which) <= len(counted):
        return counted[int(which) - 1]
    has = f"1 to {len(counted)}" if counted else "none that counts"
    raise InputError(
        f"{record.directory}: --round '{which:.20}'; expected one of its rounds, {has}{' or priming' * bool(priming)}"
    )


def instants(record: RunRecord, start: RoundStarted, step_s: float) -> npt.NDArray[np.int64]:
    """(N,) stamps, ns, so far apart, from the first to the last true pose of a round. Raises InputError without any."""
    truth = record.trajectory(start.round, "truth")
    if len(truth) < 2:
        raise InputError(
            f"{record.directory}: no true trajectory of this round; expected a run that recorded where the robot was"
        )
    count = int((truth.stamps[-1] - truth.stamps[0]) / NANOSECONDS / step_s) + 1
    stamps: npt.NDArray[np.int64] = truth.stamps[0] + (np.arange(count) * step_s * NANOSECONDS).astype(np.int64)
    return stamps


def poses_of(record: RunRecord, start: RoundStarted, stamps: npt.NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """(N, 3) true and (N, 3) estimated poses in `map` at these stamps, NaN where unknown."""
    truth, estimate = (poses_at(record.trajectory(start.round, name), stamps) for name in ("truth", "estimate"))
    return truth, estimate


class Eye:
    """The robot's own camera: left of its stereo pair, as the simulator renders it, without read noise.

    size: width and height of a picture, px.
    """

    def __init__(self, relived: Relived) -> None:
        """Light the scene. Raises InputError if the robot has no stereo camera."""
        camera = relived.robot.rig.stereo
        if camera is None:
            raise InputError(f"{relived.record.directory}: the robot has no stereo camera to look through")
        self._scene = Scene(relived.world, camera.color)
        self._pinhole = pinhole_of(camera)
        self._T_base_camera = camera.mount.matrix() @ OPTICAL_IN_BODY
        self._exposure = exposure_of(camera)
        self.size = (camera.width, camera.height)

    def picture(self, pose: SE2) -> Picture:
        """(H, W, 3) sRGB of what it sees from a true pose; its exposure follows the pictures asked for before."""
        root = self._scene.view(pose.matrix() @ self._T_base_camera, self._pinhole).radiance_root
        grey = np.clip(root * (255.0 * self._exposure.gain(root)), 0, 255).astype(np.uint8)
        return grey if grey.ndim == 3 else np.repeat(grey[..., None], 3, axis=2)
