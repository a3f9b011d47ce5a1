"""A suite: scenarios x methods x modes, each run in a process of its own; what is finished is never driven again.

suite = load_suite("paper")
results = run_suite(plan(suite, "builtin"), out, jobs=2)
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from taskslam.benchmark.run import RunRequest, finished_tour, run_directory
from taskslam.errors import InputError, MethodUnavailableError, RecordError, did_you_mean
from taskslam.mode import Mode
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.slam.registry import load_method
from taskslam.user_files import Shipped


class Suite(BaseModel):
    """A named set of runs. worlds: scenario names by set; rounds: those that count."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    worlds: dict[str, tuple[str, ...]]
    methods: tuple[str, ...]
    rounds: int = 5


@dataclass(frozen=True)
class Job:
    """One run of a suite. overrides: scenario keys, `a.b=c`."""

    scenario: str
    method: str
    mode: str
    seed: int
    overrides: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """For people."""
        return f"{self.scenario} · {self.method} · {self.mode}" + (f" · seed {self.seed}" if self.seed else "")


class Ending(StrEnum):
    """What became of a job."""

    COMPLETE = "complete"
    INCOMPLETE = "incomplete"
    KEPT = "finished before"
    UNAVAILABLE = "method not installed"
    REFUSED = "refused"
    FAILED = "infrastructure failed"


@dataclass(frozen=True)
class Result:
    """A job and what became of it, with a sentence where it was not driven to its end."""

    job: Job
    ending: Ending
    detail: str = ""


class Watcher:
    """Hears how a suite goes; the null watcher hears nothing. Called from several threads, one call at a time."""

    def begins(self, job: Job) -> None:
        """A job's process starts."""

    def goes_on(self, job: Job, progress: dict[str, object]) -> None:
        """A line of progress from a job."""

    def ends(self, result: Result) -> None:
        """A job is over."""


def load_suite(reference: str) -> Suite:
    """A suite by shipped name or YAML file.

    Raises:
        InputError: unknown name, unreadable file, unknown key.
    """
    return Shipped("suite", "taskslam.benchmark", "suites", InputError).load(reference, Suite)


def plan(
    suite: Suite,
    worlds: str,
    methods: Sequence[str] = (),
    modes: Iterable[Mode] = tuple(Mode),
    seeds: Sequence[int] = (0,),
    rounds: int | None = None,
    settings: Sequence[str] = (),
) -> list[Job]:
    """The jobs of a suite, methods innermost so that a comparison grows evenly. settings: scenario keys, `a.b=c`.

    Raises:
        InputError: the suite has no such set of worlds. UnknownMethodError: no such method.
    """
    if worlds not in suite.worlds:
        known = ", ".join(suite.worlds)
        hint = did_you_mean(worlds, suite.worlds)
        raise InputError(f"suite {suite.name} has no worlds '{worlds}'; expected one of {known}.{hint}")
    chosen = tuple(methods) or suite.methods
    for method in chosen:
        _is_installed(method)
    overrides = (f"protocol.rounds={rounds or suite.rounds}", *settings)
    return [
        Job(scenario, method, mode.value, seed, overrides)
        for seed in seeds
        for scenario in suite.worlds[worlds]
        for mode in modes
        for method in chosen
    ]


def run_suite(
    jobs: Sequence[Job], out: Path, world_paths: Sequence[Path] = (), parallel: int = 1, watcher: Watcher | None = None
) -> list[Result]:
    """Drive what is not finished yet, `parallel` processes at a time; the results in the order of the jobs."""
    watcher = watcher or Watcher()
    with ThreadPoolExecutor(max_workers=parallel) as pool:
        return list(pool.map(lambda job: _run_job(job, out, world_paths, watcher), jobs))


def _run_job(job: Job, out: Path, world_paths: Sequence[Path], watcher: Watcher) -> Result:
    result = _before(job, out) or _in_process(job, out, world_paths, watcher)
    watcher.ends(result)
    return result


def _before(job: Job, out: Path) -> Result | None:
    scenario = load_scenario(job.scenario, job.overrides)
    request = RunRequest(job.method, Mode(job.mode), job.seed)
    try:
        if finished_tour(scenario, load_robot(scenario.robot), request, run_directory(out, scenario.name, request)):
            return Result(job, Ending.KEPT)
    except RecordError as error:
        return Result(job, Ending.REFUSED, str(error))
    if not _is_installed(job.method):
        return Result(job, Ending.UNAVAILABLE, f"{job.method}: its package is not installed")
    return None


def _is_installed(method: str) -> bool:
    try:
        load_method(method)
    except MethodUnavailableError:
        return False
    return True


def _in_process(job: Job, out: Path, world_paths: Sequence[Path], watcher: Watcher) -> Result:
    watcher.begins(job)
    order = {"job": asdict(job), "out": str(out), "world_paths": [str(path) for path in world_paths]}
    command = [sys.executable, "-m", "taskslam.benchmark.worker", str(os.getpid())]
    say: Callable[[dict[str, object]], None] = lambda line: watcher.goes_on(job, line)  # noqa: E731
    with subprocess.Popen(  # noqa: S603 our own interpreter and module
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdin.write(json.dumps(order))
        process.stdin.close()
        last: dict[str, object] = {}
        for line in process.stdout:
            last = json.loads(line)
            say(last)
        complaint = process.stderr.read().strip().splitlines()
        status = process.wait()
    endings = {0: Ending.COMPLETE, 1: Ending.INCOMPLETE, 2: Ending.REFUSED}
    detail = str(last.get("notice", "")) if status == 1 else (complaint[-1] if complaint else "")
    return Result(job, endings.get(status, Ending.FAILED), detail)
