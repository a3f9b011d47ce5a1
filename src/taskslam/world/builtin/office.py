"""`office`: a floor of 50 m by 30 m around two long corridors; it stands for the fourth floor of TSRB.

    +-------------+--------+---------+----------+-----------+   y = 15
    |   office    | meeting| lounge  |   lab    |  office   |
    +-----=-------+---=----+----=----+----=-----+-----=-----+   y = 5.8
    |                                                       |
    |  +---=----+-------+------+ +-----+-------+-------+ +  |   y = 3.6
    |  |  copy  | wash  |stairs| |serv.|meeting| store |    |
    |  +--------+-------+------+ +-----+---=---+-------+ +  |   y = -3.6
    |                                                       |
    +-----=-------+-----+----+-----=----+----+----+---=-----+   y = -5.8
    |   seminar   |closed|cl.|  library |  closed |workshop |
    +-------------+------+---+----------+----+----+---------+   y = -15
  x = -25       -13         -3          7        16        25

The corridors are 2 m wide and 50 m long, plain and alike on purpose: even paint, the same doors in niches at even
distances, most of them closed. What tells places apart are notice boards, plates, machines and the rooms. Open doors
are 1.1 m wide. Built from one seed, the same bytes on every machine.
"""

from __future__ import annotations

from taskslam.world.builtin import office_rooms as rooms
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.lamps import hang_lamps
from taskslam.world.builtin.palettes import OfficePalette
from taskslam.world.builtin.structure import (
    OUTER_WALL,
    Opening,
    Room,
    Trim,
    build_openings,
    build_room,
    build_shell,
    room_between,
)
from taskslam.world.world import World

SEED = 59
LOW, HIGH = (-25.0, -15.0), (25.0, 15.0)
HEIGHT = 2.8
INNER_WALL = 0.30
_DOOR = 1.16  # between the linings it is 1.10 m


def build_office() -> World:
    """Build the world `office`, frame `map` with its origin in the middle of the floor, z = 0 on the floor."""
    b = Builder(SEED)
    p = OfficePalette(b, SEED)
    trim = Trim(ceiling=p.ceiling_tiles, skirting=p.black, frame=p.steel, sill=p.steel, height=HEIGHT)
    windows = _windows(p)
    openings = [*doorways(), *_closed_doors(p), *windows]
    build_shell(b, LOW, HIGH, windows, p.brick, p.core, HEIGHT)
    floor_plan = _rooms(p)
    for room in floor_plan:
        build_room(b, room, openings, trim)
    build_openings(b, openings, p.corridor_floor, trim, INNER_WALL)
    lights = hang_lamps(b, floor_plan, HEIGHT, p.light_panel)
    rooms.furnish_corridors(b, p)
    rooms.furnish_north(b, p)
    rooms.furnish_core(b, p)
    rooms.furnish_south(b, p)
    return b.world("office", lights, (0.50, 0.50, 0.49), (0.74, 0.82, 0.90))


def _rooms(p: OfficePalette) -> list[Room]:
    def room(
        name: str,
        x: tuple[float, float],
        y: tuple[float, float],
        floor: Surface,
        wall: Surface,
        accent: str,
        far: Surface,
    ) -> Room:
        low, high = room_between((x[0], y[0]), (x[1], y[1]), (LOW, HIGH), INNER_WALL)
        return Room(name, low, high, floor, wall, {accent: far})

    def corridor(name: str, x: tuple[float, float], y: tuple[float, float]) -> Room:
        low, high = room_between((x[0], y[0]), (x[1], y[1]), (LOW, HIGH), INNER_WALL)
        return Room(name, low, high, p.corridor_floor, p.plain_wall)

    north, south, core = (5.8, 15.0), (-15.0, -5.8), (-3.6, 3.6)
    white = p.white_wall
    return [
        corridor("north corridor", (-25, 25), (3.6, 5.8)),
        corridor("south corridor", (-25, 25), (-5.8, -3.6)),
        corridor("west link", (-25, -22.8), core),
        corridor("middle link", (-1.1, 1.1), core),
        corridor("east link", (22.8, 25), core),
        room("office 1", (-25, -13), north, p.grey_carpet, white, "-x", p.blue_wall),
        room("meeting room", (-13, -5), north, p.blue_carpet, white, "+x", p.ochre_wall),
        room("lounge", (-5, 4), north, p.oak_floor, white, "-x", p.green_wall),
        room("lab", (4, 14), north, p.concrete, white, "+x", p.blue_wall),
        room("office 2", (14, 25), north, p.green_carpet, white, "+x", p.ochre_wall),
        room("copy room", (-22.8, -15), core, p.corridor_floor, white, "-x", p.ochre_wall),
        room("washroom", (-15, -8), core, p.wash_floor, p.wash_wall, "-x", p.wash_wall),
        room("stairs", (-8, -1.1), core, p.concrete, white, "-x", p.brick),
        room("server room", (1.1, 9), core, p.concrete, white, "-x", white),
        room("small meeting room", (9, 16), core, p.blue_carpet, white, "+y", p.green_wall),
        room("store", (16, 22.8), core, p.concrete, white, "-x", white),
        room("seminar room", (-25, -13), south, p.blue_carpet, white, "+x", p.ochre_wall),
        room("closed office 1", (-13, -8), south, p.grey_carpet, white, "-x", p.green_wall),
        room("closed office 2", (-8, -3), south, p.grey_carpet, white, "-x", p.blue_wall),
        room("library", (-3, 7), south, p.oak_floor, white, "+x", p.green_wall),
        room("closed office 3", (7, 11.5), south, p.grey_carpet, white, "-x", p.ochre_wall),
        room("closed office 4", (11.5, 16), south, p.grey_carpet, white, "-x", p.blue_wall),
        room("workshop", (16, 25), south, p.concrete, white, "+x", p.brick),
    ]


def doorways() -> list[Opening]:
    """Return the passages that are open, in metres of the world."""

    def door(wall: str, at: float, middle: float, wide: float = _DOOR, top: float = 2.1) -> Opening:
        return Opening(wall, at, middle - wide / 2, middle + wide / 2, top=top)

    return [
        *(door("y", 5.8, x) for x in (-19.0, -9.5, -0.5, 9.0, 19.5)),
        *(door("y", -5.8, x) for x in (-19.0, 2.0, 20.5)),
        door("y", 3.6, -18.5),
        door("y", -3.6, 12.5),
        # where the corridors meet: as wide as the links
        *(door("y", y, x, 1.8, 2.4) for y in (3.6, -3.6) for x in (-23.95, 0.0, 23.95)),
    ]


def _closed_doors(p: OfficePalette) -> list[Opening]:
    def closed(at: float, middle: float) -> Opening:
        return Opening("y", at, middle - 0.5, middle + 0.5, leaf=p.door_wood)

    return [
        *(closed(5.8, x) for x in (-23.0, -15.0, -6.0, 3.0, 12.5, 15.5, 23.5)),
        *(closed(-5.8, x) for x in (-23.0, -15.0, -10.5, -5.5, -1.5, 5.5, 9.2, 13.7, 17.2, 24.0)),
        *(closed(3.6, x) for x in (-11.5, -4.5, 5.0, 12.5, 19.5)),
        *(closed(-3.6, x) for x in (-18.5, -11.5, -4.5, 5.0, 19.5)),
    ]


def _windows(p: OfficePalette) -> list[Opening]:
    west, east = LOW[0] - OUTER_WALL / 2, HIGH[0] + OUTER_WALL / 2
    south, north = LOW[1] - OUTER_WALL / 2, HIGH[1] + OUTER_WALL / 2

    def row(wall: str, at: float, middles: tuple[float, ...], wide: float) -> list[Opening]:
        return [
            Opening(wall, at, s - wide / 2, s + wide / 2, 0.85, 2.3, p.views[k % len(p.views)])
            for k, s in enumerate(middles)
        ]

    return [
        *row("y", north, (-22.0, -16.0, -9.0, -2.5, 1.5, 6.5, 11.5, 17.0, 22.0), 2.6),
        *row("y", south, (-22.0, -16.0, -10.5, -5.5, -0.5, 4.5, 9.2, 13.7, 18.5, 22.8), 2.6),
        *row("x", west, (10.4, -10.4), 2.6),
        *row("x", east, (10.4, -10.4), 2.6),
        *row("x", west, (4.7, -4.7), 1.3),
        *row("x", east, (4.7, -4.7), 1.3),
    ]
