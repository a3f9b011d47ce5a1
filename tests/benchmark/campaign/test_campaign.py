from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from taskslam.benchmark.campaign.campaign_file import Campaign, load_campaign
from taskslam.benchmark.campaign.planning import Plan, plan
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.spec import run_folder
from taskslam.errors import InputError, UnknownMethodError
from taskslam.mode import Mode
from taskslam.record import load_run


def write_tour(tour: Path, name: str, x: float) -> None:
    """Write the file of the short tour as one of another name, with a goal at x."""
    text = tour.read_text().replace("name: tour", f"name: {name}").replace("[0.3, 0.0, 0.0]", f"[{x}, 0.0, 0.0]")
    (tour.parent / f"{name}.yaml").write_text(text)


@pytest.fixture
def small_campaign(tour: Path, tmp_path: Path) -> Path:
    """Two short tours."""
    write_tour(tour, "near", 0.3)
    write_tour(tour, "far", 0.5)
    tours = f"[{tmp_path / 'near.yaml'}, {tmp_path / 'far.yaml'}]"
    file = tmp_path / "campaign.yaml"
    file.write_text(
        f"name: small\nscenarios: {{mine: {tours}}}\nmethods: [ground_truth, wheel_odometry]\nrounds: 1\nseeds: [0]\n"
    )
    return file


def load(file: Path, **changes: object) -> Campaign:
    """The campaign of a file, without maps if nothing else is said."""
    return load_campaign(str(file)).model_copy(update={"modes": (Mode.WITHOUT_MAP,), **changes})


def drive(planned: Plan, out: Path, cores: int = 1, watcher: Watcher | None = None) -> list[Result]:
    return list(LocalEngine(cores, planned.folders).run(planned.specs, out, watcher or Watcher()))


def test_the_papers_campaign_names_its_four_places_twice_and_has_several_seeds() -> None:
    paper = load_campaign("paper")
    assert len(paper.scenarios_of(("builtin",))) == len(paper.scenarios_of(("aws",))) == 4
    assert len(paper.scenarios_of()) == 8
    assert (paper.rounds, paper.seeds) == (5, (0, 1, 2))


def test_unknown_members_are_named_with_a_guess(small_campaign: Path) -> None:
    with pytest.raises(InputError, match=r"'papr'.*Did you mean 'paper'"):
        load_campaign("papr")
    with pytest.raises(InputError, match=r"no scenarios 'mein'.*Did you mean 'mine'"):
        plan(load(small_campaign), ["mein"])
    with pytest.raises(UnknownMethodError, match="kartoo"):
        plan(load(small_campaign, methods=("kartoo",)))


def test_every_run_of_a_campaign_is_driven_once_and_kept(small_campaign: Path, tmp_path: Path) -> None:
    planned = plan(load(small_campaign))
    assert len(planned.specs) == 4
    heard: list[Result] = []

    class Listening(Watcher):
        def ends(self, result: Result) -> None:
            heard.append(result)

    first = drive(planned, tmp_path / "out", 2, Listening())
    assert [result.ending for result in first] == [Ending.COMPLETE] * 4
    assert len(heard) == 4
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("run.json")}
    assert len(stamps) == 4
    again = drive(planned, tmp_path / "out", 2)
    assert [result.ending for result in again] == [Ending.KEPT] * 4
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("run.json")} == stamps


def test_a_run_that_is_refused_says_why_and_the_others_go_on(small_campaign: Path, tour: Path, tmp_path: Path) -> None:
    write_tour(tour, "near", 60.0)
    planned = plan(load(small_campaign, methods=("ground_truth",)))
    (refused,), (complete,) = planned.refused, drive(planned, tmp_path / "out")
    assert refused.ending is Ending.REFUSED
    assert "goal 1 at (60, 0)" in refused.detail
    assert complete.ending is Ending.COMPLETE


def test_a_setting_holds_for_every_scenario_and_is_not_taken_for_what_was_driven_before(
    small_campaign: Path, tmp_path: Path
) -> None:
    def planned(*settings: str) -> Plan:
        return plan(load(small_campaign, methods=("ground_truth",), settings=settings))

    robot_file = tmp_path / "mine.yaml"
    robot_file.write_text("built_on: turtlebot2_small10\nname: mine\n")
    slow = planned(f"robot={robot_file}")
    assert [result.ending for result in drive(slow, tmp_path / "out")] == [Ending.COMPLETE] * 2
    for directory in (tmp_path / "out").glob("*/*/*/seed0"):
        robot = load_run(directory).manifest.robot
        assert robot is not None
        assert robot["rig"]["stereo"]["width"] == 480
    assert [result.ending for result in drive(slow, tmp_path / "out")] == [Ending.KEPT] * 2
    robot_file.write_text("built_on: turtlebot2\nname: mine\n")
    edited = drive(planned(f"robot={robot_file}"), tmp_path / "out")
    assert [result.ending for result in edited] == [Ending.REFUSED] * 2
    assert "another configuration" in edited[0].detail


def finished_runs(out: Path) -> dict[Path, int]:
    """run.json of every finished run and when it was written; a run that is under way has none in its place."""
    return {path: path.stat().st_mtime_ns for path in out.glob("*/*/*/seed0/run.json")}


def workers_of(driver: int) -> list[str]:
    return subprocess.run(["pgrep", "-f", f"engines.worker {driver}"], capture_output=True, text=True).stdout.split()


def test_a_campaign_killed_in_the_middle_goes_on_where_it_stopped(small_campaign: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-c", "from taskslam.cli.main import main; main()", "suite", str(small_campaign)]
    command += ["--out", str(out), "--methods", "ground_truth", "--rounds", "2"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not finished_runs(out) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    finished = finished_runs(out)
    assert finished
    while (workers := workers_of(process.pid)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert workers == []
    done = subprocess.run(command, capture_output=True, text=True, timeout=180)
    assert done.returncode == 0, done.stderr
    assert "finished before" in done.stderr
    assert len(list(out.rglob("run.json"))) == 4
    assert finished.items() <= finished_runs(out).items()
    assert (out / "report.html").exists()


def test_a_latency_sweep_is_a_campaign(small_campaign: Path, tmp_path: Path) -> None:
    sweep = small_campaign.read_text() + "latencies: [fixed, zero, measured x 4]\n"
    small_campaign.write_text(
        sweep.replace("[ground_truth, wheel_odometry]", "[{name: karto, options: {do_loop_closing: false}}]")
    )
    planned = plan(load(small_campaign))
    near = [spec for spec in planned.specs if spec.task.name == "near"]
    assert [spec.latency.words for spec in near] == ["fixed", "zero", "measured x 4"]
    assert len({run_folder(tmp_path, spec) for spec in near}) == 3
    assert [spec.options for spec in near] == [{"do_loop_closing": False}] * 3
    zero = LocalEngine(1, planned.folders).run(near[1:2], tmp_path / "out", Watcher())
    assert [result.ending for result in zero] == [Ending.COMPLETE]
    manifest = load_run(run_folder(tmp_path / "out", near[1])).manifest
    assert (manifest.latency, manifest.method_options) == ("zero", {"do_loop_closing": False})
    small_campaign.write_text(sweep.replace("measured x 4", "slow"))
    with pytest.raises(InputError, match="latency 'slow': expected fixed, zero, measured"):
        plan(load(small_campaign))


def test_a_place_that_has_changed_since_the_plan_is_refused(small_campaign: Path, tmp_path: Path) -> None:
    planned = plan(load(small_campaign, methods=("ground_truth",)))
    spec = planned.specs[0]
    other = spec.model_copy(update={"task": spec.task.model_copy(update={"world": "0" * 64})})
    (result,) = LocalEngine(1, planned.folders).run([other], tmp_path / "out", Watcher())
    assert result.ending is Ending.REFUSED
    assert "the world found here is not the one of the run" in result.detail
    broken = spec.model_copy(update={"method": "no_such_module:Method"})
    (result,) = LocalEngine(1, planned.folders).run([broken], tmp_path / "out", Watcher())
    assert (result.ending, "no module 'no_such_module'" in result.detail) == (Ending.REFUSED, True)
