"""What goes wrong on machines is named, tried again where that helps, and never counted against a method."""

from __future__ import annotations

import compileall
import errno
import fcntl
import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import taskslam
from benchmark.campaign.conftest import recorded
from taskslam import processes
from taskslam.benchmark.campaign.campaign_file import load_campaign
from taskslam.benchmark.campaign.notes import Keeping, notes
from taskslam.benchmark.campaign.planning import Plan, plan
from taskslam.benchmark.campaign.state import State, states_of
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines import supervised
from taskslam.benchmark.engines.allotment import Allotment
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.one_processor import check_processor
from taskslam.benchmark.resources import Resources, Share
from taskslam.benchmark.spec import run_folder
from taskslam.cli.app import app
from taskslam.errors import InputError, RecordError
from taskslam.outcomes import Outcome
from taskslam.record import RoundEnded, RoundStarted, RunWriter, load_run
from taskslam.record.run_lock import lock_file


@pytest.fixture
def planned(write_campaign: Callable[..., Path]) -> Plan:
    return plan(load_campaign(str(write_campaign("seeds: [0, 1]", rounds=2))))


def drive(planned: Plan, out: Path) -> list[Result]:
    return list(LocalEngine(1, planned.folders).run(planned.specs, out, Keeping(out, Watcher())))


def test_a_full_disk_is_named_and_the_next_start_drives_the_run(planned: Plan, tmp_path: Path) -> None:
    out, (spec, _) = tmp_path / "out", planned.specs
    for folder in (Path(taskslam.__file__).parent, Path(processes.__file__).parent):
        compileall.compile_dir(
            folder, maxlevels=0, quiet=2
        )  # or Python keeps what it compiles, cut off, beside our source
    script = tmp_path / "python"
    script.write_text(
        f"#!{sys.executable}\nimport os, resource, sys\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, (3000, {resource.RLIM_INFINITY}))\n"
        f"os.execv({sys.executable!r}, [{sys.executable!r}, *sys.argv[1:]])\n"
    )
    script.chmod(0o755)
    own, supervised.sys.executable = supervised.sys.executable, str(script)
    try:
        (result,) = LocalEngine(1, planned.folders).run([spec], out, Keeping(out, Watcher()))
    finally:
        supervised.sys.executable = own
    assert result.ending is Ending.FAILED
    assert "cannot be written: File too large" in result.detail
    assert notes(out)[spec.digest].detail == result.detail
    (again,) = LocalEngine(1, planned.folders).run([spec], out, Keeping(out, Watcher()))
    assert again.ending is Ending.COMPLETE
    assert notes(out) == {}
    assert load_run(run_folder(out, spec)).manifest.complete


def test_a_run_directory_that_cannot_be_read_is_named_and_costs_no_other(planned: Plan, tmp_path: Path) -> None:
    out, (spec, _) = tmp_path / "out", planned.specs
    run_folder(out, spec).mkdir(parents=True)
    (run_folder(out, spec) / "run.json").write_text("{")
    refused, complete = drive(planned, out)
    assert (refused.ending, complete.ending) == (Ending.REFUSED, Ending.COMPLETE)
    assert str(run_folder(out, spec)) in refused.detail
    (run_folder(out, spec) / "run.json").unlink()
    (run_folder(out, spec) / "run.json").mkdir()  # what nobody can read, whoever he is
    refused, kept = drive(planned, out)
    assert (refused.ending, kept.ending) == (Ending.REFUSED, Ending.KEPT)
    assert "found a folder, expected a file" in refused.detail


ASSASSIN = """
import os, signal
from taskslam.slam import Kind, MethodCard, SlamMethod
from taskslam.measurements import Sensor

class Assassin(SlamMethod):
    card = MethodCard(name="assassin", version="1", licence="MIT", kind=Kind.ODOMETRY, sensors=(Sensor.WHEEL_ODOMETRY,))

    def start(self, rig):
        pass

    def feed(self, measurement):
        for victim in (os.getppid(), os.getpgid(os.getppid())):
            try:
                os.kill(victim, signal.SIGKILL)
            except OSError:
                continue
        os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_method_that_kills_what_it_can_reach_costs_its_own_run_alone(
    write_campaign: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "assassin.py").write_text(ASSASSIN)
    monkeypatch.syspath_prepend(tmp_path / "here")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path / "here"), os.environ.get("PYTHONPATH", "")]))
    file = write_campaign("methods: ['assassin:Assassin', wheel_odometry]", "seeds: [0]", rounds=1)
    killer, other = drive(plan(load_campaign(str(file))), tmp_path / "out")
    assert other.ending is Ending.COMPLETE
    assert killer.ending in {
        Ending.INCOMPLETE,
        Ending.FAILED,
    }  # it crashed; or it took its worker along, which is named
    assert "crashed" in killer.detail or "was killed by SIGKILL" in killer.detail
    assert killer.spec is not None
    assert (killer.ending is Ending.INCOMPLETE) == run_folder(tmp_path / "out", killer.spec).exists()


JUMPING = """
import time
honest, honest_ns, asked = time.time, time.time_ns, [0]

def jump():
    asked[0] += 1
    return (0, 86400, -86400, 3600)[asked[0] % 4]

time.time = lambda: honest() + jump()
time.time_ns = lambda: honest_ns() + jump() * 10**9
"""


def test_a_clock_that_jumps_changes_no_byte_and_ends_no_run(
    planned: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a day to and fro, whenever a worker asks for the time of day."""
    spec = planned.specs[0]
    drive(Plan((spec,), folders=planned.folders), tmp_path / "calm")
    (tmp_path / "clock").mkdir()
    (tmp_path / "clock" / "sitecustomize.py").write_text(JUMPING)
    with monkeypatch.context() as jumping:
        path = os.pathsep.join([str(tmp_path / "clock"), os.environ.get("PYTHONPATH", "")])
        jumping.setenv("PYTHONPATH", path)
        said = subprocess.run([sys.executable, "-c", "import time; print(time.time.__name__)"], capture_output=True)
        assert said.stdout.strip() == b"<lambda>"
        (result,) = drive(Plan((spec,), folders=planned.folders), tmp_path / "out")
    assert result.ending is Ending.COMPLETE, result.detail
    assert recorded(run_folder(tmp_path / "out", spec)) == recorded(run_folder(tmp_path / "calm", spec))


def test_a_clock_that_was_put_back_makes_nobody_work_who_has_stopped(
    planned: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (spec, _), real = planned.specs, time.time
    with RunWriter(run_folder(tmp_path, spec), spec=spec.to_json()) as writer:
        writer.event(RoundStarted(0, 0, priming=False))
    for jump, expected in ((0.0, State.UNDER_WAY), (-86400.0, State.INTERRUPTED), (86400.0, State.INTERRUPTED)):
        monkeypatch.setattr(time, "time", lambda jump=jump: real() + jump)
        assert states_of([spec], tmp_path)[0].state is expected


def test_a_worker_that_is_killed_is_tried_again_and_goes_on(planned: Plan, tmp_path: Path) -> None:
    out, spec = tmp_path / "out", planned.specs[0]
    killed = []

    def kill() -> None:
        while not killed:
            found = subprocess.run(
                ["pgrep", "-f", f"engines.worker {os.getpid()}"], capture_output=True, text=True
            ).stdout.split()
            if found and list(out.rglob("journal.jsonl")):
                os.kill(int(found[0]), signal.SIGKILL)
                killed.append(found[0])
            time.sleep(0.02)

    thread = threading.Thread(target=kill)
    thread.start()
    (result,) = LocalEngine(1, planned.folders).run([spec], out, Watcher())
    thread.join()
    assert killed
    assert result.ending is Ending.COMPLETE
    assert not list(out.rglob(".*"))
    lock_file(run_folder(out, spec)).touch()  # of one that was killed right after it had put the run in its place
    assert [result.ending for result in LocalEngine(1, planned.folders).run([spec], out, Watcher())] == [Ending.KEPT]
    assert not list(out.rglob(".*"))


def test_a_method_that_is_not_installed_here_is_named_and_the_others_are_driven(
    write_campaign: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A package that is there when the campaign is planned, and missing where it is driven."""
    package = tmp_path / "here"
    package.mkdir()
    (package / "needy.py").write_text("import no_such_package\n")
    monkeypatch.syspath_prepend(package)
    file = write_campaign("methods: ['needy:Method', wheel_odometry]", "seeds: [0]", rounds=1)
    planned = plan(load_campaign(str(file)))
    needy, driven = drive(planned, tmp_path / "out")
    assert driven.ending is Ending.COMPLETE
    assert needy.ending in {Ending.UNAVAILABLE, Ending.REFUSED}
    assert needy.detail


def test_measured_latency_is_of_one_processor(write_campaign: Callable[..., Path], tmp_path: Path) -> None:
    file = write_campaign("latencies: [fixed, measured]", "seeds: [0]", rounds=1)
    fixed, measured = plan(load_campaign(str(file))).specs
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "measured_on.txt").write_text("Another Processor 9000\n")
    check_processor(fixed, tmp_path / "out")
    with pytest.raises(InputError, match="measured on another processor \\(Another Processor 9000"):
        check_processor(measured, tmp_path / "out")
    check_processor(measured, tmp_path / "new")
    check_processor(measured, tmp_path / "new")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["measured_on.txt"]


def test_runs_share_no_core_and_no_more_memory_than_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {2, 3, 5})
    whole = Allotment(3)
    with whole.lent(Share(cores=2)) as one, whole.lent(Share()) as other:
        assert (one, other) == ({2, 3}, {5})
    with whole.lent(Share(cores=8)) as everything:
        assert everything == {2, 3, 5}
    with Allotment(2).lent(Share()) as any_core:  # others may be at work here: which core is left to the system
        assert any_core == frozenset()
    with pytest.raises(InputError, match="asks for 50000 GB of memory"), whole.lent(Share(memory=50000)):
        pass


def test_a_run_for_two_cores_has_two_and_is_refused_more_memory_than_there_is(planned: Plan, tmp_path: Path) -> None:
    greedy = Resources.model_validate({"methods": {"wheel_odometry": {"memory": 50000}}})
    results = list(LocalEngine(1, planned.folders, greedy).run(planned.specs, tmp_path / "out", Watcher()))
    assert {result.ending for result in results} == {Ending.REFUSED}
    assert "asks for 50000 GB" in results[0].detail


def test_who_was_replaced_writes_no_more(tmp_path: Path) -> None:
    """A machine that was taken for dead goes on, while another drives its run."""

    def whole_round(writer: RunWriter, number: int) -> None:
        writer.event(RoundStarted(10 * number, number, priming=False))
        writer.tally(number, 0.1, 1000)
        writer.event(RoundEnded(10 * number + 5, number, Outcome.REACHED, 1, 0))

    place = tmp_path / "run"
    cut_off = RunWriter(place, spec="the spec", resume=True)
    whole_round(cut_off, 0)
    later = RunWriter(place, spec="the spec", resume=True, take_over=True)
    assert later.resumed.rounds == 1
    cut_off.event(RoundStarted(10, 1, priming=False))
    with pytest.raises(RecordError, match="another start of this run has taken over"):
        cut_off.tally(1, 0.1, 1000)
    cut_off.__exit__(None, None, None)
    whole_round(later, 1)
    journal = (later.folder / "journal.jsonl").read_text().splitlines()
    assert [json.loads(line)["event"] for line in journal] == ["round_started", "round_ended"] * 2


def test_a_file_system_without_locks_is_no_hindrance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with RunWriter(tmp_path / "run", spec="the spec") as writer:
        assert writer.folder.is_dir()
    assert [path.name for path in tmp_path.iterdir()] == [".run.partial"]


def test_the_command_line_plans_drives_tells_and_collects(write_campaign: Callable[..., Path], tmp_path: Path) -> None:
    def taskslam(*words: object) -> Any:
        return CliRunner().invoke(app, ["campaign", *map(str, words)])

    file, out = write_campaign("seeds: [0]", rounds=1), tmp_path / "out"
    told = taskslam("plan", file, "--out", out)
    assert told.exit_code == 0, told.output
    assert "1 runs, of which 0 are finished" in told.output
    done = taskslam("run", file, "--out", out, "--quiet")
    assert done.exit_code == 0, done.output
    assert (out / "report.html").exists()
    assert "1 finished" in taskslam("status", out).output
    assert taskslam("collect", out).exit_code == 0
    (out / "tour" / "wheel_odometry" / "without-map" / ".seed0.partial").mkdir()
    assert "would remove" in taskslam("prune", out).output
    assert "removed" in taskslam("prune", out, "--yes").output
    assert not list(out.rglob(".*"))
    assert isinstance(taskslam("status", tmp_path / "nothing.yaml").exception, InputError)
