"""How much memory a process holds, as the kernel counts it."""

from __future__ import annotations

from pathlib import Path


def own_peak_memory() -> int | None:
    """Most bytes resident in this process so far, if the kernel tells; `ru_maxrss` begins with the parent's."""
    try:
        return kilobytes(Path("/proc/self/status").read_bytes(), b"VmHWM:")
    except (OSError, ValueError):
        return None


def kilobytes(status: bytes, key: bytes) -> int:
    """Bytes that a line of /proc/PID/status gives in kB. Raises ValueError if it is not there."""
    return int(status[status.index(key) + len(key) :].split(maxsplit=1)[0]) * 1024
