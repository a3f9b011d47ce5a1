"""Measured latency is a property of the processor: one folder of results holds runs of one model of it.

`OUT/measured_on.txt` holds its name, put there by the first run with measured latency. What times another processor's
run would take nobody can say well, so it is refused rather than scaled.
"""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

from taskslam.benchmark.run import machine
from taskslam.benchmark.spec import RunSpec
from taskslam.errors import InputError
from taskslam.files import writing
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text
from taskslam.slam.guest.latency import LatencyMode

_FILE = "measured_on.txt"


def check_processor(spec: RunSpec, out: Path, processor: str = "") -> None:
    """Claim `out` for a processor, by default this machine's, where the run's latency is measured and nobody has.

    Raises:
        InputError: other runs with measured latency there are of another processor. DiskFullError.
    """
    if spec.latency.mode is not LatencyMode.MEASURED:
        return
    own, file = processor or machine()["processor"], out / _FILE
    if not file.exists():
        _claim(file, own)
    other = read_text(file, "processor's name", InputError, LARGEST_WRITTEN_BY_HAND).strip()
    if other != own:
        raise InputError(
            f"{spec.title}: latency is measured, and the others under {out} were measured on another processor"
            f" ({other}; this machine has {own}): expected machines of one kind, as with `sbatch --constraint`, or"
            " another folder"
        )


def _claim(file: Path, own: str) -> None:
    """Write the name whole, unless somebody was faster: a link is made or not, also between machines."""
    with writing(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        ours = file.with_name(f".{file.name}.{secrets.token_hex(8)}")
        ours.write_text(own + "\n", encoding="utf-8")
        try:
            with contextlib.suppress(FileExistsError):
                os.link(ours, file)
        finally:
            ours.unlink()
