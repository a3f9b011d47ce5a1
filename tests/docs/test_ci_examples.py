"""The workflow and the Dockerfile of examples/ci: well-formed, and their commands do what the page says."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import yaml
from typer.testing import CliRunner

from taskslam.cli.app import app

FOLDER = Path(__file__).parents[2] / "examples" / "ci"
INSTRUCTIONS = {"FROM", "ARG", "COPY", "RUN", "ENV", "WORKDIR", "ENTRYPOINT", "CMD"}


def workflow():
    return yaml.load((FOLDER / "taskslam.yml").read_text(encoding="utf-8"), yaml.BaseLoader)  # `on` is no flag


def test_every_step_of_the_workflow_runs_something_or_uses_an_action_of_a_named_version():
    steps = workflow()["jobs"]["compare"]["steps"]
    assert set(workflow()["on"]) == {"pull_request", "workflow_dispatch"}
    for step in steps:
        assert ("run" in step) != ("uses" in step)
        assert "run" in step or re.fullmatch(r"actions/[a-z-]+@v\d+", step["uses"])
        assert set(step) <= {"name", "run", "uses", "with", "if"}


def test_the_workflows_commands_are_a_gate(tmp_path):
    """As they stand, but for a shorter drive, first as its page makes what is held on to."""
    script = [step["run"] for step in workflow()["jobs"]["compare"]["steps"] if "taskslam " in step.get("run", "")]
    script = [text for text in script if not text.startswith("pip ")]
    assert len(script) == 3
    short = "--set 'sequence.path=[0, 0]' --set protocol.pause=1"
    commands = "\n".join(script).replace("taskslam run house", f"taskslam run house {short}")
    before = f"taskslam run house {short} --method $METHOD --mode without-map --rounds 3 --out results"
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "METHOD": "wheel_odometry",
        "ROUNDS": "3",
    }
    text = "\n".join([before, "taskslam evaluate results", commands])
    done = subprocess.run(
        ["bash", "-euxc", text], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "wheel_odometry" in (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "<testsuite" in (tmp_path / "taskslam.xml").read_text(encoding="utf-8")
    kept = json.loads((tmp_path / "results" / "metrics.json").read_text(encoding="utf-8"))
    assert kept["runs"][0]["rounds"] == 3


def test_the_dockerfile_is_one_and_its_command_is_ours(tmp_path):
    text = (FOLDER / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    said = {}
    for line in lines:
        word, _, rest = line.partition(" ")
        assert word in INSTRUCTIONS, line
        said.setdefault(word, []).append(rest)
    assert lines[0].startswith("FROM python:3.1")
    for command in said["RUN"]:
        subprocess.run(["bash", "-n", "-c", command], check=True)
        assert shlex.split(command)
    words = [*json.loads(said["ENTRYPOINT"][0]), *json.loads(said["CMD"][0])]
    assert words[0] == "taskslam"
    done = CliRunner().invoke(app, words[1:])
    assert done.exit_code == 0, done.output
