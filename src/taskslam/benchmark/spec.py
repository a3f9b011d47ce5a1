"""`RunSpec`: one value that says a run completely, handed over by people, suites and engines; a result says its own.

It holds content and no paths: a world, a floor plan and a recording by what is in them, a robot by its description. So
the same value means the same run on another machine, which finds the files by its own means, and its digest changes
with everything that can change a result: also with `BEHAVIOUR`, which stands for this package's code.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from taskslam.datasets.dataset import Dataset
from taskslam.errors import InputError
from taskslam.mode import Mode
from taskslam.robot import Robot
from taskslam.scenario import Scenario
from taskslam.slam.guest.latency import LatencyModel
from taskslam.slam.guest.wire import option_values
from taskslam.user_files import complaint

BEHAVIOUR = 4
"""Raised by whoever changes what a run of the same spec leaves behind. Runs of different numbers are not mixed."""

_ONLY_WORDS: dict[str, Any] = {
    "robot": {"name": True},
    "scenario": {
        "title": True,
        "robot": True,
        "world": {"name": True, "file": True, "source": True, "resource_paths": True},
        "floor_plan": {"map": True},
    },
}
_LONGEST_NAME = 80
_USUAL_ROBOT: str = Scenario.model_fields["robot"].default


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Drive(_Part):
    """A tour in the simulator. world, floor_plan: SHA-256 of what they hold (`world/digest.py`)."""

    source: Literal["simulation"] = "simulation"
    scenario: Scenario
    robot: Robot
    world: str
    floor_plan: str

    @property
    def name(self) -> str:
        """The scenario's."""
        return self.scenario.name

    @property
    def rounds(self) -> int:
        """Rounds that count."""
        return self.scenario.protocol.rounds

    def content(self) -> dict[str, Any]:
        """What can change a result: files count by what is in them, the robot by its description, titles not at all.

        What is None is left out, so that a sensor that robots learn to have is nothing new to those without it.
        """
        content = self.model_dump(mode="json", exclude=_ONLY_WORDS, exclude_none=True)
        assert isinstance(content, dict)
        return content


class Recording(_Part):
    """A recording, played `rounds` times. bytes: its size; rig: the sensors with their calibration."""

    source: Literal["replay"] = "replay"
    name: str
    kind: str
    bytes: int
    sensors: tuple[str, ...]
    rig: dict[str, Any]
    rounds: Annotated[int, Field(ge=1)] = 1

    def content(self) -> dict[str, Any]:
        """What can change a result, as far as it is known without reading the whole recording."""
        return self.model_dump(mode="json")


class RunSpec(_Part):
    """A run. task: what is driven or played; options: the method's own; latency: how its estimates are delayed.

    sealed: whether its noise is salted (`sealing.py`). The salt is none of it: it is a result.
    """

    task: Annotated[Drive | Recording, Field(discriminator="source")]
    method: str
    mode: Mode
    seed: Annotated[int, Field(ge=0)] = 0
    options: dict[str, Any] = {}
    latency: LatencyModel = LatencyModel()
    sealed: bool = False
    behaviour: int = BEHAVIOUR

    @property
    def digest(self) -> str:
        """SHA-256 of all that can change the result."""
        content = self.model_dump(mode="json", exclude={"task"}) | {"task": self.task.content()}
        return _sha256(content)

    @property
    def task_digest(self) -> str:
        """SHA-256 of what is held fixed while methods are compared."""
        return _sha256(self.task.content() | {"behaviour": self.behaviour})

    @property
    def title(self) -> str:
        """For people."""
        seed = f" · seed {self.seed}" if self.seed else ""
        return f"{self.task.name} · {self.way} · {self.mode}{seed}{' · sealed' if self.sealed else ''}"

    @property
    def way(self) -> str:
        """The method and in which way it is run, where that is not the usual one: `karto,loop_closing=false,zero`.

        A robot that is not the usual one is a way too, so that runs with several stand side by side.
        """
        options = [f"{key}={json.dumps(value)}" for key, value in sorted(self.options.items())]
        latency = [] if self.latency == LatencyModel() else [self.latency.words]
        robot = Path(self.task.scenario.robot).stem if isinstance(self.task, Drive) else _USUAL_ROBOT
        return ",".join([self.method, *options, *latency, *([] if robot == _USUAL_ROBOT else [f"robot={robot}"])])

    def to_json(self) -> str:
        """One line that `from_json` reads."""
        return json.dumps(self.model_dump(mode="json"), sort_keys=True, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str | bytes) -> RunSpec:
        """The spec that `to_json` wrote. Raises InputError with the key and what was expected there."""
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise InputError(f"run spec: {complaint(error, cls)}") from None

    def __hash__(self) -> int:
        return hash((self.method, self.mode, self.seed, self.task.name))


def spec_of_tour(
    scenario: Scenario,
    robot: Robot,
    digests: tuple[str, str],
    method: str,
    mode: Mode,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    latency: LatencyModel | None = None,
    sealed: bool = False,
) -> RunSpec:
    """The spec of a tour. digests: of the world and of the floor plan.

    Raises InputError for an option that JSON cannot hold.
    """
    drive = Drive(scenario=_portable(scenario), robot=robot, world=digests[0], floor_plan=digests[1])
    return _spec(drive, method, mode, seed, options, latency, sealed)


def spec_of_replay(
    dataset: Dataset,
    method: str,
    mode: Mode = Mode.WITHOUT_MAP,
    rounds: int = 1,
    options: Mapping[str, Any] | None = None,
    latency: LatencyModel | None = None,
) -> RunSpec:
    """The spec of `rounds` passes over a recording. Raises InputError for an option that JSON cannot hold."""
    recording = Recording(
        name=dataset.name,
        kind=dataset.kind,
        bytes=_size(dataset.path),
        sensors=tuple(sorted(dataset.sensors)),
        rig=dataset.rig.model_dump(mode="json"),
        rounds=rounds,
    )
    return _spec(recording, method, mode, 0, options, latency)


def run_folder(out: Path, spec: RunSpec) -> Path:
    """Where a run's results stand: OUT/scenario/method/mode/seedN; a method's unusual ways are told by its folder."""
    way = re.sub(r"[^\w.,=+-]+", "_", spec.way)
    if len(way) > _LONGEST_NAME:
        way = f"{way[:_LONGEST_NAME]}-{_sha256(spec.way)[:8]}"
    return out / spec.task.name / way / spec.mode / f"seed{spec.seed}{'-sealed' if spec.sealed else ''}"


def _spec(
    task: Drive | Recording,
    method: str,
    mode: Mode,
    seed: int,
    options: Mapping[str, Any] | None,
    latency: LatencyModel | None,
    sealed: bool = False,
) -> RunSpec:
    try:
        plain = option_values(options or {})
    except TypeError as error:
        raise InputError(f"method '{method}': option value {error}; expected text, numbers or lists") from error
    delay = latency or LatencyModel()
    return RunSpec(task=task, method=method, mode=mode, seed=seed, options=plain, latency=delay, sealed=sealed)


def _portable(scenario: Scenario) -> Scenario:
    """The same without paths: files by their names alone."""
    changed: dict[str, Any] = {"robot": Path(scenario.robot).stem}
    if scenario.world is not None and scenario.world.file is not None and PurePath(scenario.world.file).is_absolute():
        changed["world"] = scenario.world.model_copy(update={"file": Path(scenario.world.file).name})
    if scenario.floor_plan.map is not None:
        plan = scenario.floor_plan
        changed["floor_plan"] = plan.model_copy(update={"map": Path(scenario.floor_plan.map).name})
    return scenario.model_copy(update=changed)


def _sha256(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _size(path: Path) -> int:
    if path.is_file():
        return path.stat().st_size
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
