"""What a run did over the time of its rounds: how far SLAM was off, and how long the method took over a frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from taskslam.errors import RecordError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record import RunRecord
from taskslam.report import palette
from taskslam.report.log_axis import CENTIMETRE, log_axis
from taskslam.report.poses_over_time import poses_at
from taskslam.report.svg import Svg
from taskslam.report.tracks import Tracks

_WIDTH, _HEIGHT = 520.0, 250.0
_LEFT, _TOP, _RIGHT, _BOTTOM = 54.0, 14.0, 58.0, 44.0
_SAMPLES = 260  # of a round
_LOWEST = 1e-3  # of the largest value: what is smaller is drawn here
_STEPS = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 36000)  # s between two ticks


@dataclass(frozen=True)
class _Line:
    """A round. times: (K,) s from its beginning; values: (K,), NaN where unknown."""

    name: str
    priming: bool
    times: FloatArray
    values: FloatArray


def error_figure(record: RunRecord, tracks: Tracks, names: tuple[str, ...], colour: str) -> Markup | None:
    """Draw metres from truth to estimate of every round; None where no round has both.

    names: of the rounds begun; colour: of the method.
    """
    lines = []
    for start, name in zip(record.rounds(), names, strict=True):
        truth, estimate = tracks.get(start.round, "truth"), tracks.get(start.round, "estimate")
        if len(truth) and len(estimate):
            stamps = np.linspace(start.t, truth.stamps[-1], _SAMPLES).astype(np.int64)
            off = poses_at(truth, stamps)[:, :2] - poses_at(estimate, stamps)[:, :2]
            lines.append(_Line(name, start.priming, (stamps - start.t) / NANOSECONDS, np.hypot(*off.T)))
    diameter = record.manifest.robot_diameter
    return _figure(lines, "SLAM off by, cm", CENTIMETRE, colour, diameter)


def frames_figure(record: RunRecord, names: tuple[str, ...], colour: str) -> tuple[Markup | None, list[str]]:
    """Draw the longest compute time of a frame in each of some stretches of every round, and what cannot be read.

    None where no round kept any.
    """
    lines, damage = [], []
    for start, name in zip(record.rounds(), names, strict=True):
        try:
            times = record.frame_times(start.round)
        except RecordError as error:
            damage.append(str(error))
            continue
        if len(times):
            parts = np.array_split(np.arange(len(times)), min(_SAMPLES, len(times)))
            at = np.array([(times.stamps[part[-1]] - start.t) / NANOSECONDS for part in parts])
            longest = np.array([times.compute_s[part].max() for part in parts]) * 1000
            lines.append(_Line(name, start.priming, at, longest))
    return _figure(lines, "compute time of a frame, ms", 1.0, colour, None), damage


def _figure(lines: list[_Line], label: str, unit: float, colour: str, diameter: float | None) -> Markup | None:
    """Draw lines on a logarithmic axis of `unit`, with a second one of robot diameters; later rounds darker."""
    known = [line.values[np.isfinite(line.values)] for line in lines]
    every = np.concatenate(known) if known else np.empty(0)
    if not len(every) or float(every.max()) <= 0:
        return None
    lowest = _LOWEST * float(every.max())
    axis = log_axis(np.maximum([every.min(), every.max()], lowest), unit)
    longest = max(float(line.times[-1]) for line in lines)
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM
    svg = Svg(_WIDTH, _HEIGHT, f"{label}, over the time of {len(lines)} rounds")

    def y_of(value: float) -> float:
        return bottom - axis.share(value) * (bottom - _TOP)

    with svg.group(font_size=12, fill=palette.MUTED):
        for tick in axis.ticks(unit, 7):
            y = y_of(tick * unit)
            svg.line(_LEFT, y, right, y, stroke=palette.HAIRLINE, stroke_width=1)
            svg.text(_LEFT - 8, y + 4, f"{tick:g}", text_anchor="end")
        for tick in axis.ticks(diameter, 5) if diameter else []:
            y = y_of(tick * (diameter or 1.0))
            svg.line(right, y, right + 5, y, stroke=palette.MUTED, stroke_width=1)
            svg.text(right + 8, y + 4, f"{tick:g} D")
        step = next((step for step in _STEPS if longest / step <= 8), _STEPS[-1])
        for second in range(0, math.floor(longest) + 1, step):
            x = _LEFT + second / longest * (right - _LEFT)
            svg.line(x, bottom, x, bottom + 5, stroke=palette.MUTED, stroke_width=1)
            svg.text(x, bottom + 19, f"{second:g}", text_anchor="middle")
        svg.text((_LEFT + right) / 2, bottom + 38, "time of the round, s", text_anchor="middle")
        middle = (_TOP + bottom) / 2
        svg.text(13, middle, label, text_anchor="middle", transform=f"rotate(-90 13 {middle:g})")
    counted = max(sum(not line.priming for line in lines), 1)
    drawn = 0
    for line in lines:
        drawn += not line.priming
        ink = (
            {"stroke": palette.MUTED, "stroke_dasharray": "2 3"}
            if line.priming
            else {"stroke": colour, "stroke_opacity": round(0.35 + 0.65 * drawn / counted, 2)}
        )
        with svg.group(stroke_width=1.3, stroke_linejoin="round", **ink):
            svg.add("title", line.name)
            there = np.flatnonzero(np.isfinite(line.values))
            for rows in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1):
                if len(rows) > 1:
                    ys = [y_of(float(value)) for value in line.values[rows]]
                    svg.polyline(np.column_stack([_LEFT + line.times[rows] / longest * (right - _LEFT), ys]))
    return svg.markup()
