"""Measured latency is a property of the processor: one folder of results holds runs of one model of it.

`OUT/measured_on.txt` holds its name, put there by the first run with measured latency. What times another processor's
run would take nobody can say well, so it is refused rather than scaled.
"""

from __future__ import annotations

from pathlib import Path

from taskslam.benchmark.run import machine
from taskslam.benchmark.spec import RunSpec
from taskslam.errors import InputError
from taskslam.files import write_once
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
    write_once(file, f"{own}\n".encode())
    other = read_text(file, "processor's name", InputError, LARGEST_WRITTEN_BY_HAND).strip()
    if other != own:
        raise InputError(
            f"{spec.title}: latency is measured, and the others under {out} were measured on another processor"
            f" ({other}; this machine has {own}): expected machines of one kind, as with `sbatch --constraint`, or"
            " another folder"
        )
