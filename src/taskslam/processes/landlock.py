"""What this process may still reach, by Linux's Landlock (kernel 5.13 and later): everything else is closed for good.

A ruleset is made by the process that knows the paths and handed over as a descriptor; the one that is confined learns
no path, and only enters it. Rulesets stack: what any of them does not allow is denied, so a folder inside an allowed
one can be closed by a ruleset of its own.
Sources: Documentation/userspace-api/landlock.rst and include/uapi/linux/landlock.h of the kernel.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import stat
from collections.abc import Collection, Iterable, Iterator
from functools import cache
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_RULE_PATH_BENEATH = 1
_VERSION_FLAG = 1

_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_IOCTL_DEV, _TRUNCATE = 1 << 15, 1 << 14
# How many of the rights, from the lowest bit on, each version of the interface knows.
_FILE_RIGHTS = (0, 13, 14, 15, 15, 16)
_TCP_SINCE, _TCP = 4, 0b11
_SCOPES_SINCE, _SCOPES = 6, 0b11  # abstract sockets, signals
_READING = _EXECUTE | _READ_FILE | _READ_DIR
_OF_FILES = _EXECUTE | _READ_FILE | _WRITE_FILE | _TRUNCATE | _IOCTL_DEV


class _RulesetAttributes(ctypes.Structure):
    _fields_ = (
        ("handled_access_fs", ctypes.c_uint64),
        ("handled_access_net", ctypes.c_uint64),
        ("scoped", ctypes.c_uint64),
    )


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed_access", ctypes.c_uint64), ("parent_fd", ctypes.c_int32))


@cache
def version() -> int:
    """Of the interface that this kernel offers; 0 where there is no Landlock."""
    return max(0, _syscall(_CREATE_RULESET, None, 0, _VERSION_FLAG))


def is_available() -> bool:
    """Whether this kernel has Landlock switched on."""
    return version() >= 1


def closes_tcp() -> bool:
    """Whether this kernel can deny TCP (6.7 and later)."""
    return version() >= _TCP_SINCE


def closes_signals() -> bool:
    """Whether this kernel can deny signals and abstract sockets to the outside (6.12 and later)."""
    return version() >= _SCOPES_SINCE


def only(read: Iterable[Path], write: Iterable[Path], tcp: bool = False) -> int:
    """A ruleset in which nothing is allowed but to read and execute beneath `read`, and all beneath `write`.

    tcp: TCP stays open. What is not there is passed over. Returns an inheritable descriptor.

    Raises:
        OSError: the kernel cannot do it.
    """
    rights = _file_rights()
    ruleset = _create(rights, 0 if tcp else _TCP, _SCOPES)
    for path in read:
        _allow(ruleset, path, rights & _READING)
    for path in write:
        _allow(ruleset, path, rights)
    return ruleset


def all_but(folder: Path, keep: Collection[Path] = ()) -> int:
    """A ruleset in which nothing in `folder` can be read, but for what `keep` lists. Returns an inheritable descriptor.

    As it stands now: what is made later beside the way down to the folder is closed too.

    Raises:
        OSError: the kernel cannot do it.
    """
    ruleset = _create(_READ_FILE | _READ_DIR, 0, 0)
    for path in (*_beside_the_way_to(folder), *keep):
        if not folder.is_relative_to(path):  # an exception that contains the folder would open it again
            _allow(ruleset, path, _READ_FILE | _READ_DIR)
    return ruleset


def enter(ruleset: int) -> None:
    """Keep to a ruleset from now on, and so do all processes that this one starts. Needs no_new_privs (`confine.py`).

    Raises:
        OSError: the kernel cannot do it.
    """
    if _syscall(_RESTRICT_SELF, ruleset, 0) != 0:
        raise OSError(ctypes.get_errno(), "landlock_restrict_self")


def allow_reading(ruleset: int, path: Path) -> None:
    """Add a place that only the process itself can name, as /proc/self."""
    _allow(ruleset, path, _READ_FILE | _READ_DIR, follow=True)


def allow_all(ruleset: int, path: Path) -> None:
    """Add a place where a process may write too, and that only it sees as it is, as its own mount."""
    _allow(ruleset, path, _file_rights())


def _file_rights() -> int:
    return (1 << _FILE_RIGHTS[min(version(), len(_FILE_RIGHTS) - 1)]) - 1


def _create(files: int, net: int, scoped: int) -> int:
    attributes = _RulesetAttributes(files, net if closes_tcp() else 0, scoped if closes_signals() else 0)
    size = 24 if closes_signals() else 16 if closes_tcp() else 8
    ruleset = _syscall(_CREATE_RULESET, ctypes.byref(attributes), size, 0)
    if ruleset < 0:
        raise OSError(ctypes.get_errno(), "landlock_create_ruleset")
    return ruleset


def _beside_the_way_to(folder: Path) -> Iterator[Path]:
    way = {folder, *folder.parents}
    for ancestor in folder.parents:
        with contextlib.suppress(OSError), os.scandir(ancestor) as entries:
            for entry in entries:
                path = Path(entry.path)
                if path not in way and not entry.is_symlink():
                    yield path


def _allow(ruleset: int, path: Path, access: int, follow: bool = False) -> None:
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC | (0 if follow else os.O_NOFOLLOW))
        try:
            mode = os.fstat(descriptor).st_mode
            if not stat.S_ISDIR(mode):
                access &= _OF_FILES
            if access and not stat.S_ISLNK(mode):
                rule = _PathBeneath(access, descriptor)
                _syscall(_ADD_RULE, ruleset, _RULE_PATH_BENEATH, ctypes.byref(rule), 0)
        finally:
            os.close(descriptor)


def _syscall(number: int, *arguments: object) -> int:
    return int(ctypes.CDLL(None, use_errno=True).syscall(ctypes.c_long(number), *arguments))
