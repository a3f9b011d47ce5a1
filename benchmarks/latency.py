"""What a slower computer costs: precision, completeness and dropped frames while `cpu_scale` goes from 1 to 8.

    python benchmarks/latency.py [--methods kiss_icp,voxel_size=0.2 orb_slam3 ...] [--scales 1 2 4 8] [--runs FOLDER]
    python benchmarks/latency.py --draw                      # the figure again from the table

Every run tours a scenario without a map with `measured` latency: a frame keeps the method busy for the CPU time that it
took, times `cpu_scale`; its pose arrives that late, and frames that come meanwhile are dropped (design D3). A robot
whose computer is four times slower than this machine is `cpu_scale` 4. Finished runs in FOLDER are kept, so a stopped
series goes on where it was. Writes docs/data/latency.csv and docs/images/latency.png, in which rows measured earlier on
the same machine stay; a method that is not installed is left out with the reason.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np

from common import aws_world, machine_line
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage, set_stage
from taskslam.cli.options import parse_options
from taskslam.errors import MethodUnavailableError
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.record import load_run
from taskslam.report.markers import method_styles
from taskslam.report.palette import HAIRLINE, INK, MUTED
from taskslam.scenario import load_scenario
from taskslam.slam.guest.latency import LatencyMode, LatencyModel

mpl.use("Agg")
import matplotlib.pyplot as plt

_DOCS = Path(__file__).parents[1] / "docs"
_TABLE, _FIGURE = _DOCS / "data" / "latency.csv", _DOCS / "images" / "latency.png"
_METHODS = ("karto", "kiss_icp", "kiss_icp,voxel_size=0.2", "orb_slam3")
Row = dict[str, str]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="house")
    parser.add_argument("--methods", nargs="+", default=_METHODS)
    parser.add_argument("--scales", nargs="+", type=float, default=(1.0, 2.0, 4.0, 8.0))
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--waypoints", type=int, default=6, help="how many of the tour's, from the first on")
    parser.add_argument("--runs", type=Path, help="where the runs are kept; default: nowhere")
    parser.add_argument("--draw", action="store_true", help="only draw the figure from the table")
    chosen = parser.parse_args()
    if not chosen.draw:
        with tempfile.TemporaryDirectory() as scratch:
            stage = set_up(chosen.scenario, chosen.rounds, chosen.waypoints)
            series(stage, chosen.methods, chosen.scales, chosen.runs or Path(scratch))
    draw()


def set_up(scenario: str, rounds: int, waypoints: int) -> Stage:
    """The scenario's world, and its tour up to so many waypoints."""
    world = aws_world(scenario) if scenario.startswith("aws_") else None
    path = [0, *range(waypoints)]  # its first entry is the start and no goal
    overrides = [f"protocol.rounds={rounds}", f"sequence.path={path}"]
    return set_stage(load_scenario(scenario, overrides), [world] if world is not None else [], Observer())


def series(stage: Stage, methods: list[str], scales: list[float], folder: Path) -> None:
    """Each method at each scale; the table is written after each run."""
    print(machine_line())
    for method in methods:
        for scale in scales:
            try:
                row = measure(stage, method, scale, folder / f"{method}-x{scale:g}")
            except MethodUnavailableError as reason:
                print(f"{method}: left out: {reason}", flush=True)
                break
            print(", ".join(f"{key} {value}" for key, value in row.items()), flush=True)
            add_to_table(row)


def measure(stage: Stage, method: str, scale: float, folder: Path) -> Row:
    """Drive one run and say what came of it. E: mean distance of a waypoint's arrivals to their mean (eq. (2)).

    method: its name, and options after commas.
    """
    name, *pairs = method.split(",")
    spec = stage.spec(
        name, Mode.WITHOUT_MAP, options=parse_options(pairs), latency=LatencyModel(LatencyMode.MEASURED, scale)
    )
    directory, _ = run(stage, spec, folder)
    metrics = run_metrics(load_run(directory), method)
    spread = [w.position.precision_m for w in metrics.waypoints if w.complete and w.position.precision_m is not None]
    low, high = np.quantile(spread, (0.25, 0.75)) if spread else (None, None)
    seen = metrics.frames - metrics.dropped_frames
    return {
        "scenario": metrics.scenario,
        "method": method,
        "cpu_scale": f"{scale:g}",
        "rounds": str(metrics.rounds),
        "waypoints": str(metrics.planned_waypoints),
        "completeness": f"{metrics.completeness:.4f}",
        "E_mean_cm": _centimetres(metrics.position.precision_m),
        "E_lower_quartile_cm": _centimetres(low),
        "E_upper_quartile_cm": _centimetres(high),
        "frames": str(metrics.frames),
        "dropped": f"{metrics.dropped_frames / max(metrics.frames, 1):.4f}",
        "cpu_ms_per_frame": f"{1e3 * metrics.compute_s / max(seen, 1):.2f}",
        "failures": "; ".join(f"waypoint {f.goal + 1}: {f.outcome}" for f in metrics.failures),
    }


def read_table() -> tuple[str, list[Row]]:
    """The machine on which cpu_scale is 1, and the rows."""
    with _TABLE.open(newline="", encoding="utf-8") as file:
        machine = file.readline().removeprefix("# ").strip()
        return machine, list(csv.DictReader(file))


def add_to_table(row: Row) -> None:
    """Put a row in the place of the same measurement's, if the table is this machine's; else begin a new one."""
    machine, rows = read_table() if _TABLE.exists() else ("", [])
    same = [
        other for other in rows if machine.split(";")[0] == machine_line().split(";")[0] and _key(other) != _key(row)
    ]
    _TABLE.parent.mkdir(exist_ok=True)
    with _TABLE.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {machine_line()}\n")
        writer = csv.DictWriter(file, list(row), lineterminator="\n")
        writer.writeheader()
        writer.writerows(sorted([*same, row], key=_key))


def _key(row: Mapping[str, str]) -> tuple[str, str, float]:
    return row["scenario"], row["method"], float(row["cpu_scale"])


def draw() -> None:
    """Three panels over cpu_scale from the table."""
    machine, rows = read_table()
    methods = list(dict.fromkeys(row["method"] for row in rows))
    colours = {name: style.colour for name, style in method_styles(methods).items()}
    plt.rcParams.update({"font.size": 10, "axes.edgecolor": MUTED, "text.color": INK, "axes.labelcolor": INK})
    figure, panels = plt.subplots(1, 3, figsize=(11, 3.9), layout="constrained")
    for number, method in enumerate(methods):
        own = [row for row in rows if row["method"] == method]
        style = {"color": colours[method], "marker": "osD^v"[number % 5], "markersize": 6, "linewidth": 1.8}
        # Side by side within a scale, so that methods that agree do not hide one another.
        x = np.array([float(row["cpu_scale"]) for row in own]) * 2 ** (0.11 * (number - (len(methods) - 1) / 2))
        middle, low, high = (
            np.array([float(row[key] or "nan") for row in own])
            for key in ("E_mean_cm", "E_lower_quartile_cm", "E_upper_quartile_cm")
        )
        panels[0].vlines(x, low, high, color=colours[method], linewidth=5, alpha=0.25)
        panels[0].plot(x, middle, **style)
        panels[1].plot(x, [100 * float(row["completeness"]) for row in own], **style)
        label = f"{method.replace(',', ' ')}: {float(own[0]['cpu_ms_per_frame']):.0f} ms"
        panels[2].plot(x, [100 * float(row["dropped"]) for row in own], label=label, **style)
    titles = ("Precision E, cm", "Completeness, %", "Dropped frames, %")
    scales = sorted({float(row["cpu_scale"]) for row in rows})
    panels[1].set_xlabel("the robot's computer: times slower than the machine measured on")
    for panel, title in zip(panels, titles, strict=True):
        panel.set_title(title, loc="left", fontweight="bold", fontsize=11)
        panel.set_xscale("log", base=2)
        panel.set_xticks(scales, [f"{scale:g}×" for scale in scales])
        panel.minorticks_off()
        panel.grid(axis="y", color=HAIRLINE)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylim(bottom=0)
    for panel in panels[1:]:
        panel.set_ylim(-4, 104)
    figure.legend(*panels[2].get_legend_handles_labels(), loc="outside upper left", ncols=len(methods), frameon=False)
    scenarios = ", ".join(dict.fromkeys(row["scenario"] for row in rows))
    tours = " and ".join(dict.fromkeys(f"{row['rounds']} rounds of {row['waypoints']} waypoints" for row in rows))
    figure.supxlabel(
        f"{scenarios}, {tours}, without a map. ms: CPU time of a frame at 1×.\n"
        f"E: mean over complete waypoints, bars from quartile to quartile. 1×: {machine.split(';')[0]}",
        fontsize=8,
        color=MUTED,
    )
    _FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(_FIGURE, dpi=150)
    print(f"{_TABLE.name} and {_FIGURE.name} stand in {_DOCS}")


def _centimetres(metres: float | None) -> str:
    return "" if metres is None else f"{100 * metres:.3f}"


if __name__ == "__main__":
    main()
