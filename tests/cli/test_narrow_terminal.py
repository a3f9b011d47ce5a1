"""What is printed fits a terminal of 80 columns, but for commands to copy and paths."""

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from taskslam.cli.app import app


def commands(command, words=()):
    yield words
    for name, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, (*words, name))


def longest(*words):
    said = CliRunner().invoke(app, words, env={"COLUMNS": "80"})
    assert said.exit_code in (0, 3), said.output
    return max((line for line in said.output.splitlines() if "→" not in line), key=len)


@pytest.mark.parametrize("words", list(commands(get_command(app))), ids=" ".join)
def test_help_fits(words):
    assert len(longest(*words, "--help")) <= 80


@pytest.mark.parametrize("words", [("doctor",), ("scenarios", "list"), ("worlds", "list"), ("methods", "list")])
def test_lists_fit(words):
    assert len(longest(*words)) <= 80
