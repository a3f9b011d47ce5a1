"""How long an evaluation of very many runs takes and how much memory: time, peak, and where it goes.

    python benchmarks/many_runs.py [--runs 10000] [--folder DIR]

The runs are synthetic (tools/make_synthetic_runs.py): 5 rounds of 12 waypoints each, made in a temporary folder unless
`--folder` names one that holds some. The evaluation runs in a process of its own, so that the peak is its alone. The
limit is reading the journals' bytes and parsing their JSON, which is timed beside it.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pydantic_core import from_json

from common import machine_line
from taskslam.record.run_directory import JOURNAL

TOOL = Path(__file__).parents[1] / "tools" / "make_synthetic_runs.py"
WANTED_S, WANTED_GIB = 60.0, 2.0


def evaluate(folder: Path) -> None:
    """What the child process does: evaluate, write metrics.json, print the figures."""
    from taskslam.evaluation import evaluate_runs, write_metrics

    begun, worked = time.perf_counter(), time.process_time()
    metrics = evaluate_runs([folder])
    evaluated = time.process_time()
    path = write_metrics(folder, metrics)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    wall, cpu = time.perf_counter() - begun, time.process_time() - worked
    print(f"{len(metrics.runs):,} runs evaluated, {len(metrics.left_out)} left out; metrics.json {size(path):.0f} MB")
    print(f"  processor {cpu:.1f} s ({evaluated - worked:.1f} s evaluation, the rest writing), wall {wall:.1f} s")
    print(f"  {1e3 * cpu / max(len(metrics.runs), 1):.2f} ms a run; peak memory {peak:.2f} GiB")
    if len(metrics.runs) >= 10_000:
        verdict = "met" if cpu < WANTED_S and peak < WANTED_GIB else "MISSED"
        print(f"  wanted: {WANTED_S:.0f} s, {WANTED_GIB:.0f} GiB: {verdict}")


def parse_only(folder: Path) -> None:
    """Print what reading the journals costs without making anything of them."""
    worked = time.process_time()
    total = 0
    for path in folder.rglob(JOURNAL):
        for line in path.read_bytes().splitlines():
            from_json(line)
            total += len(line)
    print(f"  limit: {time.process_time() - worked:.1f} s processor to read and parse {total / 1e6:.0f} MB of journals")


def size(path: Path) -> float:
    return path.stat().st_size / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        evaluate(options.child)
        return
    print(machine_line(), flush=True)
    with tempfile.TemporaryDirectory() as place:
        folder = options.folder or Path(place) / "synthetic"
        if not options.folder:
            subprocess.run([sys.executable, TOOL, folder, "--runs", str(options.runs)], check=True)
        subprocess.run([sys.executable, __file__, "--child", folder], check=True)
        parse_only(folder)


if __name__ == "__main__":
    main()
