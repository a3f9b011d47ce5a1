"""Message types that the wheels of ROS 2 lack, made by the generators that come with them, and compiled (gcc, g++).

`make_messages` leaves a folder with a `setup.bash`, which is then named wherever the setup of a ROS 2 is: under it,
our own interpreter speaks these types too. Definitions: the fields of geometry2 and navigation2, Kilted.
"""

from __future__ import annotations

import importlib
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from taskslam.errors import InputError

MISSING = {
    "tf2_msgs/msg/TFMessage.msg": "geometry_msgs/TransformStamped[] transforms\n",
    "nav2_msgs/action/NavigateToPose.action": (
        "geometry_msgs/PoseStamped pose\nstring behavior_tree\n"
        "---\nuint16 error_code\nstring error_msg\n"
        "---\ngeometry_msgs/PoseStamped current_pose\nbuiltin_interfaces/Duration navigation_time\n"
        "builtin_interfaces/Duration estimated_time_remaining\nint16 number_of_recoveries\n"
        "float32 distance_remaining\n"
    ),
}
"""By package, room and name. All that they are made of is among the wheels."""

_USED = (
    "builtin_interfaces",
    "std_msgs",
    "geometry_msgs",
    "service_msgs",
    "unique_identifier_msgs",
    "action_msgs",
)
_SUPPORT = "rosidl_typesupport_fastrtps_c"
_LIBRARIES = (
    *(f"{package}__{kind}" for package in _USED for kind in ("rosidl_generator_c", "rosidl_typesupport_c", _SUPPORT)),
    *(f"{package}__rosidl_generator_py" for package in _USED),
    "rosidl_runtime_c",
    "rosidl_typesupport_c",
    _SUPPORT,
    "rosidl_typesupport_fastrtps_cpp",
    "fastcdr",
    "rcutils",
)
_COMPILERS = {".c": ["gcc"], ".cpp": ["g++", "-std=c++17"]}


def make_messages(folder: Path, definitions: Mapping[str, str] = MISSING) -> Path:
    """Make the types in a new folder; the script that a ROS 2 is set up by.

    Raises InputError: the folder exists, the wheels or a compiler are not there, or it fails, in words.
    """
    if folder.exists():
        raise InputError(f"{folder} exists; expected the name of a new folder")
    try:
        for part in ("rosidl_adapter", "rosidl_generator_py", "rosidl_typesupport_fastrtps_c"):
            importlib.import_module(part)
    except ImportError as error:
        raise InputError(f"the wheels of ROS 2 are not installed ({error}): pip install 'taskslam[ros2]'") from error
    if absent := [words[0] for words in _COMPILERS.values() if shutil.which(words[0]) is None]:
        raise InputError(f"{' and '.join(absent)} cannot be found: apt install g++")
    folder = folder.absolute()
    for place, text in definitions.items():
        file = folder / "definitions" / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    for package in dict.fromkeys(place.partition("/")[0] for place in definitions):
        _generate(package, folder / "definitions" / package, folder / package)
        _compile(package, folder)
    setup = folder / "setup.bash"
    programs, types = shlex.quote(str(Path(sys.executable).parent)), shlex.quote(str(folder))
    setup.write_text(
        f"export ROS_DISTRO=kilted PATH={programs}:$PATH PYTHONPATH={types}${{PYTHONPATH:+:$PYTHONPATH}}\n",
        encoding="utf-8",
    )
    return setup


def _generate(package: str, definitions: Path, out: Path) -> None:
    """The sources of a package, in C and Python, by the wheels' generators."""
    os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)  # where they find their templates
    convert = {
        f".{kind}": getattr(importlib.import_module(f"rosidl_adapter.{kind}"), f"convert_{kind}_to_idl")
        for kind in ("msg", "action")
    }
    generators = [
        importlib.import_module("rosidl_generator_c.cli").GenerateC("c"),
        importlib.import_module(f"{_SUPPORT}.cli").GenerateFastRTPSCTypesupport("support"),
        importlib.import_module("rosidl_typesupport_c.cli").GenerateCTypesupport(
            "handles", typesupport_implementations=[_SUPPORT]
        ),
        importlib.import_module("rosidl_generator_py.cli").GeneratePython(
            "python", typesupport_implementations=["rosidl_typesupport_c"]
        ),
    ]
    said, made = StringIO(), []
    try:
        with redirect_stdout(said), redirect_stderr(said):
            for file in sorted(path.relative_to(definitions) for path in definitions.rglob("*.*")):
                (out / file.parent).mkdir(parents=True, exist_ok=True)
                convert[file.suffix](definitions, package, file, out / file.parent)
                made.append(f"{out}:{file.with_suffix('.idl')}")
            for generator in generators:
                generator.generate(package, made, [str(Path(sys.prefix) / "share")], out)
    except Exception as error:  # of many kinds, by code of others
        raise InputError(f"{package} cannot be generated: {type(error).__name__}: {error}") from error


def _compile(package: str, folder: Path) -> None:
    """One library, which Python imports and which holds all of the package."""
    prefix = Path(sys.prefix)
    headers = [
        folder,
        prefix / "include",
        *(path for path in (prefix / "include").iterdir() if path.is_dir()),
        Path(sysconfig.get_paths()["include"]),
        Path(importlib.import_module("numpy").get_include()),
    ]
    flags = ["-O0", "-fPIC", "-w", f'-DROS_PACKAGE_NAME="{package}"', *(f"-I{path}" for path in headers)]
    objects = folder / "objects" / package
    objects.mkdir(parents=True)
    compiled = []
    for number, source in enumerate(_sources(folder / package)):
        compiled.append(str(objects / f"{number}.o"))
        _run([*_COMPILERS[source.suffix], *flags, "-c", str(source), "-o", compiled[-1]])
    library = folder / package / f"{package}_s__rosidl_typesupport_c.so"
    linked = [f"-L{prefix / 'lib'}", *(f"-l{name}" for name in _LIBRARIES)]
    _run(["g++", "-shared", "-o", str(library), *compiled, *linked])


def _sources(package: Path) -> Iterator[Path]:
    for suffix in _COMPILERS:
        yield from sorted(package.rglob(f"*{suffix}"))


def _run(words: list[str]) -> None:
    done = subprocess.run(words, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        wrong = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip()[-200:])
        raise InputError(f"{words[0]} fails: {wrong}; compiling for Python needs its headers (apt install python3-dev)")
