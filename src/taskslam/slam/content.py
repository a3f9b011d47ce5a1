"""What code a method is, without running it: the content of the files of its package, by which things are kept."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from functools import cache
from pathlib import Path

from taskslam.files import cache_folder
from taskslam.slam.registry import MethodEntry
from taskslam.version import __version__

_FORMAT = 1
_LONGEST_NAME = 60


def place_of(kind: str, entry: MethodEntry) -> Path | None:
    """Where things of this kind are kept for a registered method as it is now, in the user's cache folder.

    None for a method that is not registered: its code may lie beside anything, and be anything a minute later.
    """
    content = _content(entry)
    if content is None:
        return None
    plain = "".join(c if c.isalnum() or c in "-_" else "_" for c in entry.name)[:_LONGEST_NAME]
    return cache_folder() / kind / f"{plain}-{content[:16]}"


def _content(entry: MethodEntry) -> str | None:
    """SHA-256 of the package that holds the method, of this one with its version, and of the interpreter's version."""
    if not entry.distribution:
        return None
    package = entry.target.partition(":")[0].partition(".")[0]
    own = _own_content()
    theirs = own if package == "taskslam" else _package_content(package)
    if own is None or theirs is None:
        return None
    return hashlib.sha256(f"{_FORMAT} {sys.version} {__version__} {entry.target} {own} {theirs}".encode()).hexdigest()


@cache
def _own_content() -> str | None:
    return _package_content("taskslam")


def _package_content(package: str) -> str | None:
    """Of all its Python files and compiled modules. Finding a top-level package runs none of its code."""
    try:
        found = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return None
    if found is None:
        return None
    roots = [Path(root) for root in found.submodule_search_locations or ()]
    files = sorted(file for root in roots for kind in ("*.py", "*.so") for file in root.rglob(kind))
    if not roots and found.origin is not None:
        files = [Path(found.origin)]
    digest = hashlib.sha256()
    try:
        for file in files:
            digest.update(f"{file}\0".encode() + hashlib.sha256(file.read_bytes()).digest())
    except OSError:
        return None
    return digest.hexdigest()
