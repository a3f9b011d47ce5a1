"""`warehouse`: one hall of 13 m by 20 m with racks, shelves, docks and floor storage; sized as the AWS small warehouse.

      -6.5                                     6.5
    +---------------------------------------------+   y = 10
    |  s                                        E |
    |  s    s s      C C          B B           E |     s  shelves
    |  s    s s      C C          B B           E |     B, C, E  pallet racks
    |  s    s s      C C          B B           E |     D  dock doors
    |                                           E |     P  packing tables
    |                                           E |     F  forklift
    D               F             B B           E |
    |            pallets          B B           E |
    D            pallets          B B           E |
    |                                             |
    +--------------------P--P---------------------+   y = -10

What stands on the lowest level of the racks, the cartons on the pallets and the gaps between them cross the height of a
laser scan at different depths; no two aisles are alike. Built from one seed, the same bytes on every machine.
"""

from __future__ import annotations

from taskslam.geometry import pose_from_xyz_rpy
from taskslam.world.builtin import furniture, storage
from taskslam.world.builtin.builder import Builder
from taskslam.world.builtin.palettes import WarehousePalette
from taskslam.world.builtin.rooms import EAST, NORTH, SOUTH, WEST
from taskslam.world.builtin.structure import Room, Trim, build_room, build_shell
from taskslam.world.world import Light, World

SEED = 31
LOW, HIGH = (-6.5, -10.0), (6.5, 10.0)
HEIGHT = 5.0
_LAMPS = [(x, y) for y in (-7.0, 0.0, 7.0) for x in (-4.0, 1.15, 4.45)]


def build_warehouse() -> World:
    """Build the world `warehouse`, frame `map` with its origin where the aisles cross, z = 0 on the floor."""
    b = Builder(SEED)
    p = WarehousePalette(b, SEED)
    trim = Trim(ceiling=p.roof, skirting=p.steel, frame=p.steel, sill=p.steel, height=HEIGHT)
    build_shell(b, LOW, HIGH, [], p.facade, p.core, HEIGHT)
    build_room(b, Room("hall", LOW, HIGH, p.concrete, p.blockwork, {}), [], trim)
    _roof(b, p)
    _marks(b, p)
    _racks(b, p)
    _shelves(b, p)
    _docks(b, p)
    _floor_storage(b, p)
    _packing(b, p)
    return b.world("warehouse", tuple(_light(x, y) for x, y in _LAMPS), (0.46, 0.47, 0.48), (0.75, 0.78, 0.80))


def _roof(b: Builder, p: WarehousePalette) -> None:
    """Add columns in the walls, girders, and a long lamp over every light."""
    for k, y in enumerate((-6.0, -0.2, 6.4)):
        with b.model(f"girder {k}"):
            b.box((LOW[0], y - 0.1, HEIGHT - 0.45), (HIGH[0], y + 0.1, HEIGHT - 0.02), p.steel)
        for x, side in ((LOW[0], EAST), (HIGH[0], WEST)):
            with b.model("column", x, y, side):
                b.box((-0.15, 0.0, 0.0), (0.15, 0.3, HEIGHT - 0.45), p.steel, skip="-y -z")
                b.box((-0.16, 0.0, 0.0), (0.16, 0.31, 1.2), p.hazard, skip="-y -z")
    for x, y in _LAMPS:
        with b.model("high-bay lamp", x, y):
            b.box((-0.16, -0.75, HEIGHT - 0.62), (0.16, 0.75, HEIGHT - 0.54), p.lamp_glass, solid=False)


def _marks(b: Builder, p: WarehousePalette) -> None:
    """Paint the cross aisle, the kerb lines of the racks, the walkway and the bays for pallets."""
    with b.model("floor markings"):
        for x in (-0.02, 2.22, 3.58, 5.3):
            storage.line(b, p.yellow_tape, x, 1.2, x + 0.1, 7.0)
        for x in (2.22, 3.58, 5.3):
            storage.line(b, p.yellow_tape, x, -7.0, x + 0.1, -1.6)
        for y in (-1.45, 0.95):
            storage.line(b, p.yellow_tape, -6.3, y, 2.2, y + 0.1)
        for k in range(9):
            x = -3.4 + k * 0.6
            storage.line(b, p.white_tape, x, -0.95, x + 0.35, 0.6)
        for y in (-7.2, -3.4):
            storage.outline(b, p.yellow_tape, -6.35, y - 1.5, -4.0, y + 1.5)
        storage.outline(b, p.white_tape, -2.9, -6.4, 0.5, -2.6)
        storage.outline(b, p.white_tape, -6.35, 8.6, -4.3, 9.9)


def _racks(b: Builder, p: WarehousePalette) -> None:
    with b.model("rack E", HIGH[0] - 0.02, 0.4, WEST):
        storage.rack(b, p, 6, 3, "E")
    for name, x, y, side in (("B", 2.4, -4.3, EAST), ("B", 2.4, 3.9, EAST), ("C", -1.1, 3.9, EAST)):
        bays = 2
        with b.model(f"rack {name}", x, y, side):
            storage.rack(b, p, bays, 3, name)
    for x, y in ((2.9, -7.25), (2.9, -1.35), (2.9, 0.95), (-0.6, 0.95), (-0.6, 6.85)):
        with b.model("rack guard", x, y):
            b.box((-0.55, -0.05, 0.02), (0.55, 0.05, 0.42), p.hazard)
    for text, x, y in (("B", 2.9, -1.36), ("B", 2.9, 0.94), ("C", -0.6, 0.94), ("E", 6.0, -7.86)):
        with b.model("aisle sign", x, y):
            plate = p.sign(text)
            b.box((-0.3, -0.02, 3.1), (0.3, 0.02, 3.7), p.steel, faces={"-y": plate, "+y": plate})


def _shelves(b: Builder, p: WarehousePalette) -> None:
    for k in range(3):
        y = 2.6 + k * 1.95
        with b.model("shelves", LOW[0] + 0.02, y, EAST):
            storage.shelving(b, p, 1.9, 0.5)
        with b.model("shelves", -3.62, y, WEST):
            storage.shelving(b, p, 1.9, 0.48)
        if k != 1:
            with b.model("shelves", -3.58, y, EAST):
                storage.shelving(b, p, 1.9, 0.48)
    with b.model("tool chest", -3.58, 4.55, EAST):
        furniture.drawers(b, p, 1.2, 0.45, 0.95, p.red_paint, 5)
    with b.model("waste container", -5.75, 9.3):
        b.box((-0.5, -0.4, 0.08), (0.5, 0.4, 1.05), p.tubs[2])
        b.box((-0.54, -0.44, 1.05), (0.54, 0.44, 1.14), p.rubber)
        b.box((-0.45, -0.35, 0.0), (0.45, 0.35, 0.08), p.rubber, skip="+z -z")
    with b.model("waste container", -4.75, 9.35):
        b.box((-0.3, -0.35, 0.0), (0.3, 0.35, 0.9), p.tubs[0], skip="-z")
        b.box((-0.32, -0.37, 0.9), (0.32, 0.37, 0.98), p.rubber)
    for k, x in enumerate((-2.3, -0.7, 2.2)):
        with b.model("loaded pallet", x, HIGH[1] - 0.05, SOUTH):
            storage.loaded_pallet(b, p, 0.5 + 0.35 * k)
    with b.model("board", 4.3, HIGH[1], SOUTH):
        b.box((-0.95, 0.0, 1.15), (0.95, 0.03, 2.15), p.steel, faces={"+y": p.notices(1.9, 1.0)}, skip="-y")
    with b.model("charging cabinet", 4.1, HIGH[1], SOUTH):
        furniture.cabinet(b, 1.0, 0.45, 0.95, p.tubs[4], 2, p.black)


def _docks(b: Builder, p: WarehousePalette) -> None:
    for name, y in (("1", -7.2), ("2", -3.4)):
        with b.model(f"dock door {name}", LOW[0], y, EAST):
            storage.dock_door(b, p, name)
        for side in (-1.85, 1.85):
            with b.model("bollard", LOW[0] + 0.35, y + side):
                storage.bollard(b, p)
    with b.model("fire point", LOW[0], -1.1, EAST):
        b.panel((0.3, 0.012, 1.55), (-0.6, 0, 0), (0, 0, 0.5), p.sign("F1", (196, 40, 36)), solid=False)
        for x in (-0.16, 0.16):
            b.cylinder((x, 0.16), 0.085, 0.25, 0.85, p.red_paint, sides=12)
    with b.model("exit door", -2.9, LOW[1], NORTH):
        b.box((-0.62, 0.0, 0.0), (0.62, 0.06, 2.2), p.steel, skip="-y -z")
        b.box((-0.55, 0.06, 0.01), (0.55, 0.08, 2.13), p.tubs[2], skip="-y -z")
        b.panel((0.4, 0.05, 2.3), (-0.8, 0, 0), (0, 0, 0.25), p.sign("EXIT", (20, 120, 70)), solid=False)


def _floor_storage(b: Builder, p: WarehousePalette) -> None:
    """Add two rows of pallets with an aisle between, the forklift and the pallet jacks."""
    for x, y, side, height in (
        (-2.2, -5.0, SOUTH, 1.1),
        (-0.3, -5.0, SOUTH, 0.5),
        (-2.3, -4.9, NORTH, 0.8),
        (-0.95, -4.9, NORTH, 1.45),
    ):
        with b.model("loaded pallet", x, y, side + b.dice.uniform(-3.0, 3.0)):
            storage.loaded_pallet(b, p, height)
    with b.model("drums", 0.4, -4.9, NORTH - 2.0):
        storage.drums(b, p, p.tubs[0])
    with b.model("empty pallets", -5.4, -9.75, NORTH + 2.0):
        for k in range(7):
            storage.pallet(b, p, b.dice.uniform(-0.02, 0.02), b.dice.uniform(0.0, 0.03), k * storage.PALLET[2])
    with b.model("forklift", -2.5, -1.9, 90.0):
        storage.forklift(b, p)
    with b.model("pallet jack", -6.1, -0.1, EAST + 4.0):
        storage.pallet_jack(b, p)
    with b.model("pallet jack", -4.3, -9.7, NORTH - 3.0):
        storage.pallet_jack(b, p)


def _packing(b: Builder, p: WarehousePalette) -> None:
    for x in (-0.9, 1.2, 3.4):
        with b.model("packing table", x, LOW[1] + 0.02, NORTH):
            storage.packing_table(b, p)
    with b.model("loaded pallet", 5.7, LOW[1] + 0.1, NORTH + 3.0):
        storage.loaded_pallet(b, p, 1.2)
    with b.model("roll cage", 5.9, -8.4, WEST):
        storage.shelving(b, p, 1.0, 0.6, 1.95)


def _light(x: float, y: float) -> Light:
    """Return the light of one lamp."""
    return Light(
        name="high-bay lamp",
        type="point",
        pose=pose_from_xyz_rpy((x, y, HEIGHT - 0.8), (0.0, 0.0, 0.0)),
        diffuse=(0.62, 0.62, 0.60),
        attenuation_range=16.0,
        attenuation=(0.7, 0.05, 0.03),
    )
