"""Every command that README, docs and `--help` print exists as it is printed; those that are quick are run."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.cli.options import parse_options
from taskslam.slam.karto.settings import KartoSettings

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "examples/ci/taskslam.yml", "examples/ci/Dockerfile")),
    *sorted((ROOT / "docs").glob("*.md")),
]
_LINE = re.compile(r"^(?:    |\$ | +run: | {10})?(taskslam [^\n|&>;`]+)", re.MULTILINE)
_SPAN = re.compile(r"`(taskslam [^`\n|&>;]+)`")
QUICK = (
    "taskslam tags make ", "taskslam methods show ", "taskslam worlds list", "taskslam methods list",
    "taskslam planners list",
)  # fmt: skip
"""Run as they stand. Others need a recording, a results folder, a camera or minutes: the tutorial is run elsewhere."""
COMMAND = typer.main.get_command(app)


def commands(group: Any = COMMAND, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if hasattr(group, "commands"):
        for name, command in group.commands.items():
            yield from commands(command, (*words, name))
    else:
        yield words, group


def printed() -> dict[str, str]:
    """Every command with the place where it is printed; those with an ellipsis or in capitals alone are patterns."""
    found = {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8").replace("\\\n", " ")
        for pattern in (_LINE, _SPAN):
            for match in pattern.finditer(text):
                found.setdefault(_plain(match[1]), page.name)
    for words, command in commands():
        for match in re.finditer(r"(taskslam [^`\n]+)", re.sub(r"\n +(?=\S)", "\n", command.help or "")):
            found.setdefault(_plain(match[1].replace("`", "")), f"--help of {' '.join(words)}")
    return {text: place for text, place in found.items() if is_command(text)}


def _plain(text: str) -> str:
    return " ".join(text.partition(" #")[0].split()).rstrip(".,:")


def is_command(text: str) -> bool:
    first = text.split()[1:2]
    pattern = any(sign in text for sign in ("...", "[", "…", " | ")) or re.search(r"\b[A-Z]{3,}\b(?!\.)", text)
    return bool(first) and first[0] in COMMAND.commands and not pattern


PRINTED = printed()


@pytest.mark.parametrize("text", sorted(PRINTED), ids=str)
def test_a_printed_command_exists_as_it_is_printed(text: str) -> None:
    words = shlex.split(text)[1:]
    command: Any = COMMAND
    while hasattr(command, "commands") and words and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    if hasattr(command, "commands") or not words:
        return  # spoken of, as in "see `taskslam worlds`"
    context = command.context_class(command, info_name=text)
    values, rest, _ = command.make_parser(context).parse_args(args=list(words))  # raises for an unknown option
    assert not rest, f"{PRINTED[text]} prints `{text}`: {rest} is too much"
    methods = [values.get("method"), values.get("name"), values.get("reference")]
    named = {str(name) for entry in methods for name in (entry if isinstance(entry, list) else [entry])}
    if "karto" in named:
        KartoSettings.from_options(parse_options(values.get("option") or []))


@pytest.mark.parametrize("text", sorted(filter(lambda text: text.startswith(QUICK), PRINTED)), ids=str)
def test_a_quick_command_works_as_it_is_printed(text: str, tmp_path: Path) -> None:
    if "tags" in text:
        pytest.importorskip("apriltag")
    before = Path.cwd()
    os.chdir(tmp_path)
    try:
        done = CliRunner().invoke(app, shlex.split(text)[1:])
    finally:
        os.chdir(before)
    assert done.exit_code == 0, f"{PRINTED[text]} prints `{text}`: {done.exception or done.output}"


def test_there_are_commands_to_look_at() -> None:
    assert len(PRINTED) > 60
    assert sum(place.startswith("--help") for place in PRINTED.values()) > 20
