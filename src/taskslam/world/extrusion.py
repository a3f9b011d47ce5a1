"""A world from a floor plan alone: its occupied cells become walls, on a floor and under a ceiling with lamps.

    world = extruded_world(load_floor_plan(Path("office.yaml")), height=2.2, name="office")

Walls stand where occupied cells meet others, so that a laser scan meets what the map shows. Each straight run of wall
has one of several patterned surfaces, and lies differently on it, so that eyes have something to hold on to as well.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.errors import FloorPlanError
from taskslam.geometry import SE2, pose_from_xyz_rpy
from taskslam.world.builtin import prints, textures
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.palette import Palette
from taskslam.world.builtin.textures import Colour
from taskslam.world.floor_plan import FREE, OCCUPIED, FloorPlan
from taskslam.world.world import Light, World

SEED = 41
_MARGIN = 1.0  # m of floor around the outermost known cell
_LAMP_SPACING = 6.0  # m
_PANEL = 4.0  # m of wall with one surface, at most
_MOST_PANELS = 400_000
_LIGHT, _FADING = (0.45, 0.46, 0.46), (0.6, 0.06, 0.06)
_AMBIENT, _BACKGROUND = (0.5, 0.5, 0.5), (0.75, 0.78, 0.80)


class _ShellPalette(Palette):
    """A floor, a ceiling and several walls that differ."""

    def _make_structure(self) -> None:
        bank, dice = self._bank, self._dice
        self.floor = self._add("floor", prints.concrete(bank, dice(), (170, 166, 158)), (4.0, 4.0))
        red: list[Colour] = [(158, 82, 62), (140, 66, 50), (176, 104, 80), (150, 92, 72)]
        leaves: list[Colour] = [(140, 164, 142), (178, 190, 164), (112, 144, 134), (206, 176, 146)]
        confetti: list[Colour] = [(236, 168, 88), (112, 170, 190), (214, 110, 100), (150, 180, 110)]
        glazed: list[Colour] = [(214, 226, 224), (172, 202, 204), (224, 230, 226)]
        self.walls = (
            self._add("brick", textures.bricks(bank, dice(), red, (190, 182, 170)), (2.4, 2.4)),
            self._add("leaves", textures.wallpaper(bank, dice(), (222, 224, 214), leaves), (2.5, 2.5)),
            self._add("confetti", textures.wallpaper(bank, dice(), (232, 226, 210), confetti, count=110), (2.7, 2.7)),
            self._add(
                "tiles", textures.tiles(bank, dice(), glazed, (120, 150, 154), count=16, ornament=0.2), (2.4, 2.4)
            ),
        )

    def _make_furniture(self) -> None:
        """Nothing is furnished."""


def extruded_world(plan: FloorPlan, height: float, name: str) -> World:
    """The world whose walls, `height` m high, stand on the occupied cells of a floor plan; frame `map`, floor at z = 0.

    The same plan gives the same bytes.

    Raises FloorPlanError if the plan has no wall, or more of them than a floor plan can have.
    """
    occupied = plan.cells == OCCUPIED
    if not occupied.any():
        raise FloorPlanError(f"the floor plan of '{name}' has no occupied cell: expected walls to raise")
    builder = Builder(SEED)
    palette = _ShellPalette(builder, SEED)
    origin = plan.origin
    with builder.model("walls", origin.x, origin.y, math.degrees(origin.theta)):
        _raise_walls(builder, palette.walls, occupied, plan.resolution, height, name)
    known = _known(plan)
    with builder.model("floor and ceiling", origin.x, origin.y, math.degrees(origin.theta)):
        (x0, y0), (x1, y1) = known - _MARGIN * np.array([[1.0], [-1.0]])
        builder.panel((x0, y0, 0.0), (x1 - x0, 0.0, 0.0), (0.0, y1 - y0, 0.0), palette.floor)
        builder.panel((x0, y0, height), (0.0, y1 - y0, 0.0), (x1 - x0, 0.0, 0.0), palette.ceiling, solid=False)
    return builder.world(name, _lamps(plan, known, height), _AMBIENT, _BACKGROUND)


def _raise_walls(
    b: Builder, surfaces: tuple[Surface, ...], occupied: npt.NDArray[np.bool_], cell: float, height: float, name: str
) -> None:
    longest = max(1, round(_PANEL / cell))
    across_x, across_y = _borders(occupied, longest), _borders(occupied.T, longest)
    if (count := len(across_x) + len(across_y)) > _MOST_PANELS:
        raise FloorPlanError(
            f"the floor plan of '{name}' has {count} pieces of wall; expected at most {_MOST_PANELS}: is it a photo?"
        )
    up = (0.0, 0.0, height)
    for line, begin, end, side in across_x.tolist():
        start, along = (begin, end - begin) if side > 0 else (end, begin - end)
        b.panel((line * cell, start * cell, 0.0), (0.0, along * cell, 0.0), up, b.dice.choice(surfaces))
    for line, begin, end, side in across_y.tolist():
        start, along = (end, begin - end) if side > 0 else (begin, end - begin)
        b.panel((start * cell, line * cell, 0.0), (along * cell, 0.0, 0.0), up, b.dice.choice(surfaces))


def _borders(occupied: npt.NDArray[np.bool_], longest: int) -> npt.NDArray[np.int64]:
    """(N, 4) straight pieces of wall between columns, none longer than `longest` rows.

    Each: the column before which it stands, its first and last row + 1, and the side seen (+1: from higher columns).
    """
    solid = np.pad(occupied, ((0, 0), (1, 1))).astype(np.int8)
    side = solid[:, :-1] - solid[:, 1:]
    cuts = np.diff(side, axis=0, prepend=2, append=2) != 0
    cuts[::longest] = True
    columns, rows = np.nonzero(cuts.T)
    begin, end = rows[:-1], rows[1:]
    same = (columns[:-1] == columns[1:]) & (side[np.minimum(begin, len(side) - 1), columns[:-1]] != 0)
    begin, end, column = begin[same], end[same], columns[:-1][same]
    return np.stack([column, begin, end, side[begin, column]], axis=1).astype(np.int64)


def _known(plan: FloorPlan) -> npt.NDArray[np.float64]:
    """(2, 2) lowest and highest x, y of the free and occupied cells, m in the grid's frame."""
    rows, columns = np.nonzero((plan.cells == FREE) | (plan.cells == OCCUPIED))
    low, high = (columns.min(), rows.min()), (columns.max() + 1, rows.max() + 1)
    return np.array([low, high], np.float64) * plan.resolution


def _lamps(plan: FloorPlan, known: npt.NDArray[np.float64], height: float) -> tuple[Light, ...]:
    """A lamp below the ceiling wherever a point of a wide grid is free."""
    counts = np.maximum(np.round((known[1] - known[0]) / _LAMP_SPACING), 1).astype(int)
    steps = (known[1] - known[0]) / counts
    lamps = []
    for i, j in np.ndindex(*counts):
        x, y = known[0] + (np.array([i, j]) + 0.5) * steps
        at = plan.origin @ SE2(x, y)
        if plan.at(at.x, at.y) == FREE:
            pose = pose_from_xyz_rpy((at.x, at.y, height - 0.3), (0.0, 0.0, 0.0))
            lamps.append(Light("lamp", "point", pose, diffuse=_LIGHT, attenuation_range=9.0, attenuation=_FADING))
    return tuple(lamps)
