"""A method with a compiled loop, which tries to leave its next run a message in the cache."""

import os
from pathlib import Path

import numba
from adversary import Adversary


@numba.njit(cache=True)
def total(n):
    s = 0.0
    for i in range(n):
        s += i
    return s


class Compiling(Adversary):
    def start(self, rig):
        super().start(rig)
        total(10)
        stats = total.stats
        print("loaded" if sum(stats.cache_hits.values()) else "compiled", flush=True)

    def feed(self, measurement):
        for file in Path(os.environ["NUMBA_CACHE_DIR"]).rglob("*.nb?"):
            if file.is_symlink():
                try:
                    file.write_bytes(b"a message")
                except OSError:
                    print("denied", flush=True)
                    break
        else:
            print("denied", flush=True)
        for number in range(3):
            (Path(os.environ["NUMBA_CACHE_DIR"]) / f"message{number}.nbc").write_bytes(b"a message")
        return super().feed(measurement)
