"""`house`: a furnished home of seven rooms, 17 m by 11.7 m, with loops through every room.

    +------------------+----------+----------------------+   y = 5.85
    |     kitchen      |   bath   |       bedroom        |
    |                  |          =                      |
    +--==-------==-----+--==------+----==----------------+   y = 0.95
    |                  =        corridor                 |
    |     living       +-------==--------==--------------+   y = -1.05
    |     room         |    study     |    children      |
    |                  =              =                  |
    +------------------+--------------+------------------+   y = -5.85
  x = -8.5           -1.6            3.2                8.5

Doorways are at least 1.0 m clear. Furniture crosses the height of a laser scan (0.41 m) at different depths, every room
has walls, floor and pictures of its own, so places can be told apart by laser and by camera. Built from one seed, the
same bytes on every machine.
"""

from __future__ import annotations

from taskslam.geometry import pose_from_xyz_rpy
from taskslam.world.builtin import rooms
from taskslam.world.builtin.builder import Builder
from taskslam.world.builtin.palettes import HousePalette
from taskslam.world.builtin.structure import (
    CEILING,
    OUTER_WALL,
    Opening,
    Room,
    Trim,
    build_openings,
    build_room,
    build_shell,
)
from taskslam.world.world import Light, World

SEED = 20
LOW, HIGH = (-8.5, -5.85), (8.5, 5.85)
INNER_WALL = 0.12
_HALF = INNER_WALL / 2


def build_house() -> World:
    """Build the world `house`, frame `map` with its origin in the corridor, z = 0 on the floor."""
    b = Builder(SEED)
    p = HousePalette(b, SEED)
    trim = Trim(ceiling=p.ceiling, skirting=p.white_wood, frame=p.white_wood, sill=p.granite)
    windows = _windows(p)
    openings = [*doorways(), *windows]
    build_shell(b, LOW, HIGH, windows, p.facade, p.core)
    floor_plan = _rooms(p)
    for room in floor_plan:
        build_room(b, room, openings, trim)
        with b.model(f"{room.name} lamp", *_middle(room)):
            b.cylinder((0.0, 0.0), 0.16, CEILING - 0.10, CEILING, p.lamp_glass, 0.22, solid=False)
    build_openings(b, openings, p.oak, trim, INNER_WALL)
    rooms.furnish_living(b, p)
    rooms.furnish_kitchen(b, p)
    rooms.furnish_corridor(b, p)
    rooms.furnish_study(b, p)
    rooms.furnish_children(b, p)
    rooms.furnish_bath(b, p)
    rooms.furnish_bedroom(b, p)
    lights = tuple(_light(room) for room in floor_plan)
    return b.world("house", lights, ambient=(0.5, 0.49, 0.47), background=(0.72, 0.80, 0.88))


def _rooms(p: HousePalette) -> list[Room]:
    west, east = -1.6 - _HALF, -1.6 + _HALF
    return [
        Room("living room", LOW, (west, 0.65 - _HALF), p.oak_floor, p.living_wall, {"-x": p.brick}),
        Room("kitchen", (-8.5, 0.65 + _HALF), (west, 5.85), p.kitchen_floor, p.kitchen_wall, {}),
        Room("corridor", (east, -1.05 + _HALF), (8.5, 0.95 - _HALF), p.oak_floor, p.corridor_wall, {}),
        Room("study", (east, -5.85), (3.2 - _HALF, -1.05 - _HALF), p.walnut_floor, p.study_wall, {"+y": p.living_wall}),
        Room(
            "children's room",
            (3.2 + _HALF, -5.85),
            (8.5, -1.05 - _HALF),
            p.oak_floor,
            p.kids_wall,
            {"+x": p.living_wall},
        ),
        Room("bath", (east, 0.95 + _HALF), (1.6 - _HALF, 5.85), p.bath_floor, p.bath_wall, {}),
        Room("bedroom", (1.6 + _HALF, 0.95 + _HALF), HIGH, p.walnut_floor, p.bedroom_wall, {"-y": p.study_wall}),
    ]


def doorways() -> list[Opening]:
    """Return the ten passages between rooms, in metres of the world."""
    return [
        Opening("x", -1.6, -0.65, 0.52),  # living room - corridor
        Opening("x", -1.6, -4.62, -3.45),  # living room - study
        Opening("y", 0.65, -7.54, -5.74, top=2.25),  # living room - kitchen, wide
        Opening("y", 0.65, -3.62, -2.45),  # living room - kitchen
        Opening("y", -1.05, 1.28, 2.45),  # study - corridor
        Opening("x", 3.2, -3.4, -2.22),  # study - children's room
        Opening("y", -1.05, 5.53, 6.7),  # children's room - corridor
        Opening("y", 0.95, -0.75, 0.43),  # bath - corridor
        Opening("x", 1.6, 3.24, 4.41),  # bath - bedroom
        Opening("y", 0.95, 3.41, 4.58),  # bedroom - corridor
    ]


def _windows(p: HousePalette) -> list[Opening]:
    west, east = LOW[0] - OUTER_WALL / 2, HIGH[0] + OUTER_WALL / 2
    south, north = LOW[1] - OUTER_WALL / 2, HIGH[1] + OUTER_WALL / 2
    return [
        Opening("x", west, -4.36, -2.44, 0.55, 2.2, p.view()),  # living room
        Opening("y", south, -5.74, -3.62, 0.55, 2.2, p.view()),  # living room
        Opening("x", west, 2.33, 4.25, 1.1, 2.2, p.view()),  # kitchen
        Opening("y", north, -3.4, -2.13, 0.9, 2.2, p.view()),  # kitchen
        Opening("y", north, -0.64, 0.64, 1.3, 2.1, p.view()),  # bath
        Opening("y", north, 3.41, 5.53, 0.7, 2.2, p.view()),  # bedroom
        Opening("x", east, 2.55, 4.47, 1.25, 2.2, p.view()),  # bedroom
        Opening("y", south, -0.21, 1.71, 0.9, 2.2, p.view()),  # study
        Opening("y", south, 5.0, 6.91, 0.9, 2.2, p.view()),  # children's room
        Opening("x", east, -3.18, -1.69, 0.9, 2.2, p.view()),  # children's room
    ]


def _middle(room: Room) -> tuple[float, float]:
    return ((room.low[0] + room.high[0]) / 2, (room.low[1] + room.high[1]) / 2)


def _light(room: Room) -> Light:
    """Return a ceiling lamp in the middle of a room."""
    return Light(
        name=f"{room.name} lamp",
        type="point",
        pose=pose_from_xyz_rpy((*_middle(room), CEILING - 0.25), (0.0, 0.0, 0.0)),
        diffuse=(0.75, 0.72, 0.66),
        attenuation_range=9.0,
        attenuation=(0.6, 0.08, 0.02),
    )
