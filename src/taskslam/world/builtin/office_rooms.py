"""What stands where in the office. Positions are metres in the world; a piece's front looks along `degrees` + 90."""

from __future__ import annotations

from taskslam.world.builtin import fittings, furniture, workplace
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.palettes import OfficePalette
from taskslam.world.builtin.rooms import EAST, NORTH, SOUTH, WEST

_HALF = 0.15  # of an inner wall
_CEILING = 2.8


def furnish_corridors(b: Builder, p: OfficePalette) -> None:
    """Add plates at every door, and the few things that tell one stretch of corridor from another."""
    doors = {
        (5.8, SOUTH): (-23.0, -19.0, -15.0, -9.5, -6.0, -0.5, 3.0, 9.0, 12.5, 15.5, 19.5, 23.5),
        (3.6, NORTH): (-18.5, -11.5, -4.5, 5.0, 12.5, 19.5),
        (-3.6, SOUTH): (-18.5, -11.5, -4.5, 5.0, 12.5, 19.5),
        (-5.8, NORTH): (-23.0, -19.0, -15.0, -10.5, -5.5, -1.5, 2.0, 5.5, 9.2, 13.7, 17.2, 20.5, 24.0),
    }
    number = 401
    for (at, side), middles in doors.items():
        y = at + (_HALF if side == NORTH else -_HALF)
        for x in middles:
            with b.model("door plate", x + 0.85, y, side):
                workplace.plate(b, p.sign(str(number), (70, 74, 80), (244, 244, 240)), 0.3)
            number += 1
    for x, y, side, wide in (
        (-12.6, 5.8 - _HALF, SOUTH, 2.0),
        (6.2, 5.8 - _HALF, SOUTH, 1.4),
        (8.6, 3.6 + _HALF, NORTH, 1.8),
        (-8.0, -3.6 - _HALF, SOUTH, 1.4),
        (15.6, -3.6 - _HALF, SOUTH, 2.0),
        (-12.8, -5.8 + _HALF, NORTH, 1.6),
    ):
        with b.model("notice board", x, y, side):
            workplace.board(b, p, wide, 1.0, p.notices(wide, 1.0))
    for x, y, side in (
        (-14.8, 3.6 + _HALF, NORTH),
        (2.0, 3.6 + _HALF, NORTH),
        (16.4, 3.6 + _HALF, NORTH),
        (-14.8, -3.6 - _HALF, SOUTH),
        (8.8, -3.6 - _HALF, SOUTH),
    ):
        with b.model("extinguisher", x, y, side):
            workplace.extinguisher(b, p, p.red_paint)
    with b.model("lockers", -8.0, 3.6 + _HALF, NORTH):
        workplace.lockers(b, p, 5, p.blue_fabric)
    with b.model("lockers", 1.9, -3.6 - _HALF, SOUTH):
        workplace.lockers(b, p, 3, p.rust_fabric)
    with b.model("vending machine", 16.4, -5.8 + _HALF, NORTH):
        workplace.vending_machine(b, p, p.red_paint)
    with b.model("bench", 17.4, 5.8 - _HALF, SOUTH):
        b.soft_box((-0.6, 0.0, 0.36), (0.6, 0.40, 0.46), p.green_fabric, 0.03)
        b.box((-0.55, 0.03, 0.0), (0.55, 0.36, 0.36), p.oak, skip="-z +z")
    for y in (1.6, -1.6):
        with b.model("lift", -1.1 + _HALF, y, EAST):
            workplace.lift_doors(b, p)
    for y in (-1.5, -0.2):
        with b.model("lost property", -25.0, y, EAST):
            furniture.bookshelf(b, p, 1.2, 1.4, p.oak)
    with b.model("bin", -22.8 - _HALF - 0.24, 2.2):
        b.cylinder((0.0, 0.0), 0.18, 0.0, 0.7, p.steel, sides=14)
    for x, y in ((24.55, 1.2), (24.5, -2.6), (-22.5, -5.3)):
        with b.model("plant", x, y):
            furniture.plant(b, p, 1.3, 0.2)
    for text, x, y, side in (
        ("401 412", -21.0, 4.7, 90.0),
        ("STAIRS", 0.0, 4.7, 90.0),
        ("LIFT", 0.0, -4.7, 90.0),
        ("425 437", 21.5, -4.7, 90.0),
    ):
        with b.model("sign", x, y, side):
            workplace.hanging_sign(b, p, p.sign(text, (40, 92, 72)), 0.16 * len(text), _CEILING)
    _pictures(
        b,
        p,
        (
            (-2.4, 3.6 + _HALF, NORTH, 0.9, 0.6),
            (10.8, -5.8 + _HALF, NORTH, 0.6, 0.8),
            (-17.0, -5.8 + _HALF, NORTH, 0.9, 0.6),
            (-25.0, 1.6, EAST, 1.0, 0.7),
            (25.0, -0.6, WEST, 1.2, 0.8),
            (1.1 - _HALF, 1.2, WEST, 0.8, 1.0),
        ),
    )


def _island(b: Builder, p: OfficePalette, x: float, y: float, along_y: bool, desks: int, fabric: Surface) -> None:
    """Add desks back to back on both sides of a low screen, the island's middle at x, y."""
    for k in range(desks):
        shift = (k - (desks - 1) / 2) * 1.64
        at = (x, y + shift) if along_y else (x + shift, y)
        for side in (EAST, WEST) if along_y else (NORTH, SOUTH):
            seat = fabric if b.dice.uniform() < 0.85 else None
            with b.model("desk", *at, side):
                workplace.desk(b, p, p.oak, 1.58, b.dice.integer(1, 3), seat)
    half = desks * 0.82
    with b.model("desk screen", x, y, 90.0 if along_y else 0.0):
        b.box((-half, -0.02, 0.6), (half, 0.02, 1.18), fabric)


def furnish_north(b: Builder, p: OfficePalette) -> None:
    """Furnish two open offices, meeting room, lounge and lab."""
    south = 5.8 + _HALF
    for x, fabric in ((-22.2, p.blue_fabric), (-15.8, p.rust_fabric)):
        _island(b, p, x, 11.2, True, 4, fabric)
    for x in (-21.2, -16.9):
        with b.model("files", x, south, NORTH):
            workplace.file_shelf(b, p, p.white_wood, p.files, 1.4, 3)
    with b.model("whiteboard", -25.0, 7.6, EAST):
        workplace.board(b, p, 1.8, 1.1, p.whiteboard(1.8, 1.1))
    with b.model("cabinet", -19.0, 15.0, SOUTH):
        furniture.cabinet(b, 1.6, 0.45, 1.1, p.walnut, 3, p.steel)
    for x, y in ((-13.6, 14.5), (-24.5, 14.5), (-13.6, 6.4)):
        with b.model("plant", x, y):
            furniture.plant(b, p, 1.5, 0.24)
    with b.model("meeting table", -8.0, 11.0):
        furniture.table(b, p.walnut, 1.5, 4.4)
    for k in range(4):
        y = 9.4 + k * 1.07
        for dx, turn in ((-1.15, EAST), (1.15, WEST)):
            with b.model("meeting chair", -8.0 + dx * 1.15, y, turn + b.dice.uniform(-18.0, 18.0)):
                furniture.office_chair(b, p, p.mustard_fabric if dx < 0 else p.green_fabric)
    with b.model("whiteboard", -13.0 + _HALF, 10.6, EAST):
        workplace.board(b, p, 3.0, 1.2, p.whiteboard(3.0, 1.2))
    with b.model("media wall", -5.0 - _HALF, 11.0, WEST):
        b.box((-0.9, 0.02, 1.0), (0.9, 0.07, 2.0), p.black, faces={"+y": p.screen})
        furniture.cabinet(b, 2.0, 0.4, 0.6, p.walnut, 3, p.black)
    with b.model("plant", -12.4, 14.5):
        furniture.plant(b, p, 1.6, 0.24)
    with b.model("sideboard", -11.6, south, NORTH):
        furniture.drawers(b, p, 1.4, 0.45, 0.85, p.oak, 3)
    _furnish_lounge(b, p)
    _furnish_lab(b, p)
    for x in (16.6, 22.4):
        for y, fabric in ((8.8, p.green_fabric), (12.6, p.mustard_fabric)):
            _island(b, p, x, y, False, 2, fabric)
    with b.model("whiteboard", 25.0, 7.4, WEST):
        workplace.board(b, p, 2.2, 1.1, p.whiteboard(2.2, 1.1))
    with b.model("books", 14.0 + _HALF, 10.8, EAST):
        furniture.bookshelf(b, p, 1.6, 2.0, p.oak)
    with b.model("copier", 19.5, 15.0, SOUTH):
        workplace.copier(b, p)
    for x, y in ((24.5, 14.5), (14.7, 14.5), (21.0, 6.4)):
        with b.model("plant", x, y):
            furniture.plant(b, p, 1.4, 0.22)
    _pictures(b, p, ((-13.15, 10.4, WEST, 1.2, 0.8), (-5.15, 7.4, WEST, 0.7, 0.9), (14.15, 8.0, EAST, 0.9, 0.7)))


def _furnish_lounge(b: Builder, p: OfficePalette) -> None:
    west, east = -5.0 + _HALF, 4.0 - _HALF
    with b.model("kitchenette", west, 12.0, EAST):
        fittings.counter(b, p, 3.6, 6, p.teal_wood, p.wash_wall)
    with b.model("sink", west, 12.6, EAST):
        fittings.sink(b, p)
    with b.model("fridge", west, 9.6, EAST):
        fittings.fridge(b, p)
    cushions = (p.mustard_fabric, p.rust_fabric, p.green_fabric)
    for k, (x, y) in enumerate(((-1.9, 12.9), (1.0, 13.2))):
        with b.model("lounge table", x, y):
            furniture.table(b, p.oak, 1.2, 0.8)
        for dx, turn in ((-0.95, EAST), (0.95, WEST)):
            with b.model("chair", x + dx, y, turn + 8.0 * k):
                furniture.chair(b, p.walnut, cushions[k])
    with b.model("sofa", east, 9.6, WEST):
        furniture.sofa(b, p, p.blue_fabric, 3, p.mustard_fabric)
    with b.model("coffee table", 2.3, 9.6, WEST):
        furniture.low_table(b, p, 1.1, 0.6)
    with b.model("armchair", 2.3, 7.0, NORTH + 10):
        furniture.sofa(b, p, p.rust_fabric, 1)
    with b.model("lounge rug", 1.9, 9.4):
        furniture.rug(b, p, 2.2, 2.8)
    with b.model("books", -3.2, 5.8 + _HALF, NORTH):
        furniture.bookshelf(b, p, 1.6, 1.8, p.oak)
    for x, y in ((3.4, 14.5), (3.4, 6.6)):
        with b.model("plant", x, y):
            furniture.plant(b, p, 1.6, 0.24)
    _pictures(b, p, ((east, 9.6, WEST, 1.4, 0.9), (west, 7.6, EAST, 0.8, 1.0)))


def _furnish_lab(b: Builder, p: OfficePalette) -> None:
    """Add benches with instruments, shelves and lockers."""
    for x, y in ((6.4, 10.0), (6.4, 12.6), (11.6, 10.8)):
        with b.model("lab bench", x, y):
            furniture.table(b, p.white_wood, 2.4, 1.0, 0.9)
            b.box((-1.1, -0.4, 0.15), (1.1, 0.4, 0.2), p.steel)
            for k in range(4):
                left, tall = -1.05 + 0.52 * k, b.dice.uniform(0.12, 0.4)
                body = b.dice.choice([p.steel, p.porcelain, p.black, p.blue_fabric])
                b.box((left, -0.3, 0.9), (left + 0.4, 0.1, 0.9 + tall), body, faces={"-y": p.screen}, skip="-z")
                b.box((left, -0.3, 0.2), (left + 0.36, 0.3, 0.2 + b.dice.uniform(0.15, 0.42)), body)
    for y in (8.0, 9.3, 13.4):
        with b.model("shelf", 4.0 + _HALF, y, EAST):
            furniture.bookshelf(b, p, 1.2, 2.0, p.white_wood)
    with b.model("lockers", 14.0 - _HALF, 9.4, WEST):
        workplace.lockers(b, p, 6, p.green_fabric)
    with b.model("lab counter", 11.4, 15.0, SOUTH):
        fittings.counter(b, p, 3.6, 5, p.sage_wood, p.wash_wall)
    with b.model("whiteboard", 11.6, 5.8 + _HALF, NORTH):
        workplace.board(b, p, 2.0, 1.1, p.whiteboard(2.0, 1.1))
    for x in (8.7, 9.6):
        with b.model("stool", x, 11.9):
            b.cylinder((0.0, 0.0), 0.2, 0.0, 0.04, p.black, sides=12)
            b.cylinder((0.0, 0.0), 0.03, 0.04, 0.6, p.steel, sides=8)
            b.cylinder((0.0, 0.0), 0.18, 0.6, 0.66, p.rust_fabric, sides=12)


def furnish_core(b: Builder, p: OfficePalette) -> None:
    """Furnish copy room, washroom, stairs, server room, small meeting room and store."""
    for x in (-21.4, -16.6):
        with b.model("copier", x, -3.6 + _HALF, NORTH):
            workplace.copier(b, p)
    for y in (-1.4, 0.2, 1.8):
        with b.model("paper shelf", -22.8 + _HALF, y, EAST):
            workplace.file_shelf(b, p, p.oak, p.files, 1.4, 5)
    with b.model("paper cabinet", -15.0 - _HALF, -0.6, WEST):
        furniture.cabinet(b, 2.4, 0.5, 1.0, p.white_wood, 4, p.steel)
    with b.model("sorting table", -20.2, -1.0):
        furniture.table(b, p.oak, 1.0, 1.6, 0.9)
    with b.model("notice board", -20.6, 3.6 - _HALF, SOUTH):
        workplace.board(b, p, 1.6, 1.0, p.notices(1.6, 1.0))
    for x in (-14.0, -12.8, -11.6, -10.4):
        with b.model("toilet", x, 3.6 - _HALF, SOUTH):
            fittings.toilet(b, p)
    for x in (-13.2, -9.4):
        with b.model("washstand", x, -3.6 + _HALF, NORTH):
            fittings.vanity(b, p)
    for k in range(12):
        with b.model("step", -7.0 + 0.3 * k, 1.6):
            b.box((0.0, -1.2, 0.0), (0.3, 1.2, 0.17 * (k + 1)), p.concrete, skip="-z")
    for x in (2.2, 4.0, 5.8, 7.6):
        for y, side in ((1.6, SOUTH), (-1.8, NORTH)):
            with b.model("server rack", x, y, side):
                b.box((-0.6, 0.0, 0.0), (0.6, 0.9, 2.0), p.black, faces={"+y": p.screen}, skip="-z")
    with b.model("meeting table", 13.6, 0.6):
        furniture.table(b, p.oak, 2.0, 1.1)
    for dx, dy, turn in ((-0.5, 0.95, SOUTH), (0.5, 0.95, SOUTH), (-0.5, -0.95, NORTH), (0.5, -0.95, NORTH)):
        with b.model("meeting chair", 13.6 + dx, 0.6 + dy, turn + b.dice.uniform(-15.0, 15.0)):
            furniture.chair(b, p.walnut, p.rust_fabric)
    with b.model("whiteboard", 9.0 + _HALF, 0.0, EAST):
        workplace.board(b, p, 2.4, 1.2, p.whiteboard(2.4, 1.2))
    with b.model("sofa", 10.6, 3.6 - _HALF, SOUTH):
        furniture.sofa(b, p, p.green_fabric, 2)
    with b.model("screen", 16.0 - _HALF, 0.6, WEST):
        b.box((-0.7, 0.02, 1.0), (0.7, 0.07, 1.8), p.black, faces={"+y": p.screen})
    with b.model("plant", 15.3, -2.9):
        furniture.plant(b, p, 1.4, 0.22)
    for y in (-2.2, -0.7, 0.8, 2.3):
        with b.model("store shelf", 16.0 + _HALF, y, EAST):
            furniture.bookshelf(b, p, 1.4, 2.0, p.white_wood)
        with b.model("store shelf", 22.8 - _HALF, y, WEST):
            furniture.bookshelf(b, p, 1.4, 2.0, p.oak)


def furnish_south(b: Builder, p: OfficePalette) -> None:
    """Furnish seminar room, closed offices, library and workshop."""
    north = -5.8 - _HALF
    with b.model("whiteboard", -25.0, -8.0, EAST):
        workplace.board(b, p, 2.2, 1.2, p.whiteboard(2.2, 1.2))
    with b.model("whiteboard", -25.0, -13.2, EAST):
        workplace.board(b, p, 2.0, 1.2, p.whiteboard(2.0, 1.2))
    with b.model("lectern", -23.4, -12.6):
        b.box((-0.3, -0.25, 0.0), (0.3, 0.25, 1.1), p.walnut, skip="-z")
    for x in (-21.6, -17.0, -15.2):
        for y in (-8.6, -10.8, -13.0):
            with b.model("seminar table", x, y):
                furniture.table(b, p.oak, 0.6, 1.8)
            for dy in (-0.45, 0.45):
                with b.model("seminar chair", x + 0.75, y + dy, WEST + b.dice.uniform(-12.0, 12.0)):
                    furniture.chair(b, p.walnut, b.dice.choice([p.blue_fabric, p.green_fabric]))
    for x, wood, fabric in (
        (-10.5, p.oak, p.rust_fabric),
        (-5.5, p.walnut, p.green_fabric),
        (9.2, p.oak, p.blue_fabric),
        (13.7, p.walnut, p.mustard_fabric),
    ):
        with b.model("desk", x - 0.6, -13.4, NORTH):
            workplace.desk(b, p, wood, 1.7, 2, fabric)
        with b.model("books", x + 1.6, -15.0, NORTH):
            furniture.bookshelf(b, p, 1.0, 2.0, wood)
        with b.model("visitor's table", x + 0.7, -8.6):
            furniture.table(b, wood, 1.0, 1.0)
        with b.model("rug", x, -11.0):
            furniture.rug(b, p, 2.0, 1.4)
    for x in (-1.4, 5.2):
        for y in (-8.4, -10.1, -11.8):
            for turn in (EAST, WEST):
                with b.model("library shelf", x, y, turn):
                    furniture.bookshelf(b, p, 1.6, 2.0, p.oak, 0.3)
    with b.model("reading table", 2.0, -13.3):
        furniture.table(b, p.walnut, 2.6, 1.0)
    for x in (1.2, 2.8):
        with b.model("reading chair", x, -12.3, SOUTH + b.dice.uniform(-14.0, 14.0)):
            furniture.chair(b, p.oak, p.green_fabric)
    with b.model("issue desk", 3.9, north, SOUTH):
        furniture.drawers(b, p, 1.4, 0.6, 1.0, p.walnut, 3)
    for x in (-2.5, 6.4):
        with b.model("armchair", x, -14.9, NORTH):
            furniture.sofa(b, p, p.rust_fabric, 1)
    _furnish_workshop(b, p)
    _pictures(
        b,
        p,
        ((-13.15, -10.4, WEST, 1.3, 0.9), (7.0 - _HALF, -13.6, WEST, 0.7, 0.9), (-3.0 + _HALF, -13.4, EAST, 0.8, 0.6)),
    )


def _furnish_workshop(b: Builder, p: OfficePalette) -> None:
    """Add workbenches, a machine, shelves and lockers."""
    for x, y in ((18.2, -9.0), (18.2, -12.4), (23.0, -10.6)):
        with b.model("workbench", x, y, 4.0):
            furniture.table(b, p.oak, 1.2, 2.0, 0.88)
            b.box((-0.4, -0.7, 0.12), (0.4, 0.2, 0.55), p.red_paint)
            b.box((-0.3, 0.3, 0.88), (0.1, 0.7, 1.2), p.steel)
    with b.model("drill", 24.4, -13.9, WEST):
        b.box((-0.25, 0.0, 0.0), (0.25, 0.5, 0.1), p.black)
        b.cylinder((0.0, 0.15), 0.07, 0.1, 1.7, p.steel, sides=12)
        b.soft_box((-0.2, 0.0, 1.3), (0.2, 0.6, 1.75), p.teal_wood, 0.05)
        b.box((-0.3, 0.1, 0.8), (0.3, 0.6, 0.86), p.steel)
    for y in (-7.4, -8.8):
        with b.model("shelf", 25.0, y, WEST):
            furniture.bookshelf(b, p, 1.3, 2.0, p.white_wood)
    with b.model("lockers", 16.0 + _HALF, -10.6, EAST):
        workplace.lockers(b, p, 6, p.blue_fabric)
    with b.model("tool wall", 20.6, -15.0, NORTH):
        furniture.cabinet(b, 1.2, 0.5, 0.9, p.red_paint, 3, p.black)


def _pictures(b: Builder, p: OfficePalette, places: tuple[tuple[float, float, float, float, float], ...]) -> None:
    """Hang pictures: x, y, side, width and height in metres."""
    for x, y, side, wide, tall in places:
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.black, 1.6)
