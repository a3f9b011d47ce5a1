"""Do two states of this repository give the same bytes? Drives a fixed set of runs in both and compares what they left.

    python tools/same_bytes.py BASE                # a commit against the working tree
    python tools/same_bytes.py BASE --keep FOLDER  # what both left stays there, and a base driven before is used again

The set: 2D LiDAR in both modes, 3D LiDAR, stereo with a reference that is handed the pictures, an export with two
replays, and a measured run from the virtual lab. Compared: journals, trajectories, what a measurement found, and
metrics.json without what this machine's clock and memory said, and figures. Exit status 1 where anything differs.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
WITNESS = "same_bytes_witness"
_WITNESS_SOURCE = """
from dataclasses import replace
from taskslam.measurements import Sensor
from taskslam.slam.methods.ground_truth import GroundTruth

class Seeing(GroundTruth):
    card = replace(GroundTruth.card, name="seeing", sensors=(Sensor.TRUE_POSE, Sensor.STEREO_IMAGES))
"""
_TOUR = "sequence.path=[0,1,2,3,4]"
_PICTURES = "robot=turtlebot2_small10"
_SHORT = "sequence.path=[0,1,2]"
RUNS = "runs/house/karto/without-map/seed1"
COMMANDS = (
    f"run house -m karto -m hector -m wheel_odometry --rounds 2 --seed 3 --set {_TOUR} --out short",
    f"run house -m kiss_icp -m rko_lio --mode without-map --rounds 1 --set {_SHORT} --out spatial",
    f"run house -m {WITNESS}:Seeing --mode without-map --rounds 1 --set {_SHORT} --set {_PICTURES} --out seeing",
    f"run house -m karto --latency measured --rounds 1 --set {_SHORT} --out measured_latency",
    "export house --out recording --format mcap --goals 2 --sensors odometry,lidar_2d,lidar_3d,imu --seed 5",
    "replay recording -m karto -m kiss_icp --rounds 2 --out replayed",
    "run house -m karto --mode without-map --rounds 2 --seed 1 --out runs",
    f"lab {RUNS} house_cameras --out lab",
    "measure outside-in lab/outside_in.yaml",
    "evaluate short",
    "evaluate spatial",
    "evaluate runs",
    "evaluate measured",
    "figures short --out figures",
)
_MAY_FAIL_ITS_TASK = 1
_CLOCK = ("wall_s", "compute_s", "real_time_factor", "method_peak_bytes", "own_peak_bytes")
_ADDED = ("quantities", "behaviour")  # by format 3 of metrics.json
_SAME = ("journal.jsonl", "metrics.json", ".tum", ".svg")
_NOT_REPEATABLE = ("measured_latency",)


def main() -> None:
    """Drive both, compare, and say what differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", help="a commit")
    parser.add_argument("--keep", type=Path, help="where the results stay")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = (asked.keep or Path(scratch)).absolute()
        base, new = folder / f"base-{asked.base}", folder / "new"
        if not base.exists():
            drive_commit(asked.base, base, Path(scratch))
        shutil.rmtree(new, ignore_errors=True)
        drive(ROOT, new)
        differences = compare(base, new)
    print("\n".join(differences) or "the same bytes")
    sys.exit(bool(differences))


def drive_commit(commit: str, out: Path, scratch: Path, commands: Sequence[str] = COMMANDS) -> None:
    """Drive the set in a checkout of a commit."""
    tree = scratch / "tree"
    subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree, commit], cwd=ROOT, check=True)
    try:
        drive(tree, out, commands)
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)


def drive(tree: Path, out: Path, commands: Sequence[str] = COMMANDS) -> None:
    """Drive the set with the sources in `tree`; the results stand in `out`."""
    out.mkdir(parents=True)
    (out / f"{WITNESS}.py").write_text(_WITNESS_SOURCE)
    environment = os.environ | {"PYTHONPATH": f"{tree / 'src'}{os.pathsep}{out}"}
    for command in commands:
        code = f"import sys; from taskslam.cli.main import main; sys.argv = {['taskslam', *command.split()]!r}; main()"
        done = subprocess.run(
            [sys.executable, "-c", code], check=False, cwd=out, env=environment, capture_output=True, text=True
        )
        if done.returncode not in (0, _MAY_FAIL_ITS_TASK):
            sys.exit(f"{tree}: taskslam {command}: status {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"{out.name}: taskslam {command}: {done.returncode}", flush=True)


def compare(base: Path, new: Path) -> list[str]:
    """A sentence for every file that differs or stands on one side only."""
    one, two = contents(base), contents(new)
    found = [f"only in {base.name}: {name}" for name in sorted(one.keys() - two.keys())]
    found += [f"only in {new.name}: {name}" for name in sorted(two.keys() - one.keys())]
    return found + [f"differs: {name}" for name in sorted(one.keys() & two.keys()) if one[name] != two[name]]


def contents(folder: Path) -> dict[str, bytes]:
    """What is compared, by path."""
    return {
        str(path.relative_to(folder)): without_clock(path)
        for path in sorted(folder.rglob("*"))
        if path.name.endswith(_SAME) and path.relative_to(folder).parts[0] not in _NOT_REPEATABLE
    }


def without_clock(path: Path) -> bytes:
    """The content of a file; of metrics.json without what this machine's clock and memory said."""
    if path.name != "metrics.json":
        return path.read_bytes()
    metrics = json.loads(path.read_text(encoding="utf-8"))
    del metrics["format"]
    for run in metrics["runs"]:
        for name in (*_CLOCK, *_ADDED):
            run.pop(name, None)
        for waypoint in run["waypoints"]:
            for name in _ADDED:
                waypoint.pop(name, None)
    return json.dumps(metrics, sort_keys=True, indent=1).encode()


if __name__ == "__main__":
    main()
