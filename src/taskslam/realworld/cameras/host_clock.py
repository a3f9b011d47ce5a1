"""How well this computer's clock is set: asked of chrony, or of systemd's time service, where they run."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass

WARN_BEYOND_S = 0.5
"""Half of the delay that the published protocol allows; arrivals and images must agree to less than a pause."""

_TIMEOUT_S = 3.0
_UNITS = {"ns": 1e-9, "us": 1e-6, "μs": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


@dataclass(frozen=True, slots=True)
class ClockState:
    """offset: s, this computer's clock minus UTC, None where unknown. told_by: who says so, or why nobody does."""

    offset: float | None
    told_by: str

    @property
    def warning(self) -> str | None:
        """What is wrong with it, in a sentence, if anything."""
        if self.offset is None:
            return f"The offset of this computer's clock is unknown ({self.told_by}); install chrony to know it."
        if abs(self.offset) > WARN_BEYOND_S:
            way = "fast" if self.offset > 0 else "slow"
            return f"This computer's clock is {abs(self.offset):.2f} s {way} ({self.told_by}); set it by NTP."
        return None


def clock_state() -> ClockState:
    """What chrony says, or else systemd-timesyncd."""
    said = _ask(["chronyc", "tracking"])
    if said is not None:
        return parse_chrony(said)
    said = _ask(["timedatectl", "timesync-status"])
    if said is not None and (state := parse_timesync(said)) is not None:
        return state
    said = _ask(["timedatectl", "show", "--property=NTPSynchronized", "--value"])
    if said is not None:
        synchronised = said.strip() == "yes"
        return ClockState(None, "set by NTP, offset not told" if synchronised else "timedatectl: not set by NTP")
    return ClockState(None, "neither chrony nor systemd-timesyncd runs")


def parse_chrony(text: str) -> ClockState:
    """The state from the output of `chronyc tracking`."""
    found = re.search(r"^System time\s*:\s*([0-9.]+) seconds (slow|fast) of NTP time", text, re.MULTILINE)
    if found is None or re.search(r"^Leap status\s*:\s*Not synchronised", text, re.MULTILINE):
        return ClockState(None, "chrony: not synchronised")
    return ClockState(float(found[1]) * (-1 if found[2] == "slow" else 1), "chrony")


def parse_timesync(text: str) -> ClockState | None:
    """The state from the output of `timedatectl timesync-status`, whose offset is the server's clock minus ours."""
    found = re.search(r"^\s*Offset:\s*([+-]?)(\S.*)$", text, re.MULTILINE)
    if found is None:
        return None
    parts = re.findall(r"([0-9.]+)\s*(ns|us|μs|µs|ms|min|s|h|d)\b", found[2])
    if not parts:
        return None
    size = sum(float(number) * _UNITS[unit] for number, unit in parts)
    return ClockState(size if found[1] == "-" else -size, "systemd-timesyncd")


def _ask(command: list[str]) -> str | None:
    program = shutil.which(command[0])
    if program is None:
        return None
    try:
        done = subprocess.run(  # noqa: S603
            [program, *command[1:]],
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            env={"LC_ALL": "C", "PATH": "/usr/bin:/bin"},
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired, UnicodeDecodeError):
        return None
    return done.stdout if done.returncode == 0 else None
