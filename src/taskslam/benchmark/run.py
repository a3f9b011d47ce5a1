"""One run = (scenario, method, mode, seed): set up, drive the tour, leave a run directory that is whole or absent."""

from __future__ import annotations

import hashlib
import json
import os
import platform as host_platform
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from taskslam import __version__
from taskslam.benchmark.platform import Platform
from taskslam.benchmark.protocol import Tour, drive_tour
from taskslam.benchmark.stage import Stage
from taskslam.errors import HostFailedError, RecordError, ScenarioError, SimulatorFailedError, TaskSlamError
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.navigation.navigator import Navigator
from taskslam.navigation.planners import build_planner, planner_version
from taskslam.navigation.settings import GoalSettings, NavigationSettings
from taskslam.observer import Observer
from taskslam.processes.memory import own_peak_memory
from taskslam.record.manifest import Manifest
from taskslam.record.run_directory import RunWriter, load_run
from taskslam.robot import Robot, robot_presets
from taskslam.scenario import Scenario
from taskslam.simulation.simulator import DEFAULT_SENSORS, Simulator
from taskslam.slam.guest.host import Limits, MethodHost
from taskslam.slam.guest.latency import LatencyMode, LatencyModel
from taskslam.slam.registry import load_method
from taskslam.task import BUILTIN_PLANNER, Mode
from taskslam.world.map_server import save_floor_plan

_RETRIES = 2  # infrastructure failures are retried and never counted against a method (design D6)


@dataclass(frozen=True)
class RunRequest:
    """What to run. options: the method's own; latency: how its estimates are delayed."""

    method: str
    mode: Mode
    seed: int = 0
    options: Mapping[str, Any] = field(default_factory=dict)
    latency: LatencyModel = field(default_factory=LatencyModel)
    limits: Limits = field(default_factory=Limits)


def run_directory(out: Path, scenario: str, request: RunRequest) -> Path:
    """Where a run's results stand: OUT/scenario/method/mode/seedN."""
    method = request.method.replace(":", "_").replace("/", "_")
    return out / scenario / method / request.mode / f"seed{request.seed}"


def run(
    stage: Stage, request: RunRequest, out: Path, observer: Observer | None = None, overwrite: bool = False
) -> tuple[Path, bool]:
    """Drive one run; its directory, and whether every goal of every round was reached.

    A finished run of the very same configuration is kept and not driven again.

    Raises:
        UnknownMethodError, MethodUnavailableError, InputError: before anything is driven.
        InfrastructureError: after retries; what was measured stays in the partial folder that the message names.
    """
    observer = observer or Observer()
    load_method(request.method)
    directory = run_directory(out, stage.scenario.name, request)
    if not overwrite and (finished := finished_tour(stage.scenario, stage.robot, request, directory)) is not None:
        observer.notice(f"{directory}: finished before, kept (--overwrite drives it again)")
        return directory, finished.complete
    for attempt in range(_RETRIES + 1):
        try:
            return directory, _attempt(stage, request, directory, observer, overwrite)
        except (HostFailedError, SimulatorFailedError) as failure:
            if attempt == _RETRIES:
                raise
            observer.notice(f"infrastructure failed, trying again: {failure}")
    raise AssertionError("unreachable: the last attempt returns or raises")


def finished_tour(scenario: Scenario, robot: Robot, request: RunRequest, directory: Path) -> Manifest | None:
    """As `finished_run`, of a tour in simulation."""
    rounds = scenario.protocol.rounds
    return finished_run(directory, _hash(scenario, robot), rounds, request.options, request.latency)


def finished_run(
    directory: Path, content_hash: str, rounds: int, options: Mapping[str, object], latency: LatencyModel
) -> Manifest | None:
    """What the finished run at `directory` was, None if there is none.

    Raises:
        RecordError: it is a run of another configuration than the one asked for, or cannot be read.
    """
    if not (directory / "run.json").exists():
        return None
    manifest = load_run(directory).manifest
    asked = (content_hash, rounds, dict(options), latency_words(latency))
    if (manifest.scenario_hash, manifest.rounds, manifest.method_options, manifest.latency) != asked:
        raise RecordError(
            f"{directory}: a finished run of another configuration stands there; choose another --out, or --overwrite"
        )
    return manifest


def _hash(scenario: Scenario, robot: Robot) -> str:
    """Of everything that is held fixed. A robot that ships with the package counts by its name."""
    content = scenario.model_dump(mode="json")
    if content["planner"] == BUILTIN_PLANNER:  # scenarios hash as before there was a choice
        del content["planner"]
    if scenario.robot not in robot_presets():
        content["robot"] = robot.model_dump(mode="json")
    canonical = json.dumps(content, sort_keys=True)
    return hashlib.sha256(canonical.encode()).hexdigest()


def latency_words(model: LatencyModel) -> str:
    """As run.json says it: fixed, zero, or `measured x 4`."""
    return f"measured x {model.cpu_scale:g}" if model.mode is LatencyMode.MEASURED else model.mode.value


def _attempt(stage: Stage, request: RunRequest, directory: Path, observer: Observer, overwrite: bool) -> bool:
    def simulator() -> Simulator:
        observer.stage("building the simulator")
        return build_simulator(stage, request)

    return record_tour(stage, request, simulator, directory, observer, overwrite)


def record_tour(
    stage: Stage,
    request: RunRequest,
    make_platform: Callable[[], Platform],
    directory: Path,
    observer: Observer,
    overwrite: bool = False,
    drive: Callable[[Tour, Mode], bool] = drive_tour,
) -> bool:
    """Drive the tour on a platform and leave a finished run at `directory`; whether every goal was reached.

    make_platform: called once, within the run's wall time. drive: what drives the rounds.
    """
    started, wall = datetime.now(UTC), time.perf_counter()
    platform = make_platform()
    planner = build_planner(stage.scenario.planner, stage.robot)
    navigator = Navigator(stage.plan, stage.robot, navigation_settings(stage.scenario), planner)
    with RunWriter(directory, replace=overwrite) as record:
        save_floor_plan(stage.plan, record.folder / "plan.yaml", image="png")

        def new_method() -> MethodHost:
            log = record.method_log
            return MethodHost(
                request.method, {**request.options}, stage.robot.rig, log, request.latency, request.limits
            )

        tour = Tour(stage.scenario, platform, navigator, new_method, record, observer)
        complete = drive(tour, request.mode)
        wall_s = time.perf_counter() - wall
        record.finish(manifest_of(stage, request, tour, complete, platform.now, wall_s, started.isoformat()))
    return complete


def navigation_settings(scenario: Scenario) -> NavigationSettings:
    """The one fixed configuration; a scenario may only say how long a goal may take."""
    seconds = scenario.protocol.goal_timeout
    if seconds is None:
        return NavigationSettings()
    return NavigationSettings(goal=GoalSettings(timeout_base=seconds, timeout_factor=0.0))


def build_simulator(stage: Stage, request: RunRequest, also: Collection[Sensor] = ()) -> Simulator:
    """The simulator of a run, with the sensors that navigation and the method listen to, and those of `also`.

    Raises ScenarioError if the robot cannot stand at the start, SimulatorFailedError if it cannot be built.
    """
    sensors = DEFAULT_SENSORS | set(load_method(request.method).card.sensors) | set(also)
    try:
        simulator = Simulator(stage.world, stage.robot, request.seed, stage.scenario.world.lidar_geometry, sensors)
    except TaskSlamError:
        raise
    except Exception as error:
        raise SimulatorFailedError(f"the simulator could not be built: {type(error).__name__}: {error}") from error
    start = stage.scenario.start.pose
    if simulator.touches(start):
        raise ScenarioError(
            f"scenario {stage.scenario.name}: at the start ({start.x:g}, {start.y:g}) the robot touches the world's"
            " collision geometry; expected free floor"
        )
    return simulator


def manifest_of(
    stage: Stage, request: RunRequest, tour: Tour, complete: bool, now: int, wall_s: float, started: str
) -> Manifest:
    """What goes into run.json. now: ns of simulated time at the end."""
    scenario = stage.scenario.model_dump(mode="json")
    card = asdict(load_method(request.method).card)
    return Manifest(
        scenario_name=stage.scenario.name,
        scenario=scenario,
        scenario_hash=_hash(stage.scenario, stage.robot),
        robot=stage.robot.model_dump(mode="json"),
        method=request.method,
        method_card=json.loads(json.dumps(card, default=str)),
        method_options=dict(request.options),
        mode=request.mode,
        seed=request.seed,
        rounds=stage.scenario.protocol.rounds,
        latency=latency_words(request.latency),
        versions=versions() | planner_version(stage.scenario.planner),
        machine=machine(),
        simulated_s=now / NANOSECONDS,
        wall_s=wall_s,
        started_utc=started,
        complete=complete,
        failure=tour.last_failure,
        compute_s=tour.compute_s,
        method_peak_bytes=tour.method_peak_bytes or None,
        own_peak_bytes=own_peak_memory(),
    )


def versions() -> dict[str, str]:
    """Versions of this package and of what its numbers rest on."""
    found = {"taskslam": __version__, "python": host_platform.python_version()}
    for name in ("numpy", "scipy", "numba", "embreex", "gtsam", "trimesh"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "absent"
    return found


def machine() -> dict[str, str]:
    """What the run was made on; enough to read a wall time, nothing that names a person."""
    return {"system": host_platform.system(), "processor": _processor(), "cores": str(os.cpu_count())}


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return host_platform.processor() or host_platform.machine()
