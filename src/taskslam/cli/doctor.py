"""`taskslam doctor`: what works on this machine, what is missing, and the command that would install it."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import typer

from taskslam.cli.console import standard_output

_CORE = ("numpy", "scipy", "numba", "embreex", "trimesh", "pycollada", "gtsam", "pydantic", "matplotlib", "rosbags")
_TAGS = ("apriltag-python", "opencv-python-headless")
_MANY_RUNS = {"polars": "runs", "ray": "ray"}  # packages, by the extras that bring them
_IMPORTS = {"pycollada": "collada", "apriltag-python": "apriltag", "opencv-python-headless": "cv2"}
_OWN_VARIABLES = ("TASKSLAM_", "PYORBSLAM3_")
_SUPPORTED = ((3, 11), (3, 13))
_ENOUGH_DISK_GB = 2.0
_ENOUGH_MEMORY_GB = 4.0


class Health(StrEnum):
    """Good; worth knowing; or in the way of the main job."""

    GOOD = "ok"
    NOTE = "note"
    BAD = "missing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at. remedy: what to do about it, or empty."""

    what: str
    health: Health
    detail: str
    remedy: str = ""


def doctor() -> None:
    """Say what works on this machine, what is missing and how to get it; exit status 3 if the main job cannot run."""
    from rich.table import Table
    from rich.text import Text

    colours = {Health.GOOD: "green", Health.NOTE: "yellow", Health.BAD: "bold red"}
    console = standard_output()
    findings = [
        *machine(),
        *wall(),
        *core_packages(),
        *tag_packages(),
        *many_runs(),
        *methods(),
        *sensors(),
        *system_libraries(),
        *environment(),
    ]
    width = max(len(finding.what) for finding in findings)
    for finding in findings:
        line = Table.grid(padding=(0, 2))
        line.add_column(width=7)
        line.add_column(width=width)
        line.add_column()
        health = Text(finding.health, colours[finding.health])
        line.add_row(health, Text(finding.what, "bold"), Text(finding.detail))
        console.print(line)
        if finding.remedy:
            console.print(f"{'':9}{'':{width}}  → {finding.remedy}", soft_wrap=True)  # whole: it is copied
    bad = sum(finding.health is Health.BAD for finding in findings)
    console.print(f"\n{bad} in the way of the main job." if bad else "\nThe main job can run here: taskslam demo")
    if bad:
        raise typer.Exit(3)


def machine() -> list[Finding]:
    """Python, operating system, cores, memory and disk."""
    version = platform.python_version()
    low, high = _SUPPORTED
    supported = low <= sys.version_info[:2] <= high
    expected = f"CPython {low[0]}.{low[1]} to {high[0]}.{high[1]}"
    linux = sys.platform == "linux"
    system = (
        f"{platform.system()} {platform.machine()}, {len(os.sched_getaffinity(0)) if linux else os.cpu_count()} cores"
    )
    free = shutil.disk_usage(Path.cwd()).free / 1e9
    findings = [
        Finding(
            "python", Health.GOOD if supported else Health.BAD, version, "" if supported else f"install {expected}"
        ),
        Finding(
            "machine", Health.GOOD if linux else Health.BAD, system, "" if linux else "methods are hosted on Linux"
        ),
        Finding(
            "disk",
            Health.GOOD if free > _ENOUGH_DISK_GB else Health.NOTE,
            f"{free:.1f} GB free in this folder",
            "" if free > _ENOUGH_DISK_GB else f"results and caches may need {_ENOUGH_DISK_GB:g} GB",
        ),
    ]
    if linux:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
        enough = memory > _ENOUGH_MEMORY_GB
        remedy = "" if enough else f"large worlds may need {_ENOUGH_MEMORY_GB:g} GB"
        findings.append(Finding("memory", Health.GOOD if enough else Health.NOTE, f"{memory:.1f} GB", remedy))
    return findings


def wall() -> list[Finding]:
    """What of the wall around methods holds under this kernel (docs/decisions/004)."""
    from taskslam.processes import landlock
    from taskslam.processes.confine import can_have_private_shared_memory

    open_to_all = "UDP, the names of files whose path is known, and their modes stay open"
    if not landlock.is_available():
        remedy = "a kernel of 5.13 or later, with landlock among its security modules; --sealed needs it"
        detail = "no Landlock: a method that goes looking could read results and write anywhere"
        return [Finding("wall", Health.NOTE, detail, remedy)]
    files = f"Landlock {landlock.version()}: methods read packages and system libraries, and write their scratch folder"
    findings = [Finding("wall", Health.GOOD, f"{files}; {open_to_all}")]
    for what, holds, needs in (
        ("TCP is closed to methods", landlock.closes_tcp(), "6.7"),
        ("signals and abstract sockets are closed to methods", landlock.closes_signals(), "6.12"),
    ):
        words = what if holds else what.replace("are closed", "are open").replace("is closed", "is open")
        remedy = "" if holds else f"a kernel of {needs} or later"
        findings.append(Finding("wall", Health.GOOD if holds else Health.NOTE, words, remedy))
    private = can_have_private_shared_memory()
    words = "of its own" if private else "the machine's: this user may make no mount namespace"
    shared = f"a method that declares shared memory gets a /dev/shm, {words}"
    return [*findings, Finding("wall", Health.GOOD if private else Health.NOTE, shared)]


def core_packages() -> list[Finding]:
    """Whether each package that the main job needs is installed and can be imported."""
    return [_package(name) for name in _CORE]


def _package(name: str) -> Finding:
    import importlib
    from importlib import metadata

    try:
        version = metadata.version(name)
        importlib.import_module(_IMPORTS.get(name, name))
    except metadata.PackageNotFoundError:
        return Finding(name, Health.BAD, "not installed", f"pip install {name}")
    except Exception as error:
        return Finding(name, Health.BAD, f"cannot be imported: {error}", f"pip install --force-reinstall {name}")
    return Finding(name, Health.GOOD, version)


def tag_packages() -> list[Finding]:
    """What measuring with AprilTags needs: an extra, so its absence is no harm."""
    return [_of_an_extra(name, "apriltag") for name in _TAGS]


def many_runs() -> list[Finding]:
    """What tables of runs and clusters need: polars and ray are extras, and Slurm is there or is not."""
    packages = [_of_an_extra(name, extra) for name, extra in _MANY_RUNS.items()]
    where = shutil.which("sbatch")
    if where is None:
        detail = "no sbatch: campaigns are submitted from a machine of the cluster"
        return [*packages, Finding("slurm", Health.NOTE, detail)]
    return [*packages, Finding("slurm", Health.GOOD, f"{where} submits campaigns")]


def _of_an_extra(name: str, extra: str) -> Finding:
    """A package whose absence is no harm to the main job."""
    found = _package(name)
    if found.health is Health.GOOD:
        return found
    return replace(found, health=Health.NOTE, remedy=f"pip install 'taskslam[{extra}]'")


def methods() -> list[Finding]:
    """Each registered method: available, or which command would make it so."""
    from taskslam.slam.cards import inspect_methods

    findings = []
    for state in inspect_methods():
        problem, _, command = state.problem.rpartition(": ")
        what = f"method {state.entry.name}"
        if not state.problem:
            assert state.card is not None
            findings.append(Finding(what, Health.GOOD, f"{state.card.kind}, {state.card.licence}"))
        elif command.startswith("pip install"):
            findings.append(Finding(what, Health.NOTE, problem, command))
        else:
            findings.append(Finding(what, Health.NOTE, state.problem))
    return findings


def sensors() -> list[Finding]:
    """Each kind of sensor that another package registers: known by which words, or why it cannot be loaded."""
    from taskslam.errors import InputError
    from taskslam.plugins import registered
    from taskslam.robot import SENSOR_GROUP
    from taskslam.sensors import sensor_kind

    findings = []
    for name in registered(SENSOR_GROUP):
        try:
            findings.append(Finding(f"sensor {name}", Health.GOOD, sensor_kind(name).words))
        except InputError as error:
            findings.append(Finding(f"sensor {name}", Health.NOTE, str(error)))
    return findings


def system_libraries() -> list[Finding]:
    """Libraries of the system that installed methods take for granted."""
    from importlib.util import find_spec

    from taskslam.slam.orb.system_libraries import LIBRARIES, install_command, missing_libraries

    if find_spec("pyorbslam3") is None:
        return []
    what = "orb_slam3 libraries"
    if missing := missing_libraries():
        return [
            Finding(what, Health.NOTE, f"orb_slam3 cannot start without {', '.join(missing)}", install_command(missing))
        ]
    return [Finding(what, Health.GOOD, f"all {len(LIBRARIES)} system libraries of pyorbslam3")]


def environment() -> list[Finding]:
    """The variables that change what the benchmark does, and whether the folders that they name exist."""
    findings = []
    names = sorted(
        {"GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", *(k for k in os.environ if k.startswith(_OWN_VARIABLES))}
    )
    for name in names:
        value = os.environ.get(name, "")
        if not value:
            continue
        entries = [entry for entry in value.split(os.pathsep) if "/" in entry]
        absent = [entry for entry in entries if not Path(entry).exists()]
        remedy = f"there is no {', '.join(absent)}" if absent else ""
        findings.append(Finding(name, Health.NOTE if absent else Health.GOOD, value, remedy))
    return findings
