"""The command line as a user meets it: in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]

TOUR = """
name: mine
world: {{file: {world}}}
start: {{x: 0, y: 0, theta: 0}}
sequence: {{waypoints: [[1.0, 0.0, 0.0]]}}
protocol: {{rounds: 1, pause: 0.5}}
"""

ROOM = """<?xml version="1.0"?>
{prolog}
<sdf version="1.6"><world name="room">
  <model name="walls"><static>true</static><link name="link">
    {walls}
  </link></model>
  {more}
</world></sdf>
"""


def wall(name: str, x: float, y: float, sx: float, sy: float) -> str:
    geometry = f"<geometry><box><size>{sx} {sy} 1</size></box></geometry><pose>{x} {y} 0.5 0 0 0</pose>"
    return f"<collision name='c{name}'>{geometry}</collision><visual name='v{name}'>{geometry}</visual>"


WALLS = wall("w", -3, 0, 0.2, 6) + wall("e", 3, 0, 0.2, 6) + wall("s", 0, -3, 6, 0.2) + wall("n", 0, 3, 6, 0.2)


@pytest.fixture
def taskslam(tmp_path: Path) -> Run:
    def call(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", "from taskslam.cli.main import main; main()", *map(str, arguments)]
        variables = {k: v for k, v in os.environ.items() if k != "TASKSLAM_WORLD_PATH"}
        return subprocess.run(
            command, capture_output=True, text=True, timeout=180, cwd=tmp_path, env={**variables, **environment}
        )

    return call


@pytest.fixture
def write_tour(tmp_path: Path) -> Callable[..., Path]:
    def write(walls: str = WALLS, more: str = "", prolog: str = "", tour: str = TOUR) -> Path:
        world = tmp_path / "room.world"
        world.write_text(ROOM.format(walls=walls, more=more, prolog=prolog))
        file = tmp_path / "tour.yaml"
        file.write_text(tour.format(world=world))
        return file

    return write


def refused(done: subprocess.CompletedProcess[str], *words: str) -> None:
    """Exit status 2 and one sentence on standard error that holds these words."""
    assert done.returncode == 2, done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("taskslam: ")]
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in lines[0]


def test_help_loads_nothing_heavy(taskslam: Run) -> None:
    script = (
        "import sys; from taskslam.cli import app; heavy = {'numba', 'scipy', 'matplotlib', 'trimesh', 'gtsam',"
        " 'embreex', 'numpy'} & set(sys.modules); print(sorted(heavy)); sys.exit(bool(heavy))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout
    for verb in ("demo", "run", "evaluate", "report", "worlds", "methods", "doctor"):
        assert verb in taskslam("--help").stdout
        assert "xample" in taskslam(verb, "--help").stdout or verb in {"worlds", "methods", "doctor"}


def test_a_tour_of_ones_own_world_ends_in_metrics_and_a_report(
    taskslam: Run, write_tour: Callable[..., Path], tmp_path: Path
) -> None:
    done = taskslam("run", write_tour(), "-m", "ground_truth", "--mode", "without-map", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "metrics.json").exists()
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000
    again = taskslam("run", write_tour(), "-m", "ground_truth", "--mode", "without-map", "--out", tmp_path / "out")
    assert again.returncode == 0
    assert "kept" in again.stderr


def test_a_method_that_fails_its_task_exits_with_one(taskslam: Run, write_tour: Callable[..., Path]) -> None:
    options = ["--set", "protocol.goal_timeout=1", "--mode", "without-map"]
    done = taskslam("run", write_tour(), "-m", "ground_truth", *options)
    assert done.returncode == 1, done.stderr
    assert "goal_timeout" in done.stderr


def test_a_missing_world_says_which_repository_to_clone(taskslam: Run) -> None:
    done = taskslam("run", "aws_small_house", "-m", "karto")
    refused(done, "small_house.world", "git clone https://", "--world-path")


def test_an_entity_bomb_is_refused(taskslam: Run, write_tour: Callable[..., Path]) -> None:
    bomb = '<!DOCTYPE sdf [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;"><!ENTITY c "&b;&b;&b;">]>'
    refused(taskslam("run", write_tour(prolog=bomb, more="<!-- -->"), "-m", "karto"), "room.world")


def test_a_model_outside_its_folder_is_refused(taskslam: Run, write_tour: Callable[..., Path]) -> None:
    """That is no slip which costs a part: whoever wrote it wants a file that is not theirs."""
    more = "<include><uri>model://../../etc/passwd</uri></include>"
    refused(taskslam("run", write_tour(more=more), "-m", "karto"), "../../etc/passwd")


def test_a_mesh_with_nan_vertices_is_named(taskslam: Run, write_tour: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "broken.obj").write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    geometry = "<geometry><mesh><uri>broken.obj</uri></mesh></geometry>"
    more = f"<model name='m'><link name='l'><visual name='v'>{geometry}</visual></link></model>"
    write_tour(more=more)
    done = taskslam("worlds", "show", tmp_path / "room.world")
    assert done.returncode == 0, done.stderr
    told = "".join(done.stdout.split())  # a terminal breaks lines where it will
    assert "broken.objhasNaNorinfiniteverticesin1of1triangles" in told


def test_a_floor_plan_of_another_place_is_refused(taskslam: Run, write_tour: Callable[..., Path], data: Path) -> None:
    plan = data / "maps" / "fourth_floor_gazebo.yaml"
    done = taskslam("run", write_tour(), "-m", "karto", "--set", f"floor_plan.map={plan}")
    refused(done, "do not overlap")


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("sequence.waypoints=[[2.9, 0.0, 0.0]]", ["goal 1 at (2.9, 0)", "from an obstacle"]),
        ("sequence.waypoints=[[5.0, 0.0, 0.0]]", ["goal 1"]),
        ("sequence.waypoints=[]", ["sequence is empty"]),
        ("sequence.path=[0, 4]", ["sequence: path[1] is 4"]),
        ("protocol.ruonds=4", ["protocol.ruonds", "Did you mean 'rounds'"]),
    ],
)
def test_a_tour_that_cannot_work_is_refused(
    override: str, words: list[str], taskslam: Run, write_tour: Callable[..., Path]
) -> None:
    refused(taskslam("run", write_tour(), "-m", "karto", "--set", override), *words)


def test_an_unknown_method_is_named_with_a_guess(taskslam: Run, write_tour: Callable[..., Path]) -> None:
    refused(taskslam("run", write_tour(), "-m", "kartoo"), "kartoo", "Did you mean 'karto'")
    refused(taskslam("run", write_tour(), "-m", "karto", "--option", "no_such=1"), "no_such")


def test_a_place_that_cannot_be_written_is_infrastructure(taskslam: Run, write_tour: Callable[..., Path]) -> None:
    done = taskslam("run", write_tour(), "-m", "ground_truth", "--out", "/proc/nowhere")
    assert done.returncode == 3, done.stderr
    assert "/proc/nowhere" in done.stderr
    assert "Traceback" not in done.stderr
