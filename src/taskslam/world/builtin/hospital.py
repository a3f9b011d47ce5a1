"""`hospital`: one floor of 25 m by 56 m around two corridors; sized as the AWS hospital.

    +-------------------------------------------+   y = 28
    |                   lobby                   |
    +---------+  +--------------+  +------------+   y = 16
    | ward 1  =  |  pharmacy    |  =    exam    |
    +---------+  +--------------+  +------------+   y = 8
    | ward 2  =  |  staff room  =  =   ward 5   |
    +---------+  +--------------+  +------------+   y = 0.5
    | ward 3  =  = nurses       =  =   ward 6   |
    +---------+  +--------------+  +------------+   y = -7
    | ward 4  =  =  theatre     =  =  recovery  |
    +---------+  +--------------+  +------------+   y = -15
    | dining  =  =  store       |  =   physio   |
    |         |  +--------------+  +------------+   y = -22
    |         |      link       |  =   doctors  |
    +-------------------------------------------+   y = -28
  x = -12.5  -5.2  -2.6         2.6  5.2       12.5

The corridors are 2.5 m wide, 44 m long and plain: even paint, a wall guard and a handrail give a camera little to
hold on to, and few things that a laser sees between the doors. Rooms are furnished and differ. Doors are 1.3 m wide.
Built from one seed, the same bytes on every machine.
"""

from __future__ import annotations

from taskslam.world.builtin import hospital_rooms as rooms
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.lamps import hang_lamps
from taskslam.world.builtin.palettes import HospitalPalette
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

SEED = 47
LOW, HIGH = (-12.5, -28.0), (12.5, 28.0)
HEIGHT = 2.8
INNER_WALL = 0.14
_DOOR = 1.36  # between the linings it is 1.30 m


def build_hospital() -> World:
    """Build the world `hospital`, frame `map` with its origin in the middle of the floor, z = 0 on the floor."""
    b = Builder(SEED)
    p = HospitalPalette(b, SEED)
    trim = Trim(ceiling=p.ceiling_tiles, skirting=p.white_wood, frame=p.oak, sill=p.porcelain, height=HEIGHT)
    windows = _windows(p)
    openings = [*doorways(), *windows]
    build_shell(b, LOW, HIGH, windows, p.facade, p.core, HEIGHT)
    floor_plan = _rooms(p)
    for room in floor_plan:
        build_room(b, room, openings, trim)
    build_openings(b, openings, p.corridor_floor, trim, INNER_WALL)
    lights = hang_lamps(b, floor_plan, HEIGHT, p.light_panel)
    rooms.furnish_lobby(b, p)
    rooms.furnish_corridors(b, p)
    rooms.furnish_wards(b, p)
    rooms.furnish_core(b, p)
    rooms.furnish_care(b, p)
    return b.world("hospital", lights, (0.50, 0.50, 0.50), (0.74, 0.82, 0.90))


def _rooms(p: HospitalPalette) -> list[Room]:
    def room(
        name: str, x0: float, y0: float, x1: float, y1: float, floor: Surface, wall: Surface, **accent: Surface
    ) -> Room:
        low, high = room_between((x0, y0), (x1, y1), (LOW, HIGH), INNER_WALL)
        sides = {"-x" if key == "west" else "+x": surface for key, surface in accent.items()}
        return Room(name, low, high, floor, wall, sides)

    def corridor(name: str, x0: float, y0: float, x1: float, y1: float) -> Room:
        low, high = room_between((x0, y0), (x1, y1), (LOW, HIGH), INNER_WALL)
        return Room(name, low, high, p.corridor_floor, p.plain_wall, dado=p.dado, rail=p.oak)

    return [
        room("lobby", -12.5, 16, 12.5, 28, p.lobby_floor, p.lobby_wall, east=p.green_wall),
        corridor("west corridor", -5.2, -28, -2.6, 16),
        corridor("east corridor", 2.6, -28, 5.2, 16),
        corridor("link", -2.6, -28, 2.6, -22),
        room("ward 1", -12.5, 8, -5.2, 16, p.ward_floor, p.blue_wall, west=p.plain_wall),
        room("ward 2", -12.5, 0.5, -5.2, 8, p.ward_floor, p.yellow_wall),
        room("ward 3", -12.5, -7, -5.2, 0.5, p.care_floor, p.green_wall, west=p.plain_wall),
        room("ward 4", -12.5, -15, -5.2, -7, p.ward_floor, p.peach_wall),
        room("dining room", -12.5, -28, -5.2, -15, p.oak_floor, p.lobby_wall, west=p.green_wall),
        room("pharmacy", -2.6, 8, 2.6, 16, p.care_floor, p.plain_wall),
        room("staff room", -2.6, 0.5, 2.6, 8, p.oak_floor, p.yellow_wall, west=p.peach_wall),
        room("nurses' station", -2.6, -7, 2.6, 0.5, p.office_floor, p.blue_wall),
        room("theatre", -2.6, -15, 2.6, -7, p.care_floor, p.theatre_wall),
        room("store", -2.6, -22, 2.6, -15, p.corridor_floor, p.plain_wall),
        room("examination", 5.2, 8, 12.5, 16, p.care_floor, p.green_wall, east=p.plain_wall),
        room("ward 5", 5.2, 0.5, 12.5, 8, p.ward_floor, p.peach_wall, east=p.plain_wall),
        room("ward 6", 5.2, -7, 12.5, 0.5, p.ward_floor, p.yellow_wall, east=p.blue_wall),
        room("recovery", 5.2, -15, 12.5, -7, p.care_floor, p.blue_wall, east=p.plain_wall),
        room("physiotherapy", 5.2, -22, 12.5, -15, p.oak_floor, p.green_wall, east=p.yellow_wall),
        room("doctors", 5.2, -28, 12.5, -22, p.office_floor, p.lobby_wall, east=p.blue_wall),
    ]


def doorways() -> list[Opening]:
    """Return the passages between rooms, in metres of the world."""

    def door(at: float, y: float, wide: float = _DOOR) -> Opening:
        return Opening("x", at, y - wide / 2, y + wide / 2)

    return [
        Opening("y", 16, -5.0, -2.8, top=2.4),
        Opening("y", 16, 2.8, 5.0, top=2.4),
        *(door(-5.2, y) for y in (12.0, 4.2, -3.2, -11.0, -18.0)),
        *(door(5.2, y) for y in (11.4, 4.4, -3.4, -10.6, -18.6, -25.0)),
        door(-2.6, -3.2, 2.4),
        door(2.6, -3.2, 2.4),
        door(-2.6, -11.4, 1.6),
        door(2.6, -10.2, 1.6),
        door(-2.6, -18.6),
        door(2.6, 4.6),
        door(2.6, 12.2),
        door(-2.6, -25.2, 2.2),
        door(2.6, -25.2, 2.2),
    ]


def _windows(p: HospitalPalette) -> list[Opening]:
    west, east = LOW[0] - OUTER_WALL / 2, HIGH[0] + OUTER_WALL / 2
    south, north = LOW[1] - OUTER_WALL / 2, HIGH[1] + OUTER_WALL / 2

    def row(wall: str, at: float, middles: tuple[float, ...], wide: float, bottom: float) -> list[Opening]:
        return [
            Opening(wall, at, s - wide / 2, s + wide / 2, bottom, 2.3, p.views[k % len(p.views)])
            for k, s in enumerate(middles)
        ]

    return [
        *row("x", west, (-24.5, -18.5, -11.0, -3.2, 4.2, 12.0), 2.2, 0.95),
        *row("x", east, (-25.0, -18.5, -11.0, -3.2, 4.2, 12.0), 2.0, 1.0),
        *row("x", west, (20.0, 24.5), 2.8, 0.6),
        *row("x", east, (20.0, 24.5), 2.8, 0.6),
        *row("y", north, (-9.0, -5.0, 5.0, 9.0), 2.6, 0.6),
        Opening("y", north, -1.7, 1.7, 0.0, 2.4, p.views[2]),  # the entrance, of glass
        *row("y", south, (-8.8, 0.0, 8.8), 2.4, 0.95),
    ]
