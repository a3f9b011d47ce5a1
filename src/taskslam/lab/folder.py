"""What a tour with cameras leaves on disk: arrival logs in the published form, calibrations, setup files, the truth.

The truth stands in a folder of its own, which nothing that measures reads.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from taskslam.files import write_whole, writing
from taskslam.lab.lab_file import Lab
from taskslam.lab.tour import RelivedTour
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.realworld.cameras.camera_files import save_camera

OVERHEAD, UP, TRIALS, CALIBRATION, TRUTH = "overhead", "up", "trials", "calibration", "truth"
OUTSIDE_IN, INSIDE_OUT = "outside_in.yaml", "inside_out.yaml"


def trial_of(tour: RelivedTour, round_number: int) -> tuple[int, int]:
    """Trial and loop of a round: without map every round is a trial, with map all are loops of one (protocol 1.6)."""
    return (0, round_number) if tour.record.manifest.mode is Mode.WITH_MAP else (round_number, 0)


def trial_folder(out: Path, trial: int) -> Path:
    """Where a trial's files stand."""
    return out / TRIALS / f"trial{trial}"


def write_logs(tour: RelivedTour, lab: Lab, out: Path) -> None:
    """`visited_waypoints.txt`, `visited_waypoints_nav_info.txt` and `planned_waypoints.txt` of every trial."""
    goals = tour.record.manifest.goals
    for trial in sorted({trial_of(tour, number)[0] for number in tour.motions}):
        folder = trial_folder(out, trial)
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
        planned = [f"{at.x:.6f} {at.y:.6f} {at.theta:.6f}" for at in goals]
        visited, info = [], []
        for arrival in tour.arrivals:
            number, loop = trial_of(tour, arrival.round)
            if number == trial:
                at = arrival.target
                line = f"{unix(lab, arrival.t / NANOSECONDS):.6f} {at.x:.6f} {at.y:.6f} {at.theta:.6f}"
                visited.append(line)
                info.append(f"{line} {arrival.goal} {loop}")
        _lines(folder / "planned_waypoints.txt", "x y theta", planned)
        _lines(folder / "visited_waypoints.txt", "timestamp x y theta", visited)
        _lines(folder / "visited_waypoints_nav_info.txt", "timestamp x y theta wpt_index loop_index", info)


def unix(lab: Lab, time: float) -> float:
    """Unix time, s, by the robot's clock, of an instant of the run."""
    return lab.time_zero + time


def write_setups(tour: RelivedTour, lab: Lab, out: Path) -> list[Path]:
    """Calibrations, and the setup files that `taskslam measure` reads; the paths of the latter."""
    with writing(out / CALIBRATION):
        (out / CALIBRATION).mkdir(parents=True, exist_ok=True)
    manifest = tour.record.manifest
    trials = sorted({trial_of(tour, number)[0] for number in tour.motions})
    run: dict[str, Any] = {
        "arrivals": [f"{TRIALS}/trial{trial}/visited_waypoints_nav_info.txt" for trial in trials],
        "method": manifest.method,
        "mode": manifest.mode.value,
        "rounds": manifest.rounds,
    }
    common: dict[str, Any] = {
        "scenario": manifest.scenario_name,
        "runs": [run],
        "pause": tour.record.manifest.scenario["protocol"]["pause"],
    }
    written = []
    if lab.tag is not None:
        cameras = []
        for camera in lab.cameras:
            save_camera(out / CALIBRATION / f"{camera.name}.yaml", camera.lens.camera(camera.name))
            cameras.append(
                {
                    "name": camera.name,
                    "images": f"{OVERHEAD}/{camera.name}",
                    "calibration": f"{CALIBRATION}/{camera.name}.yaml",
                    "image_kind": "raw",
                    "clock_offset": camera.clock_offset,
                    "waypoints": list(camera.waypoints),
                }
            )
        tag = lab.tag.model_dump(mode="json", exclude={"height"})
        written.append(_yaml(out / OUTSIDE_IN, {**common, "tag": tag, "cameras": cameras}))
    if lab.ceiling is not None:
        up = lab.ceiling.camera
        save_camera(out / CALIBRATION / "up.yaml", up.lens.camera("up"))
        camera_entry = {
            "name": "up",
            "images": UP,
            "calibration": f"{CALIBRATION}/up.yaml",
            "image_kind": "raw",
            "clock_offset": up.clock_offset,
            "mount": up.mount.model_dump(mode="json"),
        }
        bundles = [bundle.model_dump(mode="json") for bundle in lab.ceiling.bundles]
        written.append(_yaml(out / INSIDE_OUT, {**common, "camera": camera_entry, "bundles": bundles}))
    return written


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """A CSV file of the truth."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(header)
            table.writerows(rows)


def write_truth(tour: RelivedTour, lab: Lab, out: Path) -> None:
    """Where the robot stood at every arrival, and where the cameras hang."""
    rows = []
    for arrival in tour.arrivals:
        stamp = arrival.t / NANOSECONDS
        base = tour.motions[arrival.round].poses(np.array([stamp]))[0]
        x, y, theta = tour.motions[arrival.round].planar(np.array([stamp]))[0].tolist()
        tilt = Rotation.from_matrix(base[:3, :3]).as_euler("ZYX")[:0:-1]
        rows.append(
            [
                arrival.round,
                arrival.goal + 1,
                f"{unix(lab, stamp):.6f}",
                repr(x),
                repr(y),
                repr(theta),
                *tilt,
                base[2, 3],
            ]
        )
    header = ("round", "waypoint", "time", "x", "y", "theta", "roll", "pitch", "z")
    write_table(out / TRUTH / "arrivals.csv", header, rows)
    hung = {
        camera.name: {"clock_offset": camera.clock_offset, "T_map_camera": camera.mount.T_map_camera.round(9).tolist()}
        for camera in lab.cameras
    }
    _yaml(out / TRUTH / "cameras.yaml", hung)


def _lines(path: Path, header: str, lines: Sequence[str]) -> None:
    write_whole(path, "\n".join([f"# {header}", *lines]) + "\n")


def _yaml(path: Path, content: dict[str, Any]) -> Path:
    write_whole(path, yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120))
    return path
