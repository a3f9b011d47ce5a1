"""Random streams by name: one seed per run, one child for every noise source (design D2).

A stream depends only on the seed, its name and how often the robot was reset, so that a new noise source, or a round
that ended early, never changes what another source draws.
"""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, name: str, reset: int = 0) -> np.random.Generator:
    """The generator of noise source `name` after the reset-th reset in a run with this seed."""
    key = (zlib.crc32(name.encode("utf-8")), reset)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy=seed, spawn_key=key)))
