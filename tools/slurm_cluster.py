"""Slurm on this one machine: Debian's munged, slurmctld and slurmd in a folder of their own, without systemd.

For tests and for `torture.py`.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

PACKAGES = (Path(__file__).parents[1] / "tests/benchmark/campaign/debian_packages.txt").read_text().split()
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol")
CONFIGURATION = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
SlurmctldPort={controller}
SlurmdPort={node}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
KillWait=10
JobRequeue=1
MaxArraySize=1001
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=8000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


class Cluster:
    """The three daemons, and commands that talk to them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        self.node = socket.gethostname().partition(".")[0]
        self._daemons: dict[str, subprocess.Popen[bytes]] = {}

    def start(self) -> None:
        """Write the configuration and start all three."""
        for name in ("munge", "state", "spool"):
            (self.folder / name).mkdir(mode=0o755)
        key = self.folder / "munge" / "key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        ports = {"controller": free_port(), "node": free_port()}
        text = CONFIGURATION.format(host=self.node, folder=self.folder, cores=os.cpu_count(), **ports)
        (self.folder / "slurm.conf").write_text(text)
        munge = self.folder / "munge"
        self._start(
            "munged", "--foreground", "--force", f"--socket={munge}/socket", f"--key-file={key}",
            f"--pid-file={munge}/pid", f"--log-file={munge}/log", f"--seed-file={munge}/seed",
        )  # fmt: skip
        wait_for((munge / "socket").exists)
        self._start("slurmctld", "-D", "-c")
        self.start_node()
        wait_for(lambda: "idle" in self.ask("sinfo", "--noheader", "--format=%T", check=False))

    def start_node(self) -> None:
        """Start slurmd."""
        self._start("slurmd", "-D", "-c")

    def kill_node(self) -> None:
        """Kill slurmd at once. What it has started goes on, as on a node that was cut off."""
        node = self._daemons.pop("slurmd")
        node.kill()
        node.wait()

    def take_for_dead(self) -> None:
        """Declare the node down, so that what it was at is started again elsewhere: here, once it is back."""
        self.ask("scontrol", "update", f"nodename={self.node}", "state=down", "reason=test")

    def take_back(self) -> None:
        """Start slurmd on the node that was taken for dead."""
        self.start_node()
        self.ask("scontrol", "update", f"nodename={self.node}", "state=resume", check=False)

    def ask(self, *command: str, check: bool = True) -> str:
        """What one of Slurm's commands says."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=60, check=False)
        assert not check or done.returncode == 0, f"{command}: {done.stderr}"
        return done.stdout

    def queue(self) -> list[str]:
        """Tasks that wait or run: `number state`."""
        return self.ask("squeue", "--noheader", "--array", "--format=%K %T").splitlines()

    def stop(self) -> None:
        """End jobs and daemons."""
        with contextlib.suppress(AssertionError, subprocess.TimeoutExpired):
            self.ask("scancel", "--full", "--signal=KILL", "--user=root", check=False)
            self.ask("scancel", "--user=root", check=False)
            deadline = time.monotonic() + 15
            while self.queue() and time.monotonic() < deadline:
                time.sleep(0.2)
        for name in ("slurmd", "slurmctld", "munged"):
            if (daemon := self._daemons.pop(name, None)) is not None:
                daemon.send_signal(signal.SIGTERM)
                try:
                    daemon.wait(10)
                except subprocess.TimeoutExpired:
                    daemon.kill()
                    daemon.wait()

    def logs(self) -> str:
        """What the daemons said last."""
        files = ("slurmctld.log", "slurmd.log")
        return "\n".join(line for name in files for line in (self.folder / name).read_text().splitlines()[-40:])

    def _start(self, program: str, *arguments: str) -> None:
        with (self.folder / f"{program}.out").open("wb") as out:
            self._daemons[program] = subprocess.Popen(
                [find(program), *arguments], env=self.environment, stdout=out, stderr=out, start_new_session=True
            )


def find(program: str) -> str:
    """Where it is; daemons lie outside the path of common users."""
    return shutil.which(program, path=f"{os.environ['PATH']}:/usr/sbin:/sbin") or ""


def free_port() -> int:
    """One that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(condition: Callable[[], object], seconds: float = 600.0) -> None:
    """Until it holds. Raises AssertionError if it never does."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.1)


def missing() -> str:
    """What keeps Slurm from being started here; empty if nothing does."""
    if absent := [program for program in PROGRAMS if not find(program)]:
        return f"needs {', '.join(absent)}: apt install --no-install-recommends {' '.join(PACKAGES)}"
    return "" if os.geteuid() == 0 else "needs root, as which Slurm's daemons are started"


@contextlib.contextmanager
def slurm(folder: Path) -> Iterator[Cluster]:
    """A cluster of one node; its files are in a folder that exists."""
    cluster = Cluster(folder)
    try:
        cluster.start()
        yield cluster
    finally:
        cluster.stop()
