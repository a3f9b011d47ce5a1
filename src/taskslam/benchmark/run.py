"""One run, as its spec says: set up, drive the tour, leave a run directory that is whole or absent."""

from __future__ import annotations

import json
import os
import platform as host_platform
import time
from collections.abc import Callable, Collection
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from datetime import datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from taskslam.benchmark.loop import ClosedLoop
from taskslam.benchmark.platform import Platform
from taskslam.benchmark.protocol import Tour, drive_tour
from taskslam.benchmark.sealing import salt_of, salted, seal_file, told_apart
from taskslam.benchmark.simulated_platform import SimulatedPlatform
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.benchmark.stage import Stage, source_of
from taskslam.benchmark.traveller import Traveller
from taskslam.errors import HostFailedError, RecordError, ScenarioError, SimulatorFailedError, TaskSlamError
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.navigation.navigator import Navigator
from taskslam.navigation.planners import build_planner, planner_version
from taskslam.navigation.settings import GoalSettings, NavigationSettings
from taskslam.observer import Observer
from taskslam.processes.memory import own_peak_memory
from taskslam.record.manifest import Manifest
from taskslam.record.place import settle, settle_locked
from taskslam.record.run_directory import MANIFEST, RunWriter, load_manifest
from taskslam.scenario import Scenario
from taskslam.sensors import fitted
from taskslam.simulation.simulator import DEFAULT_SENSORS, Simulator
from taskslam.slam.base import MethodCard
from taskslam.slam.cards import card_of
from taskslam.slam.guest.host import Limits, MethodHost
from taskslam.slam.guest.latency import LatencyMode
from taskslam.slam.registry import find_method
from taskslam.task import GoalTolerance, Mode
from taskslam.version import __version__
from taskslam.world.map_server import save_floor_plan

_RETRIES = 2  # infrastructure failures are retried and never counted against a method (design D6)


@dataclass(frozen=True)
class Driver:
    """Who drives in place of our loop with a method.

    card: what the record says of it. traveller: makes a fresh one for every lifetime.
    """

    card: MethodCard
    traveller: Callable[[Platform, RunWriter], Traveller]


@dataclass(frozen=True)
class Undertaking:
    """A run that is about to be driven.

    card: what the method was described with. closed: folders of results, which the method cannot read. salt: of a
    sealed run. take_over, driver: as of `run`.
    """

    stage: Stage
    spec: RunSpec
    card: MethodCard
    limits: Limits = field(default_factory=Limits)
    closed: tuple[Path, ...] = ()
    salt: str | None = None
    take_over: bool = False
    driver: Driver | None = None

    def host(self, log: Path, proven: bool) -> MethodHost:
        """A fresh host of the method. proven: whether it has started well before in this run."""
        spec, rig = self.spec, self.stage.robot.rig
        return MethodHost(
            spec.method, spec.options, rig, log, spec.latency, self.limits, self.card, self.closed, proven
        )


def run(
    stage: Stage,
    spec: RunSpec,
    out: Path,
    observer: Observer | None = None,
    overwrite: bool = False,
    limits: Limits | None = None,
    salt: str | None = None,
    take_over: bool = False,
    platform: Callable[[MethodCard], Platform] | None = None,
    driver: Driver | None = None,
) -> tuple[Path, bool]:
    """Drive one run on its stage; its directory, and whether every goal of every round was reached.

    A finished run of the very same spec is kept and not driven again; without a map, so are the rounds that had ended
    when one was interrupted. salt: of the sealed run that this one repeats; by default it is made with the secret that
    rests in `out` (`sealing.py`). take_over: go on with this run even if another process seems to be at it, since
    whoever asks knows that it is to be replaced (`record/run_directory.py`).
    platform: makes the robot for a method with such a card; by default the simulator. driver: who drives in place of
    our loop; the spec's method is then only its name.

    Raises:
        UnknownMethodError, MethodUnavailableError, InputError: before anything is driven.
        RecordError: a run of another spec stands there.
        InfrastructureError: after retries; what was measured stays in the partial folder that the message names, and
            is gone on with by the next start.
    """
    observer = observer or Observer()
    card = driver.card if driver else card_of(spec.method)
    directory = run_folder(out, spec)
    (settle_locked if take_over else settle)(directory)
    if not overwrite and (finished := finished_run(directory, spec, salt)) is not None:
        if (
            driver is None
            and find_method(spec.method).file is not None
            and finished.method_card.get("version") != card.version
        ):
            raise RecordError(
                f"{directory}: a finished run of another content of {spec.method} stands there; choose another --out,"
                " or --overwrite"
            )
        observer.notice(f"{directory}: finished before, kept (--overwrite drives it again)")
        return directory, finished.complete
    if driver is None and card.latency is None and spec.latency.mode is LatencyMode.FIXED:
        observer.notice(
            f"{spec.method}: its card names no latency, so every estimate arrives the moment its frame is taken;"
            f" 'taskslam methods check {spec.method}' measures one, '--latency measured' goes by each frame"
        )
    if spec.sealed and salt is None:
        salt = salt_of(out, spec.digest)
    undertaking = Undertaking(stage, spec, card, limits or Limits(), (out, seal_file(out)), salt, take_over, driver)
    for attempt in range(_RETRIES + 1):
        try:
            return directory, _attempt(undertaking, directory, observer, overwrite, platform)
        except (HostFailedError, SimulatorFailedError) as failure:
            if attempt == _RETRIES:
                raise
            observer.notice(f"infrastructure failed, trying again: {failure}")
    raise AssertionError("unreachable: the last attempt returns or raises")


def finished_run(directory: Path, spec: RunSpec, salt: str | None = None) -> Manifest | None:
    """What the finished run at `directory` was, None if there is none.

    Raises:
        RecordError: it is a run of another spec, or of this one as another version drove it, or it was sealed with
            another salt than is to be repeated, or cannot be read.
    """
    if not (directory / MANIFEST).exists():
        return None
    manifest = load_manifest(directory)
    if manifest.behaviour != spec.behaviour:
        driven = "an earlier version" if manifest.behaviour is None else f"behaviour version {manifest.behaviour}"
        raise RecordError(
            f"{directory}: a run that {driven} of taskslam drove stands there, and this is behaviour version"
            f" {spec.behaviour}: the two are never mixed; choose another --out, or --overwrite"
        )
    if manifest.spec_hash != spec.digest:
        raise RecordError(
            f"{directory}: a finished run of another configuration stands there; choose another --out, or --overwrite"
        )
    if salt is not None and manifest.salt != salt:
        raise RecordError(
            f"{directory}: a finished run of another salt stands there; choose another --out, or --overwrite"
        )
    return manifest


def _attempt(
    undertaking: Undertaking,
    directory: Path,
    observer: Observer,
    overwrite: bool,
    robot: Callable[[MethodCard], Platform] | None,
) -> bool:
    stage, spec, salt = undertaking.stage, undertaking.spec, undertaking.salt
    if robot is not None:
        return record_tour(undertaking, robot(undertaking.card), directory, observer, overwrite)
    sensors = undertaking.card.hears(fitted(stage.robot.rig))
    platform = SimulatedPlatform(lambda: build_simulator(stage, spec.seed, sensors, salt))
    return record_tour(undertaking, platform, directory, observer, overwrite)


def record_tour(
    undertaking: Undertaking,
    platform: Platform,
    directory: Path,
    observer: Observer,
    overwrite: bool = False,
    drive: Callable[[Tour, Mode], bool] = drive_tour,
) -> bool:
    """Drive the tour on a platform and leave a finished run at `directory`; whether every goal was reached.

    platform: opened and closed here, beside the method's process, which starts meanwhile. drive: what drives the
    rounds.
    """
    stage, spec = undertaking.stage, undertaking.spec
    wall = time.perf_counter()
    resumes, dice, take_over = _resumes(platform, spec), told_apart(undertaking.salt), undertaking.take_over
    with RunWriter(directory, overwrite, spec.to_json(), resumes, dice, take_over) as record, ExitStack() as cast:
        if record.notice:
            observer.notice(record.notice)
        done = record.resumed
        new_traveller = _travellers(undertaking, platform, record, observer, cast)
        observer.stage("opening the platform")
        cast.enter_context(platform)
        if done.rounds:
            platform.go_on(done.now, done.rounds, datetime.fromisoformat(record.began_utc))
        record.began_utc = platform.zero_utc.isoformat()
        save_floor_plan(stage.plan, record.folder / "plan.yaml", image="png")

        tour = Tour(stage.scenario, platform, new_traveller, record, observer)
        complete = drive(tour, spec.mode)
        record.finish(manifest_of(undertaking, tour, complete, done.wall_s + time.perf_counter() - wall))
    return complete


def _travellers(
    undertaking: Undertaking, platform: Platform, record: RunWriter, observer: Observer, cast: ExitStack
) -> Callable[[], Traveller]:
    """Makes the traveller of a lifetime. The process of our first one's method starts at once."""
    stage, driver = undertaking.stage, undertaking.driver
    if driver is not None:
        return lambda: driver.traveller(platform, record)
    settings = navigation_settings(stage.scenario)
    navigator = Navigator(stage.plan, stage.robot, settings, build_planner(stage.scenario.planner, stage.robot))
    hosts: list[MethodHost] = []

    def new_host() -> MethodHost:
        proven = bool(record.resumed.rounds) or any(host.started for host in hosts)
        hosts.append(undertaking.host(record.method_log, proven))
        return hosts[-1]

    ready = [cast.enter_context(new_host().launched())]

    def traveller() -> ClosedLoop:
        method = ready.pop() if ready else new_host()
        return ClosedLoop(platform, method, navigator, record, stage.scenario.start.pose, observer)

    return traveller


def _resumes(platform: Platform, spec: RunSpec) -> bool:
    """Whether rounds that ended before an interruption stay: each is a trial of its own, and time can go on."""
    return platform.resumable and spec.mode is Mode.WITHOUT_MAP


def navigation_settings(scenario: Scenario) -> NavigationSettings:
    """The one fixed configuration; a scenario may only say how long a goal may take."""
    seconds = scenario.protocol.goal_timeout
    if seconds is None:
        return NavigationSettings()
    return NavigationSettings(goal=GoalSettings(timeout_base=seconds, timeout_factor=0.0))


def build_simulator(stage: Stage, seed: int, sensors: Collection[Sensor] = (), salt: str | None = None) -> Simulator:
    """The simulator of a run of that seed, with the sensors that navigation, the method and others listen to.

    salt: of a sealed run.

    Raises ScenarioError if the robot cannot stand at the start, SimulatorFailedError if it cannot be built.
    """
    source = source_of(stage.scenario)
    assert stage.world is not None
    try:
        heard, dice = DEFAULT_SENSORS | set(sensors), salted(seed, salt)
        simulator = Simulator(stage.world, stage.robot, dice, source.lidar_geometry, heard)
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


def manifest_of(undertaking: Undertaking, tour: Tour, complete: bool, wall_s: float) -> Manifest:
    """What goes into run.json."""
    stage, spec = undertaking.stage, undertaking.spec
    goal = navigation_settings(stage.scenario).goal
    return Manifest(
        **said_by(spec, undertaking.card),
        driven_by=tour.platform.driven_by,
        goal_tolerance=GoalTolerance(position_m=goal.xy_tolerance, heading_rad=goal.yaw_tolerance),
        scenario=stage.scenario.model_dump(mode="json"),
        robot=stage.robot.model_dump(mode="json"),
        versions=versions() | planner_version(stage.scenario.planner),
        machine=machine(),
        simulated_s=tour.platform.now / NANOSECONDS,
        wall_s=wall_s,
        started_utc=tour.platform.zero_utc.isoformat(),
        salt=undertaking.salt,
        complete=complete,
        failure=tour.last_failure,
        compute_s=tour.compute_s,
        method_peak_bytes=tour.method_peak_bytes or None,
        method_cpu_s=tour.method_cpu_s or None,
        stop_failures=tuple(tour.stop_failures),
        own_peak_bytes=own_peak_memory(),
    )


def said_by(spec: RunSpec, card: MethodCard) -> dict[str, Any]:
    """The fields of run.json that the spec alone decides, and the method's card."""
    return {
        "source": spec.task.source,
        "scenario_name": spec.task.name,
        "scenario_hash": spec.task_digest,
        "spec_hash": spec.digest,
        "behaviour": spec.behaviour,
        "method": spec.method,
        "method_card": json.loads(json.dumps(asdict(card), default=str)),
        "method_options": spec.options,
        "mode": spec.mode,
        "seed": spec.seed,
        "sealed": spec.sealed,
        "rounds": spec.task.rounds,
        "latency": spec.latency.words,
    }


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
