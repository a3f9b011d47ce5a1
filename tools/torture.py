"""Kill a campaign with SIGKILL at random moments, again and again, and look whether anything is lost.

    make torture                                  200 kills: 140 on this machine, 30 on Slurm, 30 on Ray
    python tools/torture.py --kills 40 --seed 7
    python tools/torture.py --engine slurm --kills 10 --small

The campaign is driven undisturbed on this machine. Then it is started over and over on an engine, and up to three times
a start some of its processes are killed (`tortured_engines.py`): the driver, a worker, the process of a method, or all
at once; with Slurm also the process of a job, or slurmd, after which the node is taken for dead or is not; with Ray the
process of a task, or a whole machine. After every start

- a run that was finished before is there, and was not driven again;

and whenever the campaign has come to its end

- nothing hidden is left beside the runs, no scratch folder, and no note of a run that could not be driven;
- metrics.json and the table of runs say what they say of the undisturbed campaign, but for clocks and memory.

A method whose process is killed has crashed: that is its result, and it stays. Such runs are counted, removed and
driven again before the tables are compared. Exit status 1 if anything did not hold.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from taskslam.evaluation.run_index import index_runs
from tortured_engines import Local, command_of, engine_of, kill

MOST_KILLS = 3  # a start
_LOOK_S = 0.2
CLOCKS = {"wall_s", "compute_s", "real_time_factor", "method_peak_bytes", "own_peak_bytes", "method_cpu_s"}
CLOCKS |= {"started_utc", "stamp_ns", "bytes"}
WALLS = ((-3, 0, 0.2, 6), (3, 0, 0.2, 6), (0, -3, 6, 0.2), (0, 3, 6, 0.2))
BOX = "<geometry><box><size>{2} {3} 1</size></box></geometry><pose>{0} {1} 0.5 0 0 0</pose>"
TOUR = """
name: {name}
world: {{file: {world}}}
floor_plan: {{resolution: 0.1}}
start: {{x: 0, y: 0, theta: 0}}
sequence: {{waypoints: [[{x}, 0.0, 0.0], [0.0, 0.4, 1.5]]}}
protocol: {{pause: 0.2, still_start: 0.2}}
"""


def main() -> int:
    """Torture; 0 if all held."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0, help="of the moments and the victims")
    parser.add_argument("--small", action="store_true", help="two runs, which take seconds")
    parser.add_argument("--engine", choices=("local", "slurm", "ray"), default="local")
    wanted = parser.parse_args()
    dice = random.Random(wanted.seed)
    with (
        tempfile.TemporaryDirectory(prefix="torture-") as folder,
        engine_of(wanted.engine, Path(folder), dice) as engine,
    ):
        torture = Torture(Path(folder), dice, wanted.small, engine)
        torture.run(wanted.kills)
    sys.stdout.write(torture.words())
    return 1 if torture.faults else 0


@dataclass
class Torture:
    """A torture in a folder of its own, and what it has found. lasts: s that a start takes which nobody disturbs."""

    folder: Path
    dice: random.Random
    small: bool
    engine: Local
    lasts: float = 0.0
    kills: Counter[str] = field(default_factory=Counter)
    said: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    def run(self, kills: int) -> None:
        """Kill so often."""
        self._write_campaign()
        began = time.monotonic()
        here = Local(self.folder, self.dice)
        status = here.start("run", "campaign.yaml", "--out", "calm", *here.options).wait()
        self.lasts = time.monotonic() - began
        failed = [json.loads(run.read_text())["stop_failures"] for run in finished(self.folder / "calm")]
        if status != 0 or any(failed):
            self.faults.append(f"the undisturbed campaign ended with status {status}, {failed}: {self._log()}")
            return
        expected = tables(self.folder / "calm")
        while self.kills.total() < kills:
            self._drive_to_the_end(kills)
            self._look_for_litter()
            for place in differences(expected, tables(self.folder / "out")):
                self.faults.append(f"campaign {self.said['campaigns']}: {place}")
            shutil.rmtree(self.folder / "out")

    def words(self) -> str:
        """What was done and found."""
        killed = ", ".join(f"{count} of the {victim}" for victim, count in sorted(self.kills.items()))
        counts = ", ".join(f"{count} {what}" for what, count in sorted(self.said.items()))
        faults = "".join(f"FAULT: {fault}\n" for fault in self.faults) or "Nothing was lost.\n"
        return f"{self.kills.total()} kills: {killed}\n{counts}\n{faults}"

    def _drive_to_the_end(self, kills: int) -> None:
        """Start the campaign, and disturb it, until it says that all is driven."""
        out = self.folder / "out"
        while True:
            before = finished(out)
            journals = out.glob("*/*/without-map/.seed0.partial/journal.jsonl")
            self.said["runs gone on with"] += sum(b"round_ended" in journal.read_bytes() for journal in journals)
            began = time.monotonic()
            campaign = self.engine.start("run", "campaign.yaml", "--out", "out", *self.engine.options)
            killed = self._disturb(campaign, kills)
            try:
                status = self.engine.wait(campaign, killed)
            except subprocess.TimeoutExpired:
                self.faults.append(f"the campaign did not end: {self._log()}")
                return
            if not killed:
                self.lasts = min(self.lasts, time.monotonic() - began)
            self._wait_for_the_dead()
            after = finished(out)
            self.said["starts"] += 1
            self.faults += [f"{run}: lost or driven twice" for run in before if before[run] != after.get(run)]
            if status not in {0, 3} or (status == 3 and not killed):
                self.faults.append(f"the campaign ended with status {status}: {self._log()}")
                return
            if status == 0 and not self._remove_crashed(after):
                self.said["campaigns"] += 1
                sys.stderr.write("".join(f"{fault}\n" for fault in self.faults))
                sys.stderr.write(f"{self.kills.total()} of {kills} kills, {len(self.faults)} faults\n")
                return

    def _disturb(self, campaign: subprocess.Popen[bytes], kills: int) -> bool:
        """Once or several times, after a while, kill some of the campaign's processes; whether there were any."""
        before = self.kills.total()
        for _ in range(min(self.dice.randint(1, MOST_KILLS), kills - before)):
            until = time.monotonic() + self.dice.uniform(0.0, self.lasts)
            while time.monotonic() < until and not self.engine.is_over(campaign):
                time.sleep(_LOOK_S)
            if self.engine.is_over(campaign):
                break
            victims = self.dice.sample(self.engine.victims, len(self.engine.victims))
            if victim := next(filter(self.engine.kill, victims), ""):  # the first of which there is one
                self.kills[victim] += 1
                sys.stderr.write(f"kill {self.kills.total()}: {victim}\n")
        return self.kills.total() > before

    def _remove_crashed(self, runs: dict[Path, int]) -> bool:
        """Remove the runs whose method was killed, which is a result; whether there were any."""
        crashed = [run for run in runs if _tells_of_a_crash(run)]
        for run in crashed:
            shutil.rmtree(run.parent)
        self.said["crashes recorded"] += len(crashed)
        return bool(crashed)

    def _look_for_litter(self) -> None:
        out, scratch = self.folder / "out", self.folder / "scratch"
        litter = [
            *out.rglob(".*"),
            *out.glob("campaign/notes/*"),
            *(path for path in scratch.iterdir() if path.name.startswith("taskslam")),
        ]
        self.faults += [f"campaign {self.said['campaigns']}: left {path}" for path in litter]

    def _wait_for_the_dead(self) -> None:
        """The kernel ends what a killed process leaves behind; it may take a moment."""
        deadline = time.monotonic() + 60  # of a machine that has other work
        while time.monotonic() < deadline:
            if not (left := self.engine.processes()):
                return
            time.sleep(_LOOK_S)
        self.faults.append(f"processes outlived their campaign: {[command_of(pid) for pid in left]}")
        for pid in left:
            kill(pid)

    def _log(self) -> str:
        return (self.folder / "log").read_text(errors="replace")

    def _write_campaign(self) -> None:
        (self.folder / "scratch").mkdir()
        boxes = enumerate(BOX.format(*wall) for wall in WALLS)
        walls = "".join(
            f"<collision name='c{n}'>{box}</collision><visual name='v{n}'>{box}</visual>" for n, box in boxes
        )
        model = f"<model name='walls'><static>1</static><link name='l'>{walls}</link></model>"
        world = self.folder / "room.world"
        world.write_text(f"<sdf version='1.6'><world name='room'>{model}</world></sdf>")
        places = {"near": 0.5} if self.small else {"near": 0.5, "far": 1.5}
        for name, x in places.items():
            (self.folder / f"{name}.yaml").write_text(TOUR.format(name=name, x=x, world=world))
        tours = ", ".join(str(self.folder / f"{name}.yaml") for name in places)
        methods = "[wheel_odometry]" if self.small else "[karto, wheel_odometry]"
        campaign = f"name: tortured\nscenarios: [{tours}]\nmethods: {methods}\nseeds: [0]\nrounds: 4\n"
        (self.folder / "campaign.yaml").write_text(campaign)


def finished(out: Path) -> dict[Path, int]:
    """run.json of every finished run, and when it was written."""
    return {run: run.stat().st_mtime_ns for run in sorted(out.glob("*/*/*/seed0/run.json"))}


def _tells_of_a_crash(run: Path) -> bool:
    """Whether the method was killed in a round, or while it was stopped."""
    in_a_round = b'"outcome":"crashed"' in (run.parent / "journal.jsonl").read_bytes()
    return in_a_round or bool(json.loads(run.read_text())["stop_failures"])


def tables(out: Path) -> Any:
    """metrics.json and the table of runs, without what a clock or the memory said."""
    metrics = json.loads((out / "metrics.json").read_text())
    return _timeless({"metrics.json": metrics, "runs": index_runs(out).table.to_dicts()})


def differences(expected: Any, found: Any, place: str = "tables") -> list[str]:
    """Where two tables differ, in words."""
    if isinstance(expected, dict) and isinstance(found, dict) and expected.keys() == found.keys():
        return [words for key in expected for words in differences(expected[key], found[key], f"{place}: {key}")]
    if isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        pairs = enumerate(zip(expected, found, strict=True))
        return [words for n, (one, other) in pairs for words in differences(one, other, f"{place}[{n}]")]
    return [] if expected == found else [f"{place}: {str(expected)[:200]} became {str(found)[:200]}"]


def _timeless(said: Any) -> Any:
    if isinstance(said, dict):
        return {key: _timeless(value) for key, value in said.items() if key not in CLOCKS}
    return [_timeless(one) for one in said] if isinstance(said, list) else said


if __name__ == "__main__":
    sys.exit(main())
