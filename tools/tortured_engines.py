"""The engines that `torture.py` disturbs: how a campaign is started on each, what can be killed, when it is at rest.

A victim is a name; `kill` kills one of that kind if there is one at this moment. What belongs to the campaign is told
by a mark in the environment of its processes, the folder for temporary files.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from ray_cluster import add_machine, lose_machine, ray_cluster
from slurm_cluster import Cluster, missing, slurm, wait_for

ROOT = Path(__file__).parents[1]
_OF_A_CAMPAIGN = ("taskslam", "_drive_there")
_LONGEST_S = 1800.0  # a campaign that takes seconds, on a machine that has other work


class Local:
    """This machine. folder: of the torture; dice: of the victims.

    kinds: words of a command line by which processes of a victim's name are known.
    """

    kinds: ClassVar[dict[str, str]] = {"driver": "cli.main", "worker": "engines.worker", "method": "guest.child"}
    options = ("--jobs", "2")

    def __init__(self, folder: Path, dice: random.Random) -> None:
        self.folder, self._dice = folder, dice
        self.environment = {**os.environ, "TMPDIR": str(folder / "scratch"), "PYTHONPATH": str(ROOT / "src")}

    @property
    def victims(self) -> list[str]:
        """The names of all that can be killed."""
        return [*self.kinds, "group"]

    def start(self, verb: str, *words: str) -> subprocess.Popen[bytes]:
        """`taskslam campaign VERB WORDS`, in a group of its own; what it says is in the file `log`."""
        command = [sys.executable, "-c", "from taskslam.cli.main import main; main()", "campaign", verb, *words]
        with (self.folder / "log").open("wb") as log:
            return subprocess.Popen(
                command, stdout=log, stderr=log, cwd=self.folder, env=self.environment, start_new_session=True
            )

    def kill(self, victim: str) -> bool:
        """Kill one process of the campaign, or all of them (`group`); whether there was one."""
        found = [pid for pid in self.processes() if self.kinds.get(victim, "") in command_of(pid)]
        chosen = found if victim == "group" or not found else [self._dice.choice(found)]
        for pid in chosen:
            kill(pid)
        return bool(chosen)

    def is_over(self, campaign: subprocess.Popen[bytes]) -> bool:
        """Whether nothing of it is left to be killed."""
        return campaign.poll() is not None

    def wait(self, campaign: subprocess.Popen[bytes], killed: bool) -> int:  # noqa: ARG002 others must know
        """Until all that was started has ended: 0 if the campaign is at its end, 3 if it is to be started again."""
        status = campaign.wait(_LONGEST_S)
        return 3 if status == -signal.SIGKILL else status

    def processes(self) -> list[int]:
        """All of the campaign, wherever they were started from."""
        mark = str(self.folder).encode()
        marked = [pid for pid in pids() if mark in environment_of(pid)]
        return [pid for pid in marked if any(word in command_of(pid) for word in _OF_A_CAMPAIGN)]


class Slurm(Local):
    """A cluster of one node: the command submits and ends, and the queue is waited for."""

    kinds: ClassVar[dict[str, str]] = {
        "command": "cli.main",
        "task": "slurm_task",
        "worker": "engines.worker",
        "method": "guest.child",
    }
    options = ("--engine", "slurm")

    def __init__(self, folder: Path, dice: random.Random, cluster: Cluster) -> None:
        super().__init__(folder, dice)
        self._cluster = cluster
        self.environment |= {"SLURM_CONF": cluster.environment["SLURM_CONF"]}

    @property
    def victims(self) -> list[str]:
        """With slurmd, after which the node is taken for dead, or is not."""
        return [*super().victims, "slurmd", "slurmd and node"]

    def kill(self, victim: str) -> bool:
        """Kill; a slurmd is back after a moment."""
        if not victim.startswith("slurmd"):
            return super().kill(victim)
        self._cluster.kill_node()
        if victim == "slurmd":
            time.sleep(self._dice.uniform(0.0, 3.0))
            self._cluster.start_node()
        else:
            self._cluster.take_for_dead()
            time.sleep(self._dice.uniform(0.0, 3.0))
            self._cluster.take_back()
        return True

    def is_over(self, campaign: subprocess.Popen[bytes]) -> bool:
        """Whether the command has ended, and what it submitted."""
        return campaign.poll() is not None and not self.processes() and not self._cluster.queue()

    def wait(self, campaign: subprocess.Popen[bytes], killed: bool) -> int:
        """Until nothing waits or runs; then what is finished is collected, which says whether all is."""
        submitted = campaign.wait(_LONGEST_S)
        if submitted not in {0, -signal.SIGKILL}:
            return submitted
        with contextlib.suppress(AssertionError):
            wait_for(lambda: not self._cluster.queue(), _LONGEST_S)
        wait_for(lambda: not self.processes(), _LONGEST_S)
        collected = self.start("collect", "out").wait(_LONGEST_S)
        return {0: 0, 1: 3}.get(collected, 3 if killed else collected)


class Ray(Local):
    """A head and two machines of one core each."""

    kinds: ClassVar[dict[str, str]] = {
        "driver": "cli.main",
        "task": "_drive_there",
        "worker": "engines.worker",
        "method": "guest.child",
    }

    def __init__(self, folder: Path, dice: random.Random, cluster: Any) -> None:
        super().__init__(folder, dice)
        self._cluster = cluster
        self._machines = [add_machine(cluster) for _ in range(2)]
        self.options = ("--engine", "ray", "--address", cluster.address)

    @property
    def victims(self) -> list[str]:
        """With a whole machine, in whose place a new one comes."""
        return [*super().victims, "raylet"]

    def kill(self, victim: str) -> bool:
        """Kill; of a machine, all that is Ray's there."""
        if victim != "raylet":
            return super().kill(victim)
        lost = self._dice.randrange(len(self._machines))
        lose_machine(self._cluster, self._machines[lost])
        self._machines[lost] = add_machine(self._cluster)
        return True


@contextlib.contextmanager
def engine_of(name: str, folder: Path, dice: random.Random) -> Iterator[Local]:
    """One of them by its name, its cluster started. Raises SystemExit where that cannot be."""
    if name == "local":
        yield Local(folder, dice)
    elif name == "slurm":
        if words := missing():
            raise SystemExit(f"--engine slurm {words}")
        with tempfile.TemporaryDirectory(prefix="slurm-") as place, slurm(Path(place)) as cluster:
            yield Slurm(folder, dice, cluster)
    else:
        os.environ |= Local(folder, dice).environment  # machines hand theirs on to what they drive
        tempfile.tempdir = str(folder.parent)  # but Ray's own files lie elsewhere
        with ray_cluster() as cluster:
            yield Ray(folder, dice, cluster)


def pids() -> list[int]:
    """Of all processes."""
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]


def command_of(pid: int) -> str:
    """Its command line; empty if it is gone."""
    return _read(pid, "cmdline").replace(b"\0", b" ").decode(errors="replace")


def environment_of(pid: int) -> bytes:
    """Its environment, if it may be seen."""
    return _read(pid, "environ") if pid != os.getpid() else b""


def kill(pid: int) -> None:
    """At once, if it is still there."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def _read(pid: int, name: str) -> bytes:
    try:
        return Path(f"/proc/{pid}/{name}").read_bytes()
    except OSError:
        return b""
