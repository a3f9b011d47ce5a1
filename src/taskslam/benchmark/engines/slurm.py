"""The engine of a cluster with Slurm: array jobs with one run a task are submitted, and that is all; no daemon of ours.

    OUT/campaign/slurm/001/job.sh        a plain script for sbatch
                           specs.jsonl   a run a line, as many as tasks
                           job           the number that Slurm gave it, for people
                           task-N.txt    what a task said

A task (`slurm_task.py`) leaves its run where every engine leaves it, so whoever sees the folder can collect. One that
is preempted or requeued goes on after the rounds that had ended. Nobody needs locks that two machines see: Slurm starts
each task once at a time, and of two starts the later one takes over (`record/run_directory.py`).
"""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from taskslam.benchmark.campaign.plan_file import campaign_folder
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.supervised import kept
from taskslam.benchmark.resources import Resources, Share
from taskslam.benchmark.spec import RunSpec
from taskslam.errors import InfrastructureError, InputError, RecordError
from taskslam.files import write_whole, writing
from taskslam.reading import LARGEST_JOURNAL, read_text

SPECS, JOB = "specs.jsonl", "job"
_MOST_TASKS = 1000  # of an array; Slurm's own default bound is 1001
_PATIENCE_S = 120.0  # for an answer of Slurm's
_SCRIPT = """\
#!/bin/bash
#SBATCH --job-name=taskslam
#SBATCH --array=0-{last}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cores}
#SBATCH --mem={megabytes}M
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=task-%a.txt
# One run a task: that in line SLURM_ARRAY_TASK_ID (from 0) of specs.jsonl. Submit from the folder of this script.
cd {here} || exit 3
exec {python} -m taskslam.benchmark.engines.slurm_task {folder}
"""


@dataclass(frozen=True)
class SlurmEngine:
    """folders: where worlds and maps lie, as the nodes see them. options: of sbatch, beside what a job needs."""

    folders: tuple[Path, ...] = ()
    resources: Resources = field(default_factory=Resources)
    options: tuple[str, ...] = ()

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Generator[Result, None, None]:
        """As `Engine.run`, but what is not finished is submitted, unless a job that waits or runs holds it already.

        Raises InputError if there is no Slurm here, or it refuses the job; InfrastructureError if it does not answer.
        """
        finished = {spec.digest: result for spec in specs if (result := kept(spec, out)) is not None}
        queued = _queued(out) if len(finished) < len(specs) else {}
        new = [spec for spec in specs if spec.digest not in finished.keys() | queued.keys()]
        for share, group in _by_share(new, self.resources).items():
            for first in range(0, len(group), _MOST_TASKS):
                queued |= self._submit(group[first : first + _MOST_TASKS], share, out)
        for spec in specs:
            result = finished.get(spec.digest) or Result(spec.title, Ending.SUBMITTED, queued[spec.digest], spec)
            watcher.ends(result)
            yield result

    def _submit(self, specs: Sequence[RunSpec], share: Share, out: Path) -> dict[str, str]:
        """Submit one array; the names of its tasks by the digests of the specs."""
        folder = _new_folder(out)
        try:
            write_whole(folder / SPECS, (json.dumps(self._task(spec, out)) + "\n" for spec in specs))
            script = _SCRIPT.format(
                last=len(specs) - 1,
                cores=share.cores,
                megabytes=round(share.memory * 1024),
                here=shlex.quote(str(Path.cwd())),
                python=shlex.quote(sys.executable),
                folder=shlex.quote(str(folder)),
            )
            write_whole(folder / "job.sh", script)
            job = _ask("sbatch", "--parsable", *self.options, "job.sh", folder=folder).strip().partition(";")[0]
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)  # what was not submitted is no job
            raise
        write_whole(folder / JOB, job + "\n")
        return {spec.digest: f"job {job}_{task}" for task, spec in enumerate(specs)}

    def _task(self, spec: RunSpec, out: Path) -> dict[str, object]:
        """What a task must know."""
        return {
            "spec": spec.to_json(),
            "out": str(out.absolute()),
            "folders": [str(folder.absolute()) for folder in self.folders],
            "cores": self.resources.of(spec.method).cores,
        }


def jobs_folder(out: Path) -> Path:
    """Where scripts and logs stand."""
    return campaign_folder(out) / "slurm"


def _queued(out: Path) -> dict[str, str]:
    """Names of the tasks that wait or run, by the digests of their specs.

    Slurm itself says which folder a job is of: who submitted it may have been killed before he wrote down its number.
    """
    folders = {str(file.parent.resolve()) for file in jobs_folder(out).glob(f"*/{SPECS}")}
    if not folders:
        return {}
    alive: dict[str, dict[int, str]] = {}
    for line in _ask("squeue", "--noheader", "--array", "--format=%F %K %Z").splitlines():
        job, task, folder = line.strip().split(" ", 2)
        if folder in folders and task.isdecimal():
            alive.setdefault(folder, {})[int(task)] = f"job {job}_{task}"
    found = {}
    for folder, tasks in alive.items():
        lines = read_text(Path(folder) / SPECS, "job's specs", RecordError, LARGEST_JOURNAL).splitlines()
        for number, line in enumerate(lines):
            if number in tasks:
                found[RunSpec.from_json(json.loads(line)["spec"]).digest] = tasks[number]
    return found


def _by_share(specs: Sequence[RunSpec], resources: Resources) -> dict[Share, list[RunSpec]]:
    groups: dict[Share, list[RunSpec]] = {}
    for spec in specs:
        groups.setdefault(resources.of(spec.method), []).append(spec)
    return groups


def _new_folder(out: Path) -> Path:
    """The next by number; whoever makes it has it, also among several machines."""
    jobs = jobs_folder(out.absolute())
    with writing(jobs):
        jobs.mkdir(parents=True, exist_ok=True)
        number = 1 + max((int(path.name) for path in jobs.iterdir() if path.name.isdecimal()), default=0)
        while True:
            try:
                (jobs / f"{number:03d}").mkdir()
            except FileExistsError:
                number += 1
            else:
                return jobs / f"{number:03d}"


def _ask(program: str, *arguments: str, folder: Path | None = None) -> str:
    try:
        done = subprocess.run(  # noqa: S603 the cluster's own commands
            [program, *arguments], cwd=folder, capture_output=True, text=True, timeout=_PATIENCE_S, check=False
        )
    except FileNotFoundError:
        raise InputError(f"{program} is not on this machine; expected a machine from which Slurm takes jobs") from None
    except subprocess.TimeoutExpired:
        raise InfrastructureError(f"{program}: Slurm did not answer within {_PATIENCE_S:.0f} s") from None
    if done.returncode:
        said = " ".join(done.stderr.split())[:500] or f"status {done.returncode}"
        raise InputError(f"{program}: {said}")
    return done.stdout
