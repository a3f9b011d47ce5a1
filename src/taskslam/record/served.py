"""What a served robot leaves behind: what was served, what happened, and where the robot truly was.

    served.json    what was served, to whom everything was told, and how it ended
    served.jsonl   what happened, an event a line, written through at once
    graph.sh       the variables by which others find the graph, for `. graph.sh`
    truth.tum      the true pose in `map` at the end of every control period, stamped as the messages are

Nothing but this folder knows the true pose, unless `publishes_truth` says that it was put on a topic.
"""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict

from taskslam.errors import RecordError
from taskslam.files import write_whole, writing
from taskslam.geometry import SE2
from taskslam.reading import LARGEST_MANIFEST, read_json
from taskslam.record.events import MethodNotice, RunEnded
from taskslam.record.journal import JournalWriter
from taskslam.record.trajectories import HEADER, Trajectory, planar_line, read_trajectory

SERVED, EVENTS, GRAPH, TRUTH = "served.json", "served.jsonl", "graph.sh", "truth.tum"


class Served(BaseModel):
    """The content of served.json.

    variables: by which others find the graph; pace: in words; epoch: ns, what the robot's clock shows at t = 0 of the
    events; simulated_s, vain, messages: known once it has ended.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["taskslam-served/1"] = "taskslam-served/1"
    scenario: dict[str, object]
    robot: dict[str, object]
    seed: int
    ros: int
    variables: dict[str, str]
    pace: str
    epoch: int
    publishes_truth: bool
    versions: dict[str, str]
    machine: dict[str, str]
    started_utc: str
    ended: bool = False
    simulated_s: float | None = None
    vain: int | None = None
    messages: int | None = None


class ServedRecord:
    """Writes the folder. Use as a context manager; `end` says that it is whole.

    Raises RecordError if the folder exists, DiskFullError.
    """

    def __init__(self, folder: Path, served: Served) -> None:
        self.folder, self._served = folder.absolute(), served
        if self.folder.exists():
            raise RecordError(f"{folder}: exists already; expected the name of a new folder")
        with writing(self.folder):
            self.folder.mkdir(parents=True)
            self._truth = (self.folder / TRUTH).open("w", encoding="utf-8")
            self._truth.write(HEADER + "\n")
        lines = [f"export {name}={shlex.quote(value)}\n" for name, value in served.variables.items()]
        write_whole(self.folder / GRAPH, lines)
        self._journal = JournalWriter(self.folder / EVENTS)
        self._write()

    def notice(self, now: int, number: int, text: str) -> None:
        """Something happened, at `now` ns; number: how often the robot had been put down before."""
        self._journal.write(MethodNotice(now, number, text))

    def truth(self, stamp: int, pose: SE2) -> None:
        """Where the robot is, in `map`."""
        with writing(self.folder / TRUTH):
            self._truth.write(planar_line(stamp, pose) + "\n")

    def end(self, now: int, simulated_s: float, vain: int, messages: int) -> Served:
        """All is over, as it should be; the whole content of served.json."""
        self._journal.write(RunEnded(now, True))
        facts = {"ended": True, "simulated_s": simulated_s, "vain": vain, "messages": messages}
        self._served = self._served.model_copy(update=facts)
        self._write()
        return self._served

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        with writing(self.folder / TRUTH):
            self._truth.close()
        self._journal.close()

    def _write(self) -> None:
        write_whole(self.folder / SERVED, json.dumps(self._served.model_dump(mode="json"), indent=2) + "\n")


def load_served(folder: Path) -> tuple[Served, Trajectory]:
    """What was served, and the true poses in `map`, stamped by the robot's clock (ns). Raises RecordError."""
    path = folder / SERVED
    content = read_json(path, "record of a served robot", RecordError, LARGEST_MANIFEST)
    try:
        served = Served.model_validate(content)
    except ValueError as error:
        raise RecordError(f"{path}: not a record of a served robot: {' '.join(str(error).split())[:200]}") from None
    return served, read_trajectory(folder / TRUTH)
