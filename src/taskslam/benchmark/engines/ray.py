"""The engine of a Ray cluster: runs are tasks with the cores and memory that they ask for; no file system is shared.

What a tour needs of the user's files travels once to each machine, by the hash of its content (`luggage.py`); a run
comes back as one archive, and is put in its place here when it is what run.json says. A task whose machine is lost is
driven again elsewhere. The machines need the same taskslam as this one, which is looked at first.
"""

from __future__ import annotations

import io
import os
import signal
import tarfile
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.luggage import Parcel, pack, unpack
from taskslam.benchmark.engines.supervised import Order, Workers, drive, kept, without_driving
from taskslam.benchmark.one_processor import check_processor
from taskslam.benchmark.resources import Resources
from taskslam.benchmark.run import finished_run, machine
from taskslam.benchmark.sealing import salt_of
from taskslam.benchmark.spec import BEHAVIOUR, RunSpec, run_folder
from taskslam.errors import InfrastructureError, InputError, RecordError, TaskSlamError
from taskslam.processes.patience import Patience
from taskslam.processes.scratch import Scratch
from taskslam.record import load_run
from taskslam.record.place import is_plain, whole_folder
from taskslam.slam.guest.latency import LatencyMode
from taskslam.version import __version__

_RETRIES = 5  # of a task whose machine or process is lost
_LISTENING_S = 1.0  # between two looks at what has come
_NOTICING_S = 30.0  # until a machine that is lost is known to be


@dataclass(frozen=True)
class _Answer:
    """What a task brings back. archive: of the run directory, empty where there is none."""

    ending: Ending
    detail: str
    machine: str
    archive: bytes = b""


@dataclass(frozen=True)
class RayEngine:
    """address: of the cluster, empty for one on this machine alone; cores: of that one.

    folders: where worlds and maps lie on this machine. resources: of a run.
    """

    address: str = ""
    cores: int | None = None
    folders: tuple[Path, ...] = ()
    resources: Resources = field(default_factory=Resources)

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Generator[Result, None, None]:
        """As `Engine.run`. Raises InputError: ray is not installed, or machines differ in what is to be the same."""
        known = {spec.digest: result for spec in specs if (result := kept(spec, out)) is not None}
        with _connected(self.address, self.cores) as ray:
            processors = _machines(ray)
            tasks: dict[Any, RunSpec] = {}
            parcels: dict[str, Any] = {}
            for spec in specs:
                if spec.digest in known:
                    continue
                try:
                    _check_latency(spec, out, processors)
                    tasks[self._submitted(ray, spec, out, parcels)] = spec
                except TaskSlamError as error:
                    failed = isinstance(error, InfrastructureError)
                    ending = Ending.FAILED if failed else Ending.REFUSED
                    known[spec.digest] = Result(spec.title, ending, str(error), spec)
            for result in known.values():
                watcher.ends(result)
            waiting = list(specs)
            while waiting:
                while waiting and waiting[0].digest in known:
                    yield known[waiting.pop(0).digest]
                done, _ = ray.wait(list(tasks), timeout=_LISTENING_S) if tasks else ([], [])
                for task in done:
                    spec = tasks.pop(task)
                    known[spec.digest] = result = _received(ray, task, spec, out)
                    watcher.ends(result)

    def _submitted(self, ray: Any, spec: RunSpec, out: Path, parcels: dict[str, Any]) -> Any:
        """A task that drives this run, somewhere."""
        tour = spec.task_digest
        if tour not in parcels:
            parcels[tour] = ray.put(pack(spec, self.folders))
        share = self.resources.of(spec.method)
        task = ray.remote(_drive_there).options(
            num_cpus=share.cores, memory=share.memory_bytes, max_retries=_RETRIES, name=spec.title
        )
        salt = salt_of(out, spec.digest) if spec.sealed else None
        return task.remote(spec.to_json(), share.cores, salt, parcels[tour])


def _drive_there(text: str, cores: int, salt: str | None, parcel: Parcel | None) -> dict[str, Any]:
    """On some machine: drive a run in a worker process and pack what it leaves."""
    spec = RunSpec.from_json(text)
    workers = Workers()
    with Scratch("ray") as scratch:
        out = scratch.folder
        try:
            order = Order(spec, out, unpack(parcel) if parcel else (), cores, salt=salt)
            result = without_driving(spec, out) or drive(order, Watcher(), workers)
        except TaskSlamError as error:
            result = Result(spec.title, Ending.FAILED, str(error), spec)
        except BaseException:
            workers.stop()
            raise
        directory = run_folder(out, spec)
        archive = _packed(directory) if finished_run(directory, spec) is not None else b""
    return asdict(_Answer(result.ending, result.detail, os.uname().nodename, archive))


def _packed(directory: Path) -> bytes:
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode="w:gz", compresslevel=3) as archive:
        archive.add(directory, arcname=".")
    return data.getvalue()


def _received(ray: Any, task: Any, spec: RunSpec, out: Path) -> Result:
    """What a task brought, its run in its place."""
    try:
        answer = _Answer(**ray.get(task))
    except ray.exceptions.RayError as error:
        why = " ".join(str(error).split())[:500] or type(error).__name__
        return Result(spec.title, Ending.FAILED, f"Ray gave it up after {_RETRIES} tries: {why}", spec)
    ending, detail = Ending(answer.ending), answer.detail
    if detail:
        detail = f"{detail} (on {answer.machine})"
    if answer.archive:
        try:
            _unpacked(answer.archive, spec, out)
        except TaskSlamError as error:
            return Result(spec.title, Ending.FAILED, str(error), spec)
    return Result(spec.title, Ending.COMPLETE if ending is Ending.KEPT else ending, detail, spec)


def _unpacked(archive: bytes, spec: RunSpec, out: Path) -> None:
    """Put a run that travelled into its place, whole and what it says, or not at all.

    Raises RecordError: it is not what it says; DiskFullError.
    """
    directory = run_folder(out, spec)
    with whole_folder(directory) as folder:
        try:
            with tarfile.open(fileobj=io.BytesIO(archive), mode="r:gz") as packed:
                packed.extractall(folder, filter="data")
        except tarfile.TarError as error:
            raise RecordError(f"{directory}: what came back is no archive of a run: {error}") from None
        if not is_plain(folder) or finished_run(folder, spec) is None or load_run(folder, damaged=True).changed:
            raise RecordError(f"{directory}: what came back is not a whole run of this configuration")


def _check_latency(spec: RunSpec, out: Path, processors: Sequence[str]) -> None:
    """Raise InputError where latency is measured and machines, or earlier runs, are of several processors."""
    if spec.latency.mode is LatencyMode.MEASURED and len(processors) > 1:
        raise InputError(
            f"{spec.title}: latency is measured, and the machines have different processors ({', '.join(processors)}):"
            " expected machines of one kind"
        )
    check_processor(spec, out, processors[0])


def _about() -> tuple[str, str, int, str]:
    return os.uname().nodename, __version__, BEHAVIOUR, machine()["processor"]


def _machines(ray: Any) -> list[str]:
    """The processors of the cluster. Raises InputError: a machine without this taskslam.

    One that is lost before it has answered is none of the cluster any more.
    """
    strategy = ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy
    nodes = _alive(ray)
    asked = [
        ray.remote(_about)
        .options(num_cpus=0, scheduling_strategy=strategy(node["NodeID"], soft=False), max_retries=0)
        .remote()
        for node in nodes
    ]
    processors = []
    for node, answer in zip(nodes, asked, strict=True):
        try:
            name, version, behaviour, processor = ray.get(answer)
        except ray.exceptions.RayError as error:
            if not isinstance(error, ray.exceptions.RayTaskError) and not _stays(ray, node):
                continue
            why = " ".join(str(error).split())[-300:]
            raise InputError(f"{node['NodeManagerHostname']}: taskslam cannot be run there: {why}") from None
        if (version, behaviour) != (__version__, BEHAVIOUR):
            raise InputError(f"{name}: has taskslam {version}, and this machine {__version__}; expected the same")
        processors.append(processor)
    if not processors:
        raise InfrastructureError("the Ray cluster has no machine with a processor")
    return list(dict.fromkeys(processors))


def _alive(ray: Any) -> list[Any]:
    """The machines that can drive."""
    return [node for node in ray.nodes() if node["Alive"] and node["Resources"].get("CPU")]


def _stays(ray: Any, node: Any) -> bool:
    """Whether a machine that gave no answer is there all the same: Ray takes a while to find out that it is not."""
    patience = Patience(_NOTICING_S)
    while patience.look():
        if node["NodeID"] not in {one["NodeID"] for one in _alive(ray)}:
            return False
        time.sleep(_LISTENING_S)
    return True


@contextmanager
def _connected(address: str, cores: int | None) -> Iterator[Any]:
    """Ray, connected to the cluster or to one on this machine; signals stay ours."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is told to anybody
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        import ray
        import ray.util.scheduling_strategies
    except ModuleNotFoundError:
        raise InputError("--engine ray: ray is not installed: pip install 'taskslam[ray]'") from None
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        if address:
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        else:
            ray.init(num_cpus=cores, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    except (ConnectionError, RuntimeError, ValueError) as error:
        why = " ".join(str(error).split())[:300]
        raise InputError(f"--address {address}: no Ray cluster answers there: {why}") from None
    try:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        yield ray
    finally:
        ray.shutdown()
