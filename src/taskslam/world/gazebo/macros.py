"""xacro: macros of ROS around SDF, expanded by the program of that name where it is installed.

It evaluates expressions that a file holds, as a script would; so does everybody who expands such a file by hand.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from taskslam.errors import WorldError

_LONGEST = 60.0  # s
_EXPANDED = 1 << 26  # bytes


def xacro_program() -> str | None:
    """The program, on the path or beside this Python; None where it is not installed."""
    beside = Path(sys.executable).parent
    return shutil.which("xacro") or shutil.which("xacro", path=str(beside))


def expanded(program: str, path: Path) -> tuple[bytes, list[Path]]:
    """The document without macros, and the files that it includes.

    Raises WorldError with what xacro says where it cannot, or takes longer than a minute.
    """
    included = _said(program, path, "--deps").decode("utf-8", "replace").split()
    return _said(program, path), [Path(file) for file in included]


def _said(program: str, path: Path, *options: str) -> bytes:
    command = [program, *options, str(path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_LONGEST, check=False, cwd=path.parent)  # noqa: S603
    except subprocess.TimeoutExpired:
        raise WorldError(f"{path} holds xacro macros, and xacro is not done after {_LONGEST:g} s.") from None
    except OSError as error:
        raise WorldError(f"{path} holds xacro macros, and {program} does not start: {error.strerror}.") from error
    if done.returncode or len(done.stdout) > _EXPANDED:
        lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
        why = next((line for line in lines if line.strip()), f"status {done.returncode}")
        raise WorldError(f"{path} holds xacro macros that xacro cannot expand: {' '.join(why.split())[:300]}")
    return done.stdout
