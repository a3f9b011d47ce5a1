"""Which SLAM methods exist: entry points of the group `taskslam.methods`, from this package or anyone else's.

A name of the form `package.module:Class` is taken as it is, for experiments that are not installed. `ros:NODE.yaml` is
somebody's ROS node as its node file describes it (`ros/node_file.py`), `ros:NAME` one whose file ships.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from taskslam.errors import MethodUnavailableError, UnknownMethodError, did_you_mean
from taskslam.plugins import registered
from taskslam.slam.base import MethodCard

GROUP = "taskslam.methods"
_ROS = "ros:"
_ROS_NODE = "taskslam.ros.method:method_of"
_YAML = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class MethodEntry:
    """A registered method. target: `package.module:Class`; distribution: the installed package that registers it.

    argument: of a method that a file describes, that file; the target then makes the class from it.
    """

    name: str
    target: str
    distribution: str
    argument: str = ""

    @property
    def file(self) -> Path | None:
        """The user's own file that describes it, if one does."""
        return Path(self.argument) if self.argument.endswith(_YAML) else None


def registered_methods() -> dict[str, MethodEntry]:
    """All registered methods by name, sorted. Nothing is imported."""
    return {
        name: MethodEntry(name, entry.value, entry.dist.name if entry.dist is not None else "")
        for name, entry in registered(GROUP).items()
    }


def find_method(name: str) -> MethodEntry:
    """The entry of a registered name, of a `package.module:Class`, or of a `ros:NODE.yaml`.

    Raises:
        UnknownMethodError: neither; lists the known names.
    """
    if name.startswith(_ROS):
        argument = name.removeprefix(_ROS)
        if argument.endswith(_YAML):  # its process works in another folder
            argument = str(Path(argument).absolute())
        return MethodEntry(_ROS + argument, _ROS_NODE, "", argument)
    methods = registered_methods()
    if name in methods:
        return methods[name]
    if re.fullmatch(r"[\w.]+:\w+", name):
        return MethodEntry(name, name, "")
    known = ", ".join(methods) or "none"
    raise UnknownMethodError(f"no SLAM method is called '{name}' (known: {known}).{did_you_mean(name, methods)}")


def is_local(name: str) -> bool:
    """Whether a method's code is the user's own, and may lie where the user works."""
    return ":" in name and not name.startswith(_ROS)


def unavailable(name: str, card: MethodCard, error: ModuleNotFoundError) -> MethodUnavailableError:
    """The error for a method that imported, but whose package turned out to be absent when it was needed."""
    return MethodUnavailableError(absent(find_method(name), error.name or str(error), card.extra))


def one_line(error: BaseException) -> str:
    """`ValueError: the last line of its message`, at most 300 characters."""
    lines = str(error).strip().splitlines()
    return f"{type(error).__name__}: {lines[-1].strip()}"[:300] if lines else type(error).__name__


def install_command(entry: MethodEntry, extra: str | None) -> str:
    """The command that installs what a method needs."""
    distribution = entry.distribution or "taskslam"
    return f"pip install '{distribution}[{extra}]'" if extra else f"pip install '{distribution}'"


def absent(entry: MethodEntry, missing: str, extra: str | None) -> str:
    """That a method's package is not installed, and how to get it."""
    extra = extra or _extra_for(entry, missing)
    if extra is None:
        return f"method '{entry.name}' needs the package '{missing}', which is not installed"
    return (
        f"method '{entry.name}' needs the package '{missing}', which is not installed; it comes with the extra "
        f"'{extra}': {install_command(entry, extra)}"
    )


def missing_of_extra(entry: MethodEntry, extra: str | None) -> str:
    """Why a method is not available: the packages of its extra that are not installed; empty if all are."""
    if extra is None:
        return ""
    for package, marker in _packages_of_extra(entry).get(extra, {}).items():
        try:
            metadata.version(package)
        except metadata.PackageNotFoundError:
            where = f" (only for {marker})" if marker else ""
            return f"needs {package}{where}: {install_command(entry, extra)}"
    return ""


def _packages_of_extra(entry: MethodEntry) -> Mapping[str, Mapping[str, str]]:
    """Per extra of the method's distribution: its packages, each with the environment marker that bounds it."""
    try:
        requirements = metadata.requires(entry.distribution or "taskslam") or []
    except metadata.PackageNotFoundError:
        return {}
    found: dict[str, dict[str, str]] = {}
    for requirement in requirements:
        package = re.match(r"[A-Za-z0-9._-]+", requirement)
        extra = re.search(r"extra\s*==\s*['\"]([^'\"]+)['\"]", requirement)
        if package and extra:
            marker = requirement.partition(";")[2].replace(extra.group(0), "").strip().removesuffix("and")
            found.setdefault(extra.group(1), {})[package.group(0)] = marker.strip().strip("()").strip()
    return found


def _extra_for(entry: MethodEntry, module: str) -> str | None:
    """The extra whose packages seem to hold a module: by name, as `yag_slam` and `yag-slam`."""
    wanted = module.partition(".")[0].replace("_", "-").lower()
    for extra, packages in _packages_of_extra(entry).items():
        if wanted in {package.replace("_", "-").lower() for package in packages}:
            return extra
    return None
