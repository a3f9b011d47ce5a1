"""What a guest may reach: the interpreter, packages and system libraries to read, its own scratch folder to write.

A `Wall` says what is opened beyond that, and what is closed within it. `doctor` tells what of it holds here.
"""

from __future__ import annotations

import contextlib
import os
import site
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from taskslam.processes import landlock

# Where system libraries, their data, and the programs lie that a guest may start; and what numeric libraries ask of
# the machine. Links are followed.
_SYSTEM = (
    *("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/libexec", "/usr/local/lib", "/usr/local/lib64", "/usr/share"),
    *("/bin", "/usr/bin", "/usr/local/bin", "/etc/ld.so.cache", "/etc/ld.so.conf", "/etc/ld.so.conf.d", "/etc/ssl"),
    *("/etc/alternatives", "/etc/fonts", "/etc/localtime", "/dev/urandom", "/dev/random", "/dev/zero"),
    *("/proc/cpuinfo", "/sys/devices/system/cpu"),
)
_WRITABLE = (Path("/dev/null"),)


@dataclass(frozen=True, slots=True)
class Wall:
    """read: places opened for reading, beyond the system's. closed: folders of results, closed whatever is opened.

    keep: places within closed ones that stay open, such as the method's own code. loopback: TCP stays open, to all
    addresses: Landlock knows ports only. shared_memory: the guest gets a /dev/shm, one of its own where the kernel
    allows it.
    """

    read: tuple[Path, ...] = ()
    closed: tuple[Path, ...] = ()
    keep: tuple[Path, ...] = ()
    loopback: bool = False
    shared_memory: bool = False

    def rulesets(self, scratch: Path) -> list[int]:
        """Descriptors to enter in this order, the caller's to close; none where the kernel has no Landlock.

        Raises:
            OSError: the kernel refuses.
        """
        if not landlock.is_available():
            return []
        opened = [place.resolve() for place in (*_import_path(), *map(Path, _SYSTEM), *self.read)]
        keep = [place.resolve() for place in self.keep]
        walls: list[int] = []
        try:
            for folder in dict.fromkeys(folder.resolve() for folder in self.closed):
                if any(folder.is_relative_to(place) or place.is_relative_to(folder) for place in opened):
                    walls.append(landlock.all_but(folder, keep))  # noqa: PERF401 each is closed should the next fail
            walls.append(landlock.only(opened, (scratch, *_WRITABLE), self.loopback))
        except BaseException:
            for wall in walls:
                os.close(wall)
            raise
        return walls


def _import_path() -> Iterator[Path]:
    """Where the interpreter and what it can import lie; of environments that are links, also where these lead."""
    executable = Path(sys.executable)
    yield from (Path(sys.prefix), Path(sys.base_prefix), Path(sys.exec_prefix), executable.parent, executable.resolve())
    here = working_folder()
    for entry in (*sys.path, *site.getsitepackages()):
        if entry and Path(entry).resolve() != here:
            yield Path(entry)


def working_folder() -> Path | None:
    """The folder in which the user works; None if it was removed meanwhile."""
    with contextlib.suppress(OSError):
        return Path.cwd().resolve()
    return None
