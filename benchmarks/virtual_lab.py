"""The error budget of measuring with AprilTags: tours in the virtual lab, measured, and held against the truth.

    python benchmarks/virtual_lab.py [--world-path DIR] [--out DIR] [--only short|long|budget]

short: tsrb_short, 5 rounds without map, three cameras overhead at 1280 x 720, tilted by 30 degrees, with a robot that
sways by 0.3 degrees: precision E at every waypoint, by our way and by the published one (x and y in the camera's frame)
from the same pictures; under karto, and under wheel odometry, whose arrivals scatter by centimetres. long: tsrb_long
under tags on the ceiling. budget: one camera over tsrb_short, straight down and perfect, then with one thing at a time
that is not.

Runs and pictures are kept in --out and used again.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from common import machine_line
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage
from taskslam.errors import InputError
from taskslam.evaluation.waypoints import position_precision
from taskslam.geometry import FloatArray
from taskslam.lab.folder import INSIDE_OUT, OUTSIDE_IN
from taskslam.lab.lab_file import Lab, LabOverheadCamera, Photo, Unevenness, load_lab
from taskslam.lab.virtual_lab import photograph
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.realworld.measure import measure_inside_out, measure_outside_in
from taskslam.realworld.setup_file import InsideOutSetup, OutsideInSetup, load_setup
from taskslam.record import Arrival, RunRecord, find_runs, load_run
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.world import World

_PERFECT = Photo(rate=1.0, before=6.0, after=0.0, shutter=0.0, softness=0.5, noise=0.0, quality=None, dropped=0.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--world-path", type=Path, action="append", default=[])
    parser.add_argument("--out", type=Path, default=Path("virtual_lab"))
    parser.add_argument("--only", choices=("short", "long", "budget"))
    asked = parser.parse_args()
    print(machine_line())
    parts = [
        ("short", "tsrb_short", "karto", show_short),
        ("short", "tsrb_short", "wheel_odometry", show_short),
        ("long", "tsrb_long", "karto", show_long),
        ("budget", "tsrb_short", "karto", show_budget),
    ]
    for part, scenario_name, method, show in parts:
        if asked.only in (None, part):
            show(*driven(scenario_name, method, asked.world_path, asked.out), asked.out)


def driven(scenario_name: str, method: str, world_paths: list[Path], out: Path) -> tuple[RunRecord, World]:
    """A run of five rounds without map, and the world it was driven in."""
    stage = set_stage(load_scenario(scenario_name), world_paths, Observer())
    directory, _ = run(stage, stage.spec(method, Mode.WITHOUT_MAP), out / "runs")
    assert stage.world is not None
    return load_run(directory), stage.world


def pictures(record: RunRecord, world: World, lab: Lab, out: Path) -> Path:
    """The folder of a tour through the lab; one that stands there already is used again."""
    if not (out / OUTSIDE_IN).exists() and not (out / INSIDE_OUT).exists():
        photograph(record, world, load_robot("turtlebot2"), lab, out)
    return out


def measured(folder: Path, published: bool = False) -> RunRecord:
    """What the pictures in a folder give."""
    out = folder / ("published" if published else "measured")
    if not find_runs(out) if out.exists() else True:
        if (folder / OUTSIDE_IN).exists():
            measure_outside_in(load_setup(folder / OUTSIDE_IN, OutsideInSetup), out, published)
        else:
            measure_inside_out(load_setup(folder / INSIDE_OUT, InsideOutSetup), out, published)
    return load_run(find_runs(out)[0])


def visits(record: RunRecord) -> dict[int, FloatArray]:
    """(M, 3) poses by goal, NaN in rounds in which it was not reached."""
    found: dict[int, FloatArray] = {}
    for event in record.events:
        if isinstance(event, Arrival) and event.truth is not None:
            table = found.setdefault(event.goal, np.full((record.manifest.rounds, 3), np.nan))
            table[event.round] = event.truth.array()
    return found


def precision_mm(poses: FloatArray) -> float:
    return 1000 * float(position_precision(poses[np.isfinite(poses).all(axis=1)][None])[0])


def show_short(record: RunRecord, world: World, out: Path) -> None:
    method = record.manifest.method
    folder = pictures(record, world, load_lab("tsrb_short_cameras"), out / f"short-{method}")
    print(
        f"\ntsrb_short, {method}, outside-in, three cameras of 1280 x 720 tilted by 30 degrees;"
        " 0.3 degrees and 1 mm of sway"
    )
    show_table(visits(record), visits(measured(folder)), visits(measured(folder, published=True)), 1.0)


def show_long(record: RunRecord, world: World, out: Path) -> None:
    folder = pictures(record, world, load_lab("tsrb_long_ceiling"), out / "long")
    print("\ntsrb_long, inside-out, four tags on the ceiling over each waypoint; 0.3 degrees and 1 mm of sway")
    show_table(visits(record), visits(measured(folder)), visits(measured(folder, published=True)), 2.0)


def show_table(
    true: dict[int, FloatArray], ours: dict[int, FloatArray], theirs: dict[int, FloatArray], limit: float
) -> None:
    """Precision E (mm) at every waypoint that was measured, and whether the same rounds count as reached."""
    print("waypoint  rounds  true E   ours   error  published   error   (mm)")
    errors, same = [], True
    for goal in sorted(ours):
        same = same and bool((np.isnan(ours[goal]) == np.isnan(true[goal])).all())
        E, mine, other = precision_mm(true[goal]), precision_mm(ours[goal]), precision_mm(theirs[goal])
        errors.append(mine - E)
        rounds = int(np.isfinite(ours[goal][:, 0]).sum())
        print(f"{goal + 1:8d} {rounds:7d} {E:7.2f} {mine:6.2f} {mine - E:+7.2f} {other:10.2f} {other - E:+7.2f}")
    worst = float(np.abs(errors).max())
    print(f"largest error of E {worst:.2f} mm, {'within' if worst <= limit else 'BEYOND'} {limit:g} mm;", end=" ")
    print(f"completeness {'identical' if same else 'DIFFERENT'}")


def show_budget(record: RunRecord, world: World, out: Path) -> None:
    lab = load_lab("tsrb_short_cameras")
    camera = lab.cameras[0]
    plain = camera.lens.model_copy(update={"distortion": (0.0,) * 5})
    down = camera.mount.model_copy(update={"tilt": 0.0})
    perfect = lab.model_copy(
        update={
            "photo": _PERFECT,
            "sway": Unevenness(tilt=0.0, height=0.0),
            "cameras": (camera.model_copy(update={"lens": plain, "mount": down, "clock_offset": 0.0}),),
        }
    )

    def photo(**change: Any) -> Lab:
        return perfect.model_copy(update={"photo": _PERFECT.model_copy(update=change)})

    def sway(**change: Any) -> Lab:
        return perfect.model_copy(update={"sway": Unevenness(**{"tilt": 0.0, "height": 0.0, **change})})

    def eye(**change: Any) -> Lab:
        return perfect.model_copy(update={"cameras": (perfect.cameras[0].model_copy(update=change),)})

    tag = lab.tag.height if lab.tag is not None else 0.0
    everything = lab.model_copy(
        update={"cameras": (camera,), "photo": lab.photo.model_copy(update={"rate": 1.0, "before": 6.0, "after": 0.0})}
    )
    cases: list[tuple[str, Lab, Callable[[Path], None] | None]] = [
        ("perfect: straight down, no distortion, sharp, noiseless", perfect, None),
        ("blur, sigma 2 px", photo(softness=2.0), None),
        ("read noise 8 of 255", photo(noise=8.0), None),
        ("JPEG quality 40", photo(quality=40), None),
        ("shutter open for 1/30 s", photo(shutter=1 / 30), None),
        ("distortion, calibrated", eye(lens=camera.lens), None),
        ("distortion, ignored", eye(lens=camera.lens), without_distortion),
        ("camera tilted by 30 degrees", eye(mount=camera.mount), None),
        ("robot sways 0.3 degrees about its tag", sway(tilt=0.3, pivot=tag), None),
        ("robot sways 0.3 degrees about its wheels", sway(tilt=0.3, pivot=0.0), None),
        ("robot 1 mm up and down", sway(height=0.001), None),
        ("clock 2 s ahead, estimated from the pictures", eye(clock_offset=2.0), with_clock("estimate")),
        ("clock 2 s ahead, unknown", eye(clock_offset=2.0), with_clock(0.0)),
        ("all as in tsrb_short_cameras", everything, None),
    ]
    print(
        f"\nOne camera over waypoints {', '.join(map(str, camera.waypoints))} of tsrb_short; errors of single arrivals"
    )
    print("within a waypoint, root mean square per axis; largest error of E; arrivals measured")
    true = visits(record)
    for number, (name, wanted, spoil) in enumerate(cases):
        folder = out / f"budget{number:02d}"
        if not folder.exists():
            pictures(record, world, wanted, folder)
            if spoil is not None:
                spoil(folder)
        try:
            said = budget_line(true, visits(measured(folder)), camera)
        except InputError as error:
            said = f"refused: {error}"
        print(f"{name:56s} {said}", flush=True)


def budget_line(true: dict[int, FloatArray], seen: dict[int, FloatArray], camera: LabOverheadCamera) -> str:
    goals = [waypoint - 1 for waypoint in camera.waypoints if waypoint - 1 in seen]
    shifts, turns, errors = [], [], []
    for goal in goals:
        both = np.isfinite(seen[goal]).all(axis=1)
        one, other = true[goal][both], seen[goal][both]
        difference = np.exp(1j * (other[:, 2] - one[:, 2]))
        turn = difference.mean() / abs(difference.mean())  # no camera knows `map`: each waypoint has a frame of its own
        turns.append(np.angle(difference / turn))
        moved = deviations(other) / turn - deviations(one)
        shifts.append(np.concatenate([moved.real, moved.imag]))
        errors.append(precision_mm(seen[goal]) - precision_mm(true[goal]))
    shift, heading = np.concatenate(shifts), np.degrees(np.concatenate(turns))
    return (
        f"{1000 * np.sqrt((shift**2).mean()):7.3f} mm {np.sqrt((heading**2).mean()):7.3f} deg"
        f" {max(errors, key=abs):+7.2f} mm {len(heading):4d} of {sum(len(true[goal]) for goal in goals)}"
    )


def deviations(poses: FloatArray) -> npt.NDArray[np.complex128]:
    """(M,) x + iy of poses from their mean."""
    at = poses[:, 0] + 1j * poses[:, 1]
    return np.asarray(at - at.mean())


def without_distortion(folder: Path) -> None:
    """Make the calibration say that the lens does not bend."""
    for file in (folder / "calibration").glob("*.yaml"):
        content = yaml.safe_load(file.read_text())
        content["distortion_coefficients"]["data"] = [0.0] * 5
        file.write_text(yaml.safe_dump(content))


def with_clock(offset: float | str) -> Callable[[Path], None]:
    """Make the setup say so of its cameras' clocks."""

    def spoil(folder: Path) -> None:
        setup = yaml.safe_load((folder / OUTSIDE_IN).read_text())
        for camera in setup["cameras"]:
            camera["clock_offset"] = offset
        (folder / OUTSIDE_IN).write_text(yaml.safe_dump(setup))

    return spoil


if __name__ == "__main__":
    main()
