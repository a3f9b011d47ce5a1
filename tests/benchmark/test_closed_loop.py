from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest

import taskslam.benchmark.run as run_module
from taskslam.benchmark.loop import ClosedLoop
from taskslam.benchmark.protocol import Tour, drive_tour
from taskslam.benchmark.run import run
from taskslam.benchmark.simulated_platform import SimulatedPlatform
from taskslam.benchmark.spec import BEHAVIOUR, RunSpec
from taskslam.benchmark.stage import Stage
from taskslam.errors import RecordError, SimulatorFailedError
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.geometry import SE2
from taskslam.measurements import Measurement
from taskslam.mode import Mode
from taskslam.navigation.navigator import Navigator
from taskslam.navigation.settings import GoalSettings, NavigationSettings
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.processes.tree import children_of
from taskslam.record import DrivenBy
from taskslam.record.events import Arrival, GoalFailed, GoalSkipped, MethodNotice, RoundEnded, RoundStarted, RunEnded
from taskslam.record.run_directory import SPEC, RunRecord, RunWriter, load_run
from taskslam.simulation.simulator import Simulator
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.guest.latency import LatencyModel
from taskslam.task import GoalTolerance


def drive(stage: Stage, out: Path, method: str, mode: Mode = Mode.WITHOUT_MAP, seed: int = 0) -> RunRecord:
    directory, _ = run(stage, stage.spec(method, mode, seed), out)
    return load_run(directory)


def of_kind(record: RunRecord, kind: type) -> list:  # type: ignore[type-arg]
    return [event for event in record.events if isinstance(event, kind)]


@pytest.fixture(autouse=True)
def _find_misbehaving_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))


def test_told_the_truth_the_robot_reaches_every_goal_of_every_round(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    record = drive(make_stage(), tmp_path, "ground_truth")
    arrivals = of_kind(record, Arrival)
    assert [(a.round, a.goal) for a in arrivals] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]
    for arrival in arrivals:
        assert arrival.truth.distance_to(arrival.target) < 0.22
        assert arrival.truth.distance_to(arrival.estimate) < 0.01
    assert [e.outcome for e in of_kind(record, RoundEnded)] == [Outcome.REACHED] * 2
    assert of_kind(record, RunEnded)[0].complete


def test_without_map_every_round_starts_anew_and_with_map_only_the_priming_one(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    stage = make_stage(rounds=2)
    without = drive(stage, tmp_path, "ground_truth", Mode.WITHOUT_MAP)
    with_map = drive(stage, tmp_path, "ground_truth", Mode.WITH_MAP)
    assert [(r.round, r.priming) for r in of_kind(without, RoundStarted)] == [(0, False), (1, False)]
    assert [(r.round, r.priming) for r in of_kind(with_map, RoundStarted)] == [(0, True), (1, False), (2, False)]
    start = SE2(-2.0, -1.0, 0.0)
    for number in (0, 1):
        first = SE2(*without.trajectory(number, "truth").poses[0])
        assert first.distance_to(start) < 0.01
    last_goal = SE2(-2.0, 1.0, 3.1)
    assert SE2(*with_map.trajectory(1, "truth").poses[0]).distance_to(last_goal) < 0.25


def test_the_same_seed_writes_the_same_journal_whatever_the_hash_seed_and_threads(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from taskslam.benchmark.run import run;"
        "from taskslam.mode import Mode; from taskslam.benchmark.stage import set_stage;"
        "from taskslam.observer import Observer; from taskslam.scenario import load_scenario;"
        "s = load_scenario('house', ['protocol.rounds=1', 'protocol.pause=0.5',"
        " 'sequence.path=[0, 0, 1]']);"
        "stage = set_stage(s, [], Observer());"
        "run(stage, stage.spec('karto', Mode.WITHOUT_MAP, int(sys.argv[2])), Path(sys.argv[1]))"
    )

    def journal(name: str, seed: int, hash_seed: str, threads: str) -> bytes:
        environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "NUMBA_NUM_THREADS": threads}
        environment |= {"OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
        command = [sys.executable, "-c", script, str(tmp_path / name), str(seed)]
        subprocess.run(command, check=True, env=environment, timeout=300)
        return next((tmp_path / name).rglob("journal.jsonl")).read_bytes()

    first = journal("first", 7, "0", "1")
    assert b"arrival" in first
    assert journal("second", 7, "123", "2") == first
    assert journal("third", 8, "0", "1") != first


class LyingPlatform(SimulatedPlatform):
    """Tells the record a truth that is wrong; nothing that steers may notice."""

    def true_pose(self) -> SE2:
        return SE2(100.0, -50.0, 1.0)


def test_nothing_that_steers_can_reach_the_truth(make_stage: Callable[..., Stage], tmp_path: Path) -> None:
    """With a false truth in the record, every estimate, command and arrival time stays the same, bit for bit."""
    stage = make_stage(rounds=1)

    def steer(kind: type[SimulatedPlatform], name: str) -> tuple[list[object], int]:
        platform = kind(lambda: Simulator(stage.world, stage.robot, seed=3))
        commands: list[object] = []
        original = platform.drive

        def drive_and_note(linear: float, angular: float) -> None:
            commands.append((platform.now, linear, angular))
            original(linear, angular)

        platform.drive = drive_and_note  # type: ignore[method-assign]
        with RunWriter(tmp_path / name) as record, platform:

            def traveller() -> ClosedLoop:
                method = MethodHost("karto", {}, stage.robot.rig, record.method_log, LatencyModel())
                navigator, start = Navigator(stage.plan, stage.robot), stage.scenario.start.pose
                return ClosedLoop(platform, method, navigator, record, start, Observer())

            tour = Tour(stage.scenario, platform, traveller, record, Observer())
            drive_tour(tour, Mode.WITHOUT_MAP)
            journal = (record.folder / "journal.jsonl").read_text()
        return commands, journal.count('"arrival"')

    honest_commands, arrivals = steer(SimulatedPlatform, "honest")
    lying_commands, _ = steer(LyingPlatform, "lying")
    assert arrivals == 3
    assert honest_commands == lying_commands


def test_a_method_that_is_not_a_reference_never_hears_a_true_pose(
    make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fed: list[Measurement] = []
    original = MethodHost.feed

    def note(self: MethodHost, measurement: Measurement) -> None:
        fed.append(measurement)
        original(self, measurement)

    monkeypatch.setattr(MethodHost, "feed", note)
    drive(make_stage(rounds=1), tmp_path, "wheel_odometry")
    assert {type(m).__name__ for m in fed} == {"WheelOdometry", "LaserScan"}


def test_peak_memory_is_in_the_manifest_and_not_in_the_journal(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    light, heavy = (drive(make_stage(GOALS_ONE, rounds=1), tmp_path, f"methods:{name}") for name in ("Honest", "Heavy"))
    assert light.manifest.method_peak_bytes is not None
    assert heavy.manifest.method_peak_bytes is not None
    assert 20 << 20 < light.manifest.method_peak_bytes < 1 << 30
    assert 200 << 20 < heavy.manifest.method_peak_bytes - light.manifest.method_peak_bytes < 300 << 20
    assert heavy.manifest.own_peak_bytes is not None
    assert heavy.manifest.own_peak_bytes > 50 << 20
    journals = [(record.directory / "journal.jsonl").read_bytes() for record in (light, heavy)]
    assert journals[0] == journals[1]
    assert run_metrics(heavy, "heavy").method_peak_bytes == heavy.manifest.method_peak_bytes


@pytest.mark.parametrize(
    ("name", "outcome", "says"),
    [
        ("Segfault", Outcome.CRASHED, "SIGSEGV"),
        ("NotANumber", Outcome.INVALID_OUTPUT, "NaN|finite"),
        ("BackInTime", Outcome.INVALID_OUTPUT, "back|before|order"),
    ],
)
def test_a_method_that_misbehaves_ends_its_round_and_nothing_else(
    name: str, outcome: Outcome, says: str, make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    record = drive(make_stage(), tmp_path, f"methods:{name}")
    failures = of_kind(record, GoalFailed)
    assert [f.outcome for f in failures] == [outcome] * 2
    assert [f.round for f in failures] == [0, 1]
    import re

    assert re.search(says, failures[0].detail)
    assert record.manifest.complete is False
    assert record.manifest.failure is not None


def test_earlier_arrivals_are_kept_when_a_method_dies(make_stage: Callable[..., Stage], tmp_path: Path) -> None:
    near = [[-1.5, -1.0, 0.0], [2.8, 1.8, 2.0]]
    record = drive(make_stage(near, rounds=1), tmp_path, "methods:Segfault", Mode.WITH_MAP)
    assert [(a.round, a.goal) for a in of_kind(record, Arrival)] == [(0, 0)]
    assert [(f.round, f.goal, f.outcome) for f in of_kind(record, GoalFailed)] == [(0, 1, Outcome.CRASHED)]


def test_a_goal_in_a_closed_place_fails_by_no_plan_and_the_rest_is_never_tried(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    inside_the_pillar = [[2.0, 1.0, 0.0], [-2.0, 1.0, 0.0]]
    record = drive(make_stage(inside_the_pillar, rounds=1), tmp_path, "ground_truth")
    assert of_kind(record, GoalFailed)[0].outcome in {Outcome.NO_PLAN, Outcome.NO_CONTROL}
    assert [(s.round, s.goal) for s in of_kind(record, GoalSkipped)] == [(0, 1)]
    skipping = drive(make_stage(inside_the_pillar, rounds=1, on_failure="skip"), tmp_path / "skip", "ground_truth")
    assert [a.goal for a in of_kind(skipping, Arrival)] == [1]


def test_being_lost_is_the_methods_failure_and_a_jump_is_noted(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    jumps = drive(make_stage(rounds=1), tmp_path, "methods:Jumps")
    assert any("jumped by 5.0" in notice.text for notice in of_kind(jumps, MethodNotice))
    assert of_kind(jumps, GoalFailed)[0].outcome.blames in {"navigation", "method"}


def test_after_a_failed_goal_the_robot_stands_until_it_is_sent_on(
    make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A goal that lasts 3 s fails at full speed; the next one starts from zero speed."""
    said: list[tuple[str, float]] = []
    for name in ("drive", "halt"):
        original = getattr(SimulatedPlatform, name)

        def note(
            self: SimulatedPlatform, *velocity: float, name: str = name, original: Callable[..., None] = original
        ) -> None:
            said.append((name, velocity[0] if velocity else 0.0))
            original(self, *velocity)

        monkeypatch.setattr(SimulatedPlatform, name, note)
    stage = make_stage([[2.5, -1.0, 0.0], [2.8, -1.0, 0.0]], rounds=1, on_failure="skip", goal_timeout=3.0)
    record = drive(stage, tmp_path, "ground_truth")
    assert next(failure.outcome for failure in of_kind(record, GoalFailed)) is Outcome.GOAL_TIMEOUT
    halted = said.index(("halt", 0.0))
    assert said[halted - 1][1] > 0.1
    sent_on = next(speed for name, speed in said[halted:] if name == "drive")
    fastest = stage.robot.drive.max_linear_acceleration / 20  # after one beat of the smoother
    assert abs(sent_on) <= fastest + 1e-9


def test_a_finished_run_is_kept_and_another_configuration_is_not_overwritten(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    stage = make_stage(GOALS_ONE, rounds=1)
    spec = stage.spec("ground_truth", Mode.WITHOUT_MAP)
    directory, complete = run(stage, spec, tmp_path)
    before = (directory / "run.json").read_bytes()
    assert run(stage, spec, tmp_path) == (directory, complete)
    assert (directory / "run.json").read_bytes() == before
    assert RunSpec.from_json((directory / SPEC).read_bytes()) == spec
    other = make_stage(GOALS_ONE, rounds=1, pause=1.0)
    with pytest.raises(RecordError, match="another configuration"):
        run(other, other.spec("ground_truth", Mode.WITHOUT_MAP), tmp_path)
    with pytest.raises(RecordError, match=f"this is behaviour version {BEHAVIOUR + 1}: the two are never mixed"):
        run(stage, spec.model_copy(update={"behaviour": BEHAVIOUR + 1}), tmp_path)
    run(other, other.spec("ground_truth", Mode.WITHOUT_MAP), tmp_path, overwrite=True)
    assert load_run(directory).manifest.scenario["protocol"]["pause"] == 1.0


def test_run_json_says_what_drove_when_and_to_which_tolerance(
    make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    goal = GoalSettings(xy_tolerance=0.11, yaw_tolerance=0.22)
    monkeypatch.setattr(run_module, "navigation_settings", lambda _: NavigationSettings(goal=goal))
    opened: list[datetime] = []

    def note(self: SimulatedPlatform, original: Callable[[SimulatedPlatform], None] = SimulatedPlatform.open) -> None:
        original(self)
        opened.append(self.zero_utc)

    monkeypatch.setattr(SimulatedPlatform, "open", note)
    manifest = drive(make_stage(GOALS_ONE, rounds=1), tmp_path, "ground_truth").manifest
    assert manifest.driven_by is DrivenBy.SIMULATOR
    assert manifest.goal_tolerance == GoalTolerance(position_m=0.11, heading_rad=0.22)
    assert [manifest.started_utc] == [moment.isoformat() for moment in opened]


def test_what_the_simulator_refuses_leaves_no_process_and_no_folder(
    make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The method is on its way when the simulator is built; three attempts, each with a process of its own."""
    launched: list[int] = []

    def refuse(*_: object) -> Simulator:
        launched.extend(children_of(os.getpid()))
        raise SimulatorFailedError("no memory for rays")

    monkeypatch.setattr(run_module, "build_simulator", refuse)
    stage = make_stage(GOALS_ONE, rounds=1)
    with pytest.raises(SimulatorFailedError, match="no memory for rays"):
        run(stage, stage.spec("wheel_odometry", Mode.WITHOUT_MAP), tmp_path / "out")
    assert len(launched) == len(set(launched)) == 3
    assert not children_of(os.getpid())
    assert not list((tmp_path / "out").rglob("*partial*"))


GOALS_ONE = [[-1.0, -1.0, 0.0]]
