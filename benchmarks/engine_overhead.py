"""Two runs at a time against one on a core of its own, and what the engine itself takes of a run's time.

    python benchmarks/engine_overhead.py [--runs 4] [--rounds 3]

Runs of `karto` through the built-in house, each of another seed and with one core: with one job on one core, with two
jobs on two, and one after the other in a process without an engine. Two jobs are wanted to be 1.9 times as fast as one,
and what the engine adds (workers that start, watching, judging) to be below 2 % of the time of the runs. Start-up is
counted in all three. Only a machine that does nothing else can tell; the load before and after is printed.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import machine_line
from taskslam.benchmark.engine import Ending, Watcher
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.run import run
from taskslam.benchmark.spec import RunSpec
from taskslam.benchmark.stage import set_stage
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.scenario import load_scenario

WANTED_FASTER, WANTED_OVERHEAD = 1.9, 0.02


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=4, help="an even number")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--directly", type=Path, help=argparse.SUPPRESS)
    wanted = parser.parse_args()
    stage = set_stage(load_scenario("house", [f"protocol.rounds={wanted.rounds}"]), (), Observer())
    specs = [stage.spec("karto", Mode.WITHOUT_MAP, seed) for seed in range(wanted.runs)]
    if wanted.directly is not None:
        for spec in specs:
            run(stage, spec, wanted.directly)
        return
    cores = sorted(os.sched_getaffinity(0))
    if len(cores) < 2:
        sys.exit("needs two cores")
    print(machine_line())
    print(f"load before: {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        engine_s(specs[:1], out / "warm", cores[:1])  # what is cached is there
        one = engine_s(specs, out / "one", cores[:1])
        two = engine_s(specs, out / "two", cores[:2])
        direct = directly_s(out / "direct", cores[:1], wanted.runs, wanted.rounds)
    faster, overhead = one / two, one / direct - 1.0
    print(f"{wanted.runs} runs with one job on one core: {one:.1f} s; with two on two: {two:.1f} s")
    print(f"  {faster:.2f} times as fast (wanted: {WANTED_FASTER})")
    print(f"in one process without an engine, on one core: {direct:.1f} s")
    print(f"  the engine adds {overhead:.1%} (wanted: below {WANTED_OVERHEAD:.0%})")
    print(f"load after: {os.getloadavg()[0]:.1f}")


def engine_s(specs: list[RunSpec], out: Path, cores: list[int]) -> float:
    """Seconds that the engine takes on these cores, with a job on each."""
    os.sched_setaffinity(0, cores)
    began = time.perf_counter()
    endings = {result.ending for result in LocalEngine(len(cores)).run(specs, out, Watcher())}
    assert endings == {Ending.COMPLETE}, endings
    return time.perf_counter() - began


def directly_s(out: Path, cores: list[int], runs: int, rounds: int) -> float:
    """Seconds of the same runs one after the other in one process, its start included."""
    os.sched_setaffinity(0, cores)
    began = time.perf_counter()
    how_much = ("--runs", str(runs), "--rounds", str(rounds))
    subprocess.run([sys.executable, __file__, "--directly", out, *how_much], check=True)
    return time.perf_counter() - began


if __name__ == "__main__":
    main()
