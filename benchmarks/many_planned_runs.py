"""Ten thousand planned runs: how long it takes to plan, write, read, ask for their state, and tabulate them.

    python benchmarks/many_planned_runs.py [--runs 10000]

A campaign of one short tour through the built-in house with so many seeds is planned. Runs that nobody drove
(`tools/make_synthetic_runs.py`) stand in the places of half of them, as finished ones do after a night. Measured is how
they are listed, looked through for what is to be driven, priced, and tabulated, the first time and afterwards.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from common import machine_line
from taskslam.benchmark.campaign.campaign_file import Campaign
from taskslam.benchmark.campaign.plan_file import read_plan, write_plan
from taskslam.benchmark.campaign.planning import plan
from taskslam.benchmark.campaign.price import Prices
from taskslam.benchmark.campaign.state import State, states_of
from taskslam.benchmark.engine import Ending
from taskslam.benchmark.engines.supervised import without_driving
from taskslam.benchmark.spec import run_folder
from taskslam.evaluation.run_index import index_runs
from taskslam.mode import Mode
from taskslam.record.run_directory import MANIFEST

TOOL = Path(__file__).parents[1] / "tools" / "make_synthetic_runs.py"
Result = TypeVar("Result")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10_000)
    count = parser.parse_args().runs
    print(machine_line())
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        campaign = Campaign(
            name="many",
            scenarios=("house",),
            methods=("wheel_odometry",),
            modes=(Mode.WITHOUT_MAP,),
            seeds=tuple(range(count)),
        )
        planned = timed("planned", lambda: plan(campaign))
        path = timed("plan written", lambda: write_plan(out, campaign, planned))
        print(f"  {path.stat().st_size / 1e6:.1f} MB")
        specs = timed("plan read", lambda: read_plan(out)).plan.specs
        made = Path(folder) / "synthetic"
        subprocess.run([sys.executable, TOOL, made, "--runs", str(len(specs) // 2)], check=True)
        for spec, run in zip(specs[::2], sorted(made.glob("*/*")), strict=False):
            place = run_folder(out, spec)
            place.parent.mkdir(parents=True, exist_ok=True)
            run.rename(place)
            manifest = json.loads((place / MANIFEST).read_text())
            manifest |= {"spec_hash": spec.digest, "behaviour": spec.behaviour, "seed": spec.seed}
            (place / MANIFEST).write_text(json.dumps(manifest))
        states = timed("states listed", lambda: states_of(specs, out))
        print(f"  {sum(one.state is State.FINISHED for one in states)} finished")
        done = [one.spec for one in states if one.state is State.FINISHED]
        kept = timed("finished ones kept", lambda: [without_driving(spec, out) for spec in done])
        print(f"  {sum(result is not None and result.ending is Ending.KEPT for result in kept)} kept")
        prices = timed("prices learned", lambda: Prices(specs, out))
        timed("priced", lambda: [prices.of(spec) for spec in specs])
        timed("tabulated for the first time", lambda: index_runs(out))
        table = timed("tabulated again", lambda: index_runs(out)).table
        print(f"  {len(table)} rows, {(out / 'runs.parquet').stat().st_size / 1e6:.1f} MB")


def timed(what: str, work: Callable[[], Result]) -> Result:
    """Do it, and print how long it took."""
    began, cpu = time.perf_counter(), time.process_time()
    result = work()
    print(f"{what}: {time.perf_counter() - began:.2f} s, {time.process_time() - cpu:.2f} s of a processor", flush=True)
    return result


if __name__ == "__main__":
    main()
