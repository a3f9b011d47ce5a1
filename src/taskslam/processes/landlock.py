"""Closing one folder to this process for good, by Linux's Landlock (kernel 5.13 and later).

Landlock only knows what is allowed, so everything is: each entry beside the way down to the folder, as it stands now.
What is made later beside the way is not, therefore the host gives the process a folder of its own for temporary
files.
The way itself stays listable, and so are names in the folder, but nothing in it can be read.
Sources: Documentation/userspace-api/landlock.rst and include/uapi/linux/landlock.h of the kernel.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_RULE_PATH_BENEATH = 1
_VERSION_FLAG = 1
_READ_FILE, _READ_DIR = 1 << 2, 1 << 3


class _RulesetAttributes(ctypes.Structure):
    _fields_ = (("handled_access_fs", ctypes.c_uint64),)


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed_access", ctypes.c_uint64), ("parent_fd", ctypes.c_int32))


def is_available() -> bool:
    """Whether this kernel has Landlock switched on."""
    return _syscall(_CREATE_RULESET, None, 0, _VERSION_FLAG) >= 1


def close_folder(folder: Path, keep: Iterable[Path] = ()) -> bool:
    """Make what lies in `folder` unreadable for this process and its children; `keep` lists exceptions beneath it.

    Needs no_new_privs (`confine.py`). Returns False, and changes nothing, if the kernel cannot do it.
    """
    folder = folder.resolve()
    attributes = _RulesetAttributes(_READ_FILE | _READ_DIR)
    ruleset = _syscall(_CREATE_RULESET, ctypes.byref(attributes), ctypes.sizeof(attributes), 0)
    if ruleset < 0:
        return False
    try:
        _allow(ruleset, Path(folder.anchor), _READ_DIR)
        for path in (*_beside_the_way_to(folder), *(p.resolve() for p in keep)):
            # An exception that contains the folder would open it again.
            if not folder.is_relative_to(path):
                _allow(ruleset, path, _READ_FILE | _READ_DIR)
        return _syscall(_RESTRICT_SELF, ruleset, 0) == 0
    finally:
        os.close(ruleset)


def _beside_the_way_to(folder: Path) -> Iterator[Path]:
    way = {folder, *folder.parents}
    for ancestor in folder.parents:
        with contextlib.suppress(OSError), os.scandir(ancestor) as entries:
            for entry in entries:
                path = Path(entry.path)
                if path not in way and not entry.is_symlink():
                    yield path


def _allow(ruleset: int, path: Path, access: int) -> None:
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC | os.O_NOFOLLOW)
        try:
            if not path.is_dir():
                access &= _READ_FILE
            rule = _PathBeneath(access, descriptor)
            _syscall(_ADD_RULE, ruleset, _RULE_PATH_BENEATH, ctypes.byref(rule), 0)
        finally:
            os.close(descriptor)


def _syscall(number: int, *arguments: object) -> int:
    return int(ctypes.CDLL(None, use_errno=True).syscall(ctypes.c_long(number), *arguments))
