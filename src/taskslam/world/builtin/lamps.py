"""Ceiling lamps of large floors: where they hang, what is seen of them, the light that they give."""

from __future__ import annotations

from taskslam.geometry import pose_from_xyz_rpy
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.structure import Room
from taskslam.world.world import Light

_SPACING = 11.0  # metres between lamps, about


def hang_lamps(b: Builder, floor_plan: list[Room], height: float, panel: Surface) -> tuple[Light, ...]:
    """Hang flat panels from the ceiling at `height`, spread over every room, and return their lights."""
    lamps = [lamp for room in floor_plan for lamp in _spread(room)]
    for x, y in lamps:
        with b.model("lamp", x, y):
            b.box((-0.3, -0.6, height - 0.03), (0.3, 0.6, height), panel, skip="+z", solid=False)
    return tuple(_light(x, y, height) for x, y in lamps)


def _spread(room: Room) -> list[tuple[float, float]]:
    """Spread lamps over a room's ceiling, one for every 11 m of its sides, about."""
    (x0, y0), (x1, y1) = room.low, room.high
    columns, rows = (max(round((end - start) / _SPACING), 1) for start, end in ((x0, x1), (y0, y1)))
    return [
        (x0 + (i + 0.5) * (x1 - x0) / columns, y0 + (j + 0.5) * (y1 - y0) / rows)
        for j in range(rows)
        for i in range(columns)
    ]


def _light(x: float, y: float, height: float) -> Light:
    """Return the light of one lamp."""
    return Light(
        name="lamp",
        type="point",
        pose=pose_from_xyz_rpy((x, y, height - 0.3), (0.0, 0.0, 0.0)),
        diffuse=(0.62, 0.63, 0.62),
        attenuation_range=13.0,
        attenuation=(0.6, 0.06, 0.06),
    )
