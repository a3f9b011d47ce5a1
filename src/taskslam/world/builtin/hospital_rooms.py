"""What stands where in the hospital. Positions are metres in the world; a piece's front looks along `degrees` + 90."""

from __future__ import annotations

import itertools

from taskslam.world.builtin import clinic, fittings, furniture, workplace
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.palettes import HospitalPalette
from taskslam.world.builtin.rooms import EAST, NORTH, SOUTH, WEST

_HALF = 0.07  # of an inner wall
_CEILING = 2.8


def furnish_lobby(b: Builder, p: HospitalPalette) -> None:
    """Add reception, waiting areas, columns, plants, a cafe corner and vending machines."""
    with b.model("reception", 0.0, 18.7, SOUTH):
        clinic.desk_counter(b, p, 5.0, p.walnut, 3)
    for side in (-1.0, 1.0):
        with b.model("reception return", 2.44 * side, 18.7):
            b.box((-0.06, -1.5, 0.0), (0.06, 0.0, 1.10), p.walnut, skip="-z")
    with b.model("reception sign", 0.0, 16.0 + _HALF, NORTH):
        b.box((-1.6, 0.0, 2.05), (1.6, 0.04, 2.5), p.walnut, skip="-y")
        b.panel((1.4, 0.045, 2.12), (-2.8, 0, 0), (0, 0, 0.3), p.sign("RECEPTION", (84, 56, 40), (246, 240, 226)))
    for x in (-1.6, -0.6, 0.6, 1.6):
        with b.model("files", x, 16.0 + _HALF, NORTH):
            workplace.file_shelf(b, p, p.oak, p.files, 0.95, 4)
    for x in (-4.2, 4.2):
        for y in (20.4, 25.2):
            with b.model("column", x, y):
                b.box((-0.25, -0.25, 0.0), (0.25, 0.25, _CEILING), p.lobby_wall, skip="-z +z")
                b.box((-0.26, -0.26, 0.0), (0.26, 0.26, 1.1), p.oak, skip="-z")
    for x, y, seats, fabric in (
        (-8.6, 23.4, 4, p.vinyl),
        (-8.6, 19.6, 3, p.rust_fabric),
        (8.4, 19.4, 4, p.green_fabric),
    ):
        for side in (NORTH, SOUTH):
            with b.model("waiting seats", x, y, side):
                clinic.waiting_seats(b, p, seats, fabric)
    with b.model("waiting seats", -12.4, 26.6, EAST):
        clinic.waiting_seats(b, p, 3, p.mustard_fabric)
    for x, y in ((7.4, 24.2), (10.2, 25.4), (10.6, 22.6)):
        with b.model("cafe table", x, y):
            b.cylinder((0.0, 0.0), 0.26, 0.0, 0.03, p.black)
            b.cylinder((0.0, 0.0), 0.05, 0.03, 0.71, p.steel, sides=10)
            b.cylinder((0.0, 0.0), 0.42, 0.71, 0.75, p.oak, sides=20)
        for k, turn in enumerate((20.0, 140.0, 255.0)):
            with b.model("cafe chair", *_around(x, y, 0.95, k), turn):
                furniture.chair(b, p.walnut, (p.mustard_fabric, p.rust_fabric, p.blue_fabric)[k])
    for x, body in ((7.0, p.rust_fabric), (8.2, p.blue_fabric)):
        with b.model("vending machine", x, 16.0 + _HALF, NORTH):
            workplace.vending_machine(b, p, body)
    with b.model("cafe shelf", 10.6, 16.0 + _HALF, NORTH):
        fittings.counter(b, p, 2.6, 4, p.sage_wood, p.theatre_wall)
    with b.model("notice board", -8.8, 16.0 + _HALF, NORTH):
        workplace.board(b, p, 2.4, 1.2, p.notices(2.4, 1.2))
    with b.model("leaflets", -11.6, 16.0 + _HALF, NORTH):
        furniture.bookshelf(b, p, 1.0, 1.7, p.oak)
    for x, y in ((-12.0, 27.5), (12.0, 27.5), (-3.0, 27.5), (3.0, 27.5), (-6.1, 16.5), (-12.0, 22.2)):
        with b.model("plant", x, y):
            furniture.plant(b, p, 1.6, 0.24)
    for text, x in (("WARD 1 2 3 4", -3.9), ("WARD 5 6", 3.9)):
        with b.model("sign", x, 16.4):
            workplace.hanging_sign(b, p, p.sign(text), 0.28 * 0.57 * len(text), _CEILING)
    with b.model("floor line"):
        for side in (-1.0, 1.0):
            x = 3.9 * side
            b.panel((x - 0.06, 16.2, 0.003), (0.12, 0, 0), (0, 6.0, 0), p.guide_blue, solid=False)
            b.panel((min(x, 0.0), 22.2, 0.003), (3.9, 0, 0), (0, 0.12, 0), p.guide_blue, solid=False)
    _pictures(b, p, ((-12.5, 22.3, EAST, 1.2, 0.9), (12.5, 22.3, WEST, 1.4, 1.0)))


def _around(x: float, y: float, radius: float, k: int) -> tuple[float, float]:
    """Return a place on a circle, a third of a turn apart."""
    dx, dy = ((0.35, -0.94), (0.64, 0.77), (-0.97, 0.26))[k]
    return (x + radius * dx, y + radius * dy)


def furnish_corridors(b: Builder, p: HospitalPalette) -> None:
    """Add what little stands in the corridors, and the plates at the doors."""
    plates = {
        -5.2: ((12.0, "W1"), (4.2, "W2"), (-3.2, "W3"), (-11.0, "W4"), (-18.0, "CAFE")),
        5.2: ((11.4, "E1"), (4.4, "W5"), (-3.4, "W6"), (-10.6, "E2"), (-18.6, "E3"), (-25.0, "E4")),
        -2.6: ((-11.4, "OP 1"), (-18.6, "STORE")),
        2.6: ((12.2, "RX"), (4.6, "STAFF"), (-10.2, "OP 1")),
    }
    for at, doors in plates.items():
        to_corridor = EAST if at in (-5.2, 2.6) else WEST
        x = at + (_HALF if to_corridor == EAST else -_HALF)
        for y, text in doors:
            with b.model("door plate", x, y + 1.05, to_corridor):
                workplace.plate(b, p.sign(text, (240, 242, 240), (30, 90, 120)), 0.11 * len(text))
    with b.model("stretcher", -2.6 - _HALF - 0.48, -17.2, SOUTH):
        clinic.stretcher(b, p)
    with b.model("linen cart", 2.6 + _HALF + 0.02, -13.2, EAST):
        clinic.linen_cart(b, p)
    with b.model("wheelchair", 5.2 - _HALF - 0.05, 7.4, WEST):
        clinic.wheelchair(b, p)
    with b.model("seats", -2.6 - _HALF, 10.6, WEST):
        clinic.waiting_seats(b, p, 3, p.vinyl)
    for x, y, side in ((-2.6 - _HALF, 1.2, WEST), (2.6 + _HALF, -6.4, EAST), (2.6 + _HALF, 15.2, EAST)):
        with b.model("extinguisher", x, y, side):
            workplace.extinguisher(b, p, p.red_paint)
    with b.model("notice board", 2.6 + _HALF, -0.6, EAST):
        workplace.board(b, p, 1.4, 0.9, p.notices(1.4, 0.9))
    with b.model("notice board", -5.2 + _HALF, -7.2, EAST):
        workplace.board(b, p, 1.2, 0.9, p.notices(1.2, 0.9))
    _pictures(
        b,
        p,
        ((-5.2 + _HALF, 8.0, EAST, 0.9, 0.6), (5.2 - _HALF, -14.2, WEST, 0.9, 0.6), (-2.67, -23.2, WEST, 0.7, 0.5)),
    )
    with b.model("seats", 0.0, -28.0, NORTH):
        clinic.waiting_seats(b, p, 4, p.blue_fabric)
    for x in (-1.75, 1.75):
        with b.model("plant", x, -27.6):
            furniture.plant(b, p, 1.3, 0.2)
    with b.model("lockers", 0.0, -22.0 - _HALF, SOUTH):
        workplace.lockers(b, p, 8, p.blue_fabric)


def _ward(
    b: Builder,
    p: HospitalPalette,
    x_outer: float,
    y: tuple[float, float],
    beds: tuple[tuple[float, float], ...],
    quilt: Surface,
    first: int,
) -> None:
    """Furnish a ward: beds at metres from the outer wall, heads at the south or north wall, drapes between them."""
    inward = 1.0 if x_outer < 0 else -1.0
    south, north = y[0] + _HALF, y[1] - _HALF
    for k, (out, side) in enumerate(beds):
        x, wall = x_outer + inward * out, south if side == NORTH else north
        with b.model("bed place", x, wall, side):
            clinic.bed_place(b, p, quilt, str(first + k))
        if out < 3.0:
            with b.model("drape", x + inward * 1.32, wall, side):
                clinic.drape(b, p, 2.3, b.dice.uniform(0.5, 1.9))
        with b.model(
            "visitor's chair", x - 0.85, wall + (1.25 if side == NORTH else -1.25), b.dice.uniform(-40.0, 40.0)
        ):
            furniture.chair(b, p.oak, p.vinyl)


def furnish_wards(b: Builder, p: HospitalPalette) -> None:
    """Furnish the six wards."""
    near, far = 1.5, 4.2
    _ward(b, p, -12.5, (8, 16), ((near, NORTH), (far, NORTH), (near, SOUTH), (far, SOUTH)), p.blanket, 11)
    _ward(b, p, -12.5, (0.5, 8), ((near, SOUTH), (far, SOUTH), (near, NORTH)), p.kids_quilt, 21)
    _ward(b, p, -12.5, (-7, 0.5), ((near, NORTH), (far, NORTH)), p.green_fabric, 31)
    _ward(b, p, -12.5, (-15, -7), ((near, SOUTH), (near, NORTH), (far, NORTH)), p.tartan, 41)
    _ward(b, p, 12.5, (0.5, 8), ((near, NORTH), (far, NORTH), (near, SOUTH)), p.mustard_fabric, 51)
    _ward(b, p, 12.5, (-7, 0.5), ((near, SOUTH), (far, SOUTH)), p.blanket, 61)
    for x, y, side, doors in (
        (-5.2 - _HALF, 14.6, WEST, 3),
        (-5.2 - _HALF, 6.6, WEST, 2),
        (-5.2 - _HALF, -5.6, WEST, 3),
        (-5.2 - _HALF, -13.4, WEST, 2),
        (5.2 + _HALF, 6.6, EAST, 2),
        (5.2 + _HALF, -1.2, EAST, 3),
    ):
        with b.model("wardrobe", x, y, side):
            furniture.cabinet(b, 0.5 * doors, 0.55, 2.0, p.oak, doors, p.steel)
    for x, y, side in (
        (-5.2 - _HALF, 9.2, WEST),
        (-8.2, 0.5 + _HALF, NORTH),
        (-7.6, 0.5 - _HALF, SOUTH),
        (-7.0, -7.0 - _HALF, SOUTH),
        (8.0, 8.0 - _HALF, SOUTH),
        (8.2, -7.0 + _HALF, NORTH),
    ):
        with b.model("washstand", x, y, side):
            fittings.vanity(b, p)
    for x, y in ((-10.0, -1.6), (10.3, -5.4)):
        with b.model("day table", x, y):
            furniture.table(b, p.oak, 1.1, 0.8)
        for turn, dy in ((NORTH, -0.85), (SOUTH, 0.85)):
            with b.model("chair", x, y + dy, turn + 8.0):
                furniture.chair(b, p.oak, p.vinyl)
    with b.model("armchair", -7.4, -13.6, NORTH + 20):
        furniture.sofa(b, p, p.rust_fabric, 1)
    with b.model("trolley", 7.0, 6.9, SOUTH + 10):
        clinic.trolley(b, p, p.teal_wood)
    with b.model("wheelchair", -6.6, 1.3, EAST + 30):
        clinic.wheelchair(b, p)
    _pictures(
        b,
        p,
        (
            (-12.5, 14.4, EAST, 0.8, 0.6),
            (-12.5, 1.8, EAST, 0.7, 0.9),
            (-12.5, -5.6, EAST, 1.0, 0.7),
            (-12.5, -13.6, EAST, 0.8, 0.6),
            (12.5, 6.6, WEST, 0.9, 0.6),
            (12.5, -1.0, WEST, 0.6, 0.8),
            (5.2 + _HALF, 2.2, EAST, 0.9, 0.6),
            (-5.2 - _HALF, -0.8, WEST, 0.9, 0.6),
        ),
    )


def furnish_core(b: Builder, p: HospitalPalette) -> None:
    """Furnish pharmacy, staff room, nurses' station, theatre and store."""
    west, east = -2.6 + _HALF, 2.6 - _HALF
    for k in range(5):
        with b.model("pharmacy shelf", west, 9.0 + k * 1.15, EAST):
            furniture.bookshelf(b, p, 1.05, 2.1, p.white_wood)
    with b.model("pharmacy table", 0.3, 10.2):
        furniture.table(b, p.white_wood, 1.0, 2.0, 0.9)
    with b.model("fridge", 1.9, 16 - _HALF, SOUTH):
        fittings.fridge(b, p)
    with b.model("pharmacy desk", 0.2, 16 - _HALF, SOUTH):
        workplace.desk(b, p, p.oak, 1.6, 1, p.blue_fabric)
    with b.model("staff kitchen", -0.6, 8 - _HALF, SOUTH):
        fittings.counter(b, p, 3.0, 5, p.sage_wood, p.theatre_wall)
    with b.model("staff sink", 0.2, 8 - _HALF, SOUTH):
        fittings.sink(b, p)
    with b.model("staff fridge", 1.6, 8 - _HALF, SOUTH):
        fittings.fridge(b, p)
    with b.model("staff table", -0.9, 4.6):
        furniture.table(b, p.oak, 0.9, 1.8)
    for y in (4.1, 5.0):
        with b.model("chair", -1.75, y, EAST + 6):
            furniture.chair(b, p.oak, p.mustard_fabric)
        with b.model("chair", 0.0, y, WEST - 8):
            furniture.chair(b, p.oak, p.rust_fabric)
    with b.model("staff sofa", -0.9, 0.5 + _HALF, NORTH):
        furniture.sofa(b, p, p.green_fabric, 3, p.mustard_fabric)
    with b.model("staff lockers", east, 2.2, WEST):
        workplace.lockers(b, p, 5, p.green_fabric)
    with b.model("nurses' counter", 0.0, -4.8, SOUTH):
        clinic.desk_counter(b, p, 4.2, p.teal_wood, 3)
    for x in (-1.0, 0.5):
        with b.model("swivel chair", x, -6.1, NORTH):
            furniture.office_chair(b, p, p.blue_fabric)
    for x in (-1.9, -0.9, 0.9, 1.9):
        with b.model("records", x, -7 + _HALF, NORTH):
            workplace.file_shelf(b, p, p.white_wood, p.files, 0.95, 4)
    with b.model("medicine cabinet", -1.0, 0.5 - _HALF, SOUTH):
        furniture.cabinet(b, 2.0, 0.45, 1.9, p.white_wood, 4, p.steel)
    with b.model("trolley", 1.2, 0.38, SOUTH):
        clinic.trolley(b, p, p.rust_fabric)
    with b.model("trolley", 2.1, 0.36, SOUTH + 6):
        clinic.trolley(b, p, p.blue_fabric)
    with b.model("sign", 0.0, -2.0):
        workplace.hanging_sign(b, p, p.sign("NURSE", (20, 110, 110)), 1.0, _CEILING)
    with b.model("operating table", 0.3, -12.7, 8.0):
        clinic.operating_table(b, p)
    for x, side, surface in ((-1.5, NORTH + 4, p.scrub_green), (1.7, NORTH - 6, p.vinyl)):
        with b.model("trolley", x, -15 + _HALF + 0.1, side):
            clinic.trolley(b, p, surface)
    with b.model("instrument cabinet", 0.2, -7 - _HALF, SOUTH):
        furniture.cabinet(b, 2.2, 0.42, 1.9, p.white_wood, 4, p.steel)
    with b.model("anaesthesia rack", -2.0, -14.0, EAST):
        furniture.drawers(b, p, 0.7, 0.6, 1.35, p.porcelain, 4)
        b.box((-0.25, 0.2, 1.35), (0.25, 0.24, 1.7), p.black, faces={"+y": p.screen})
    for k in range(5):
        with b.model("store shelf", east, -21.3 + k * 1.3, WEST):
            furniture.bookshelf(b, p, 1.2, 2.0, p.white_wood)
    with b.model("linen cart", -1.4, -22 + _HALF + 0.03, NORTH):
        clinic.linen_cart(b, p)
    with b.model("linen cart", -0.3, -22 + _HALF + 0.05, NORTH):
        clinic.linen_cart(b, p)
    with b.model("spare bed", -1.6, -15.0 - _HALF, SOUTH):
        clinic.hospital_bed(b, p, p.blanket)
    _pictures(b, p, ((west, 6.6, EAST, 0.9, 0.6), (west, 2.6, EAST, 0.8, 1.0), (east, 6.3, WEST, 0.6, 0.8)))


def furnish_care(b: Builder, p: HospitalPalette) -> None:
    """Furnish examination, recovery, physiotherapy, the doctors' office and the dining room."""
    with b.model("couch", 11.0, 16 - _HALF, SOUTH):
        clinic.stretcher(b, p)
    with b.model("couch", 8.2, 16 - _HALF, SOUTH):
        clinic.stretcher(b, p)
    for x in (9.6, 6.8):
        with b.model("drape", x, 16 - _HALF, SOUTH):
            clinic.drape(b, p, 2.3, b.dice.uniform(0.8, 1.9))
    with b.model("doctor's desk", 12.48, 10.0, WEST):
        workplace.desk(b, p, p.walnut, 1.6, 1, p.rust_fabric)
    with b.model("instruments", 8.6, 8 + _HALF, NORTH):
        furniture.cabinet(b, 2.4, 0.45, 0.95, p.sage_wood, 4, p.steel)
    with b.model("washstand", 6.3, 8 + _HALF, NORTH):
        fittings.vanity(b, p)
    with b.model("trolley", 9.7, 13.0, WEST + 10):
        clinic.trolley(b, p, p.blue_fabric)
    for k, y in enumerate((-8.5, -11.0, -13.5)):
        with b.model("recovery place", 12.48, y, WEST):
            clinic.stretcher(b, p)
            b.box((-0.9, 0.0, 1.30), (0.9, 0.06, 1.52), p.porcelain, skip="-y")
            clinic.drip_stand(b, p, 0.65, 0.35)
        if k < 2:
            with b.model("drape", 12.48, y - 1.25, WEST):
                clinic.drape(b, p, 2.4, b.dice.uniform(0.6, 2.0))
    with b.model("recovery counter", 6.6, -7 - _HALF, SOUTH):
        furniture.cabinet(b, 1.8, 0.5, 0.95, p.teal_wood, 3, p.steel)
    with b.model("recovery desk", 6.9, -15 + _HALF, NORTH):
        workplace.desk(b, p, p.oak, 1.6, 2, p.green_fabric)
    _furnish_physiotherapy(b, p)
    for x, y, side, fabric in ((12.48, -23.4, WEST, p.blue_fabric), (12.48, -26.7, WEST, p.rust_fabric)):
        with b.model("doctor's desk", x, y, side):
            workplace.desk(b, p, p.oak, 1.7, 2, fabric)
    for x in (6.4, 7.5, 8.6, 9.7):
        with b.model("books", x, -22 - _HALF, SOUTH):
            furniture.bookshelf(b, p, 1.05, 2.0, p.walnut)
    with b.model("round table", 7.6, -27.0):
        furniture.table(b, p.walnut, 1.2, 0.9)
    with b.model("sofa", 10.0, -28.0, NORTH):
        furniture.sofa(b, p, p.green_fabric, 1)
    _furnish_dining(b, p)
    _pictures(
        b,
        p,
        (
            (5.2 + _HALF, 14.4, EAST, 0.8, 1.0),
            (5.2 + _HALF, -13.4, EAST, 0.9, 0.6),
            (5.2 + _HALF, -20.9, EAST, 0.9, 0.6),
            (5.2 + _HALF, -23.4, EAST, 0.6, 0.8),
        ),
    )


def _furnish_physiotherapy(b: Builder, p: HospitalPalette) -> None:
    """Add mats, wall bars, parallel bars, balls and a treatment bench."""
    for x, surface in ((8.2, p.blue_fabric), (10.2, p.rust_fabric)):
        with b.model("mat", x, -20.6):
            b.box((-0.8, -1.0, 0.0), (0.8, 1.0, 0.012), surface, skip="-z", solid=False)
    for x in (7.2, 8.3, 9.4):
        with b.model("wall bars", x, -22 + _HALF, NORTH):
            for side in (-0.5, 0.44):
                b.box((side, 0.0, 0.0), (side + 0.06, 0.16, 2.4), p.oak, skip="-z")
            for rung in range(11):
                z = 0.18 + rung * 0.2
                b.box((-0.44, 0.06, z), (0.44, 0.10, z + 0.04), p.oak)
    with b.model("parallel bars", 9.4, -16.6):
        for y in (-0.35, 0.35):
            b.box((-1.5, y - 0.025, 0.86), (1.5, y + 0.025, 0.91), p.oak)
            for x in (-1.4, 1.36):
                b.box((x, y - 0.02, 0.0), (x + 0.04, y + 0.02, 0.86), p.steel, skip="-z")
    with b.model("treatment bench", 12.48, -20.0, WEST):
        clinic.stretcher(b, p)
    for x, y, radius, surface in ((11.9, -21.4, 0.32, p.mustard_fabric), (11.2, -21.5, 0.25, p.green_fabric)):
        with b.model("ball", x, y):
            profile = ((0.38, 0.0), (0.80, 0.2), (1.0, 0.6), (1.0, 1.0), (1.0, 1.4), (0.80, 1.8), (0.38, 2.0))
            for (r0, z0), (r1, z1) in itertools.pairwise(profile):
                b.cylinder((0, 0), r0 * radius, z0 * radius, z1 * radius, surface, r1 * radius, 14, closed=False)
            b.disc((0.0, 0.0), 0.38 * radius, 2.0 * radius, surface, sides=14)
    with b.model("shelf", 6.3, -15 - _HALF, SOUTH):
        fittings.toy_shelf(b, p, 1.6)


def _furnish_dining(b: Builder, p: HospitalPalette) -> None:
    """Add tables with chairs, the serving counter, a sofa corner and plants."""
    with b.model("serving counter", -9.6, -28.0, NORTH):
        fittings.counter(b, p, 4.2, 6, p.teal_wood, p.theatre_wall)
    with b.model("sink", -8.4, -28.0, NORTH):
        fittings.sink(b, p)
    with b.model("fridge", -12.1, -28.0, NORTH):
        fittings.fridge(b, p)
    with b.model("vending machine", -5.2 - _HALF, -24.4, WEST):
        workplace.vending_machine(b, p, p.rust_fabric)
    cushions = (p.mustard_fabric, p.blue_fabric, p.green_fabric, p.rust_fabric)
    for k, (x, y) in enumerate(((-10.9, -24.4), (-7.9, -23.4), (-10.9, -21.2), (-8.0, -20.2))):
        with b.model("dining table", x, y):
            furniture.table(b, p.oak, 1.1, 0.9)
        for dx, dy, turn in ((0.0, -0.82, NORTH), (0.0, 0.82, SOUTH), (-0.9, 0.0, EAST), (0.9, 0.0, WEST)):
            if b.dice.uniform() < 0.85:
                with b.model("dining chair", x + dx, y + dy, turn + b.dice.uniform(-15.0, 15.0)):
                    furniture.chair(b, p.oak, cushions[k])
    with b.model("sofa", -9.6, -15 - _HALF, SOUTH):
        furniture.sofa(b, p, p.blue_fabric, 3, p.mustard_fabric)
    with b.model("coffee table", -9.6, -17.2, NORTH):
        furniture.low_table(b, p, 1.1, 0.6)
    with b.model("armchair", -12.3, -16.6, EAST):
        furniture.sofa(b, p, p.rust_fabric, 1)
    with b.model("books", -6.4, -15 - _HALF, SOUTH):
        furniture.bookshelf(b, p, 1.2, 1.8, p.oak)
    for x, y in ((-12.0, -15.6), (-12.0, -19.2), (-5.8, -27.5)):
        with b.model("plant", x, y):
            furniture.plant(b, p, 1.4, 0.22)
    _pictures(b, p, ((-12.5, -21.5, EAST, 0.9, 1.1), (-5.27, -20.6, WEST, 1.2, 0.8), (-12.5, -26.8, EAST, 0.6, 0.8)))


def _pictures(b: Builder, p: HospitalPalette, places: tuple[tuple[float, float, float, float, float], ...]) -> None:
    """Hang pictures: x, y, side, width and height in metres."""
    for x, y, side, wide, tall in places:
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.oak, 1.6)
