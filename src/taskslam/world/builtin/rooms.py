"""What stands where in the house. Positions are metres in the world; a piece's front looks along `degrees` + 90."""

from __future__ import annotations

from taskslam.world.builtin import fittings, furniture
from taskslam.world.builtin.builder import Builder
from taskslam.world.builtin.palettes import HousePalette

NORTH, WEST, SOUTH, EAST = 0.0, 90.0, 180.0, -90.0  # where a piece's front looks


def furnish_living(b: Builder, p: HousePalette) -> None:
    """Add sofa group, media wall, bookshelves, window seat and sideboard."""
    with b.model("living rug", -4.68, -2.06):
        furniture.rug(b, p, 3.2, 2.2)
    with b.model("sofa", -4.68, -3.88, NORTH):
        furniture.sofa(b, p, p.blue_fabric, 3, p.mustard_fabric)
    with b.model("coffee table", -4.68, -2.28, NORTH):
        furniture.low_table(b, p, 1.1, 0.6)
    with b.model("armchair", -7.17, -1.42, EAST + 20):
        furniture.sofa(b, p, p.rust_fabric, 1)
    with b.model("media cabinet", -4.68, 0.59, SOUTH):
        furniture.cabinet(b, 1.7, 0.42, 0.52, p.walnut, 3, p.black)
        b.box((-0.62, 0.05, 0.66), (0.62, 0.09, 1.38), p.black, faces={"+y": p.screen})
        b.box((-0.2, 0.08, 0.52), (0.2, 0.26, 0.54), p.black)
        b.box((-0.04, 0.06, 0.54), (0.04, 0.09, 0.68), p.black)
    for x in (-7.92, -6.91):
        with b.model("bookshelf", x, -5.85, NORTH):
            furniture.bookshelf(b, p, 0.9, 2.1, p.oak)
    with b.model("window seat", -4.68, -5.85, NORTH):
        furniture.drawers(b, p, 1.8, 0.42, 0.42, p.white_wood, 1)
        b.soft_box((-0.88, 0.02, 0.42), (0.88, 0.42, 0.50), p.green_fabric, 0.03)
    for x in (-6.11, -3.25):
        with b.model("curtain", x, -5.83, NORTH):
            furniture.curtain(b, p, 0.55)
    with b.model("upright piano", -1.66, -2.17, WEST):
        _piano(b, p)
    with b.model("plant", -2.18, -5.32):
        furniture.plant(b, p, 1.5, 0.22)
    with b.model("plant", -8.08, 0.14):
        furniture.plant(b, p, 1.1, 0.18)
    with b.model("floor lamp", -7.97, -2.49):
        furniture.lamp(b, p, 1.65)
    with b.model("side table", -2.79, -3.4):
        b.cylinder((0.0, 0.0), 0.20, 0.0, 0.02, p.black)
        b.cylinder((0.0, 0.0), 0.02, 0.02, 0.50, p.black, sides=8)
        b.cylinder((0.0, 0.0), 0.23, 0.50, 0.53, p.oak)
        furniture.lamp(b, p, 0.55, base=0.53)
    with b.model("basket", -2.13, -1.0):
        b.cylinder((0.0, 0.0), 0.17, 0.0, 0.32, p.oak, 0.21, closed=False)
        b.disc((0.0, 0.0), 0.19, 0.27, p.tartan)
    for x, y, side, wide, tall in (
        (-8.5, -1.26, EAST, 1.2, 0.85),
        (-8.5, -5.05, EAST, 0.6, 0.8),
        (-1.66, -2.17, WEST, 0.9, 0.6),
        (-2.56, -5.85, NORTH, 0.6, 0.8),
        (-1.66, -5.26, WEST, 0.5, 0.6),
        (-1.97, 0.59, SOUTH, 0.35, 0.5),
    ):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.black, 1.6)


def _piano(b: Builder, p: HousePalette) -> None:
    b.box((-0.74, 0.0, 0.0), (0.74, 0.34, 1.20), p.walnut, skip="-z")
    b.box((-0.76, 0.0, 1.20), (0.76, 0.36, 1.23), p.walnut)
    b.box((-0.74, 0.34, 0.60), (0.74, 0.58, 0.70), p.walnut)
    b.box((-0.66, 0.37, 0.70), (0.66, 0.52, 0.722), p.porcelain, skip="-z")
    for key in range(36):
        if key % 7 not in (2, 6):
            x = -0.66 + (key + 0.75) * 1.32 / 36
            b.box((x, 0.37, 0.722), (x + 0.018, 0.46, 0.735), p.black, skip="-z", solid=False)
    for x in (-0.74, 0.66):
        b.box((x, 0.48, 0.0), (x + 0.08, 0.56, 0.60), p.walnut, skip="-z +z")
    b.box((-0.3, 0.34, 0.80), (0.3, 0.36, 1.05), p.linen, skip="-y")


def furnish_kitchen(b: Builder, p: HousePalette) -> None:
    """Add counters along two walls, a dining table with six chairs, a dresser and a fridge."""
    with b.model("counter north", -6.6, 5.85, SOUTH):
        fittings.counter(b, p, 2.6, 4, p.teal_wood, p.splashback)
    with b.model("stove", -6.38, 5.85, SOUTH):
        fittings.stove(b, p)
    with b.model("counter west", -8.5, 3.95, EAST):
        fittings.counter(b, p, 3.8, 6, p.teal_wood, p.splashback)
    with b.model("sink", -8.5, 3.29, EAST):
        fittings.sink(b, p)
    for x, wide in ((-7.39, 0.9), (-5.58, 0.5)):
        with b.model("wall cabinets", x, 5.85, SOUTH):
            fittings.wall_cabinets(b, p, wide, 2 if wide > 0.6 else 1, p.white_wood)
    with b.model("fridge", -4.92, 5.85, SOUTH):
        fittings.fridge(b, p)
    with b.model("dining rug", -4.78, 2.92):
        furniture.rug(b, p, 2.7, 2.0)
    with b.model("dining table", -4.78, 2.92):
        furniture.table(b, p.oak, 1.9, 0.95)
        b.cylinder((0.1, 0.0), 0.14, 0.74, 0.82, p.terracotta, 0.2)
        for x, y in ((0.1, 0.02), (0.04, -0.06), (0.16, -0.04)):
            b.soft_box((x - 0.045, y - 0.045, 0.79), (x + 0.045, y + 0.045, 0.88), p.rust_fabric, 0.03)
    for k, x in enumerate((-5.37, -4.78, -4.2)):
        cushion = (p.mustard_fabric, p.green_fabric, p.rust_fabric)[k]
        with b.model("chair", x, 2.14 - 0.03 * k, NORTH + 4 * k):
            furniture.chair(b, p.oak, cushion)
        with b.model("chair", x, 3.69 + 0.03 * k, SOUTH - 5 * k):
            furniture.chair(b, p.oak, cushion)
    with b.model("dresser", -1.66, 3.93, WEST):
        furniture.cabinet(b, 1.5, 0.45, 0.86, p.sage_wood, 3, p.black)
        b.box((-0.72, 0.0, 0.86), (-0.69, 0.28, 1.95), p.sage_wood, skip="-z")
        b.box((0.69, 0.0, 0.86), (0.72, 0.28, 1.95), p.sage_wood, skip="-z")
        for z in (1.2, 1.55, 1.92):
            b.box((-0.69, 0.0, z), (0.69, 0.27, z + 0.025), p.sage_wood)
        _crockery(b, p)
    with b.model("bin", -3.99, 5.53):
        b.cylinder((0.0, 0.0), 0.17, 0.0, 0.62, p.steel)
    with b.model("radiator", -2.77, 5.85, SOUTH):
        _radiator(b, p, 1.0)
    with b.model("step stool", -8.4, 1.4, EAST):
        b.box((-0.18, 0.0, 0.20), (0.18, 0.36, 0.23), p.yellow_wood)
        furniture.legs(b, 0.17, 0.02, 0.34, 0.20, p.yellow_wood, 0.03)
    with b.model("plant", -2.11, 5.4):
        furniture.plant(b, p, 1.3, 0.2)
    with b.model("wine shelf", -1.66, 1.86, WEST):
        furniture.bookshelf(b, p, 0.8, 1.1, p.oak)
    for x, y, side, wide, tall in (
        (-1.66, 1.86, WEST, 0.7, 0.5),
        (-4.68, 0.71, NORTH, 1.3, 0.8),
        (-8.02, 0.71, NORTH, 0.4, 0.55),
        (-8.5, 1.38, EAST, 0.5, 0.7),
    ):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.oak, 1.6)


def _crockery(b: Builder, p: HousePalette) -> None:
    """Add bowls and jars on the dresser."""
    glazes = (p.terracotta, p.porcelain, p.splashback, p.mustard_fabric)
    for row, z in enumerate((0.86, 1.225, 1.575)):
        for k in range(6):
            x = -0.56 + k * 0.22 + b.dice.uniform(-0.03, 0.03)
            tall, wide = b.dice.uniform(0.08, 0.22), b.dice.uniform(0.05, 0.085)
            glaze = glazes[(k + row) % len(glazes)]
            b.cylinder((x, 0.14), wide, z, z + tall, glaze, wide * b.dice.uniform(0.6, 1.2), sides=10, solid=False)


def _radiator(b: Builder, p: HousePalette, wide: float) -> None:
    b.box((-wide / 2, 0.04, 0.12), (wide / 2, 0.08, 0.70), p.porcelain)
    ribs = int(wide / 0.08)
    for k in range(ribs):
        x = -wide / 2 + (k + 0.5) * wide / ribs
        b.box((x - 0.025, 0.08, 0.13), (x + 0.025, 0.11, 0.69), p.porcelain, skip="-y")


def furnish_corridor(b: Builder, p: HousePalette) -> None:
    """Add runner, coat rack, shoe cabinet, pictures and the front door."""
    with b.model("runner", 3.62, -0.07):
        furniture.rug(b, p, 3.6, 0.9)
    with b.model("doormat", 7.81, -0.04):
        furniture.rug(b, p, 0.7, 1.1)
    with b.model("front door", 8.5, -0.04, WEST):
        fittings.front_door(b, p)
    with b.model("coat rack", 4.0, -0.99, NORTH):
        fittings.coat_rack(b, p, 1.4)
    with b.model("shoe cabinet", 2.03, 0.89, SOUTH):
        furniture.cabinet(b, 1.1, 0.24, 0.95, p.sage_wood, 3, p.black)
        b.cylinder((0.3, 0.12), 0.07, 0.95, 1.15, p.terracotta, 0.04, sides=12)
    with b.model("console", 5.96, 0.89, SOUTH):
        b.box((-0.55, 0.0, 0.76), (0.55, 0.28, 0.80), p.walnut)
        b.box((-0.55, 0.0, 0.30), (0.55, 0.28, 0.33), p.walnut)
        furniture.legs(b, 0.54, 0.01, 0.27, 0.76, p.walnut, 0.04)
        b.box((-0.40, 0.0, 1.05), (0.40, 0.02, 1.85), p.walnut, skip="-y", faces={"+y": p.mirror})
        b.box((-0.45, 0.04, 0.33), (-0.1, 0.25, 0.55), p.linen)
    with b.model("plant", 8.1, 0.54):
        furniture.plant(b, p, 1.2, 0.17)
    with b.model("umbrella stand", 7.18, -0.82):
        b.cylinder((0.0, 0.0), 0.11, 0.0, 0.48, p.black)
    for x, y, side, wide, tall in (
        (0.0, -0.99, NORTH, 0.9, 0.6),
        (-1.01, -0.99, NORTH, 0.4, 0.55),
        (2.03, 0.89, SOUTH, 0.8, 0.55),
        (-1.12, 0.89, SOUTH, 0.35, 0.5),
        (0.91, 0.89, SOUTH, 0.45, 0.6),
        (2.88, -0.99, NORTH, 0.4, 0.55),
        (5.11, -0.99, NORTH, 0.45, 0.6),
        (7.76, -0.99, NORTH, 0.7, 0.5),
        (7.23, 0.89, SOUTH, 0.6, 0.8),
        (8.5, 0.73, WEST, 0.2, 0.3),
    ):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.oak, 1.55)


def furnish_study(b: Builder, p: HousePalette) -> None:
    """Add desk under the window, library, reading chair and filing drawers."""
    with b.model("study rug", 0.8, -3.24):
        furniture.rug(b, p, 2.2, 1.7)
    with b.model("desk", 0.75, -5.4):
        furniture.table(b, p.walnut, 1.7, 0.78)
        b.box((-0.80, -0.34, 0.10), (-0.40, 0.30, 0.66), p.walnut)
        b.box((-0.10, -0.25, 0.75), (0.20, -0.10, 0.77), p.black)
        b.box((-0.32, -0.21, 0.86), (0.42, -0.18, 1.30), p.black, faces={"+y": p.screen})
        b.box((0.02, -0.22, 0.77), (0.08, -0.20, 0.90), p.black)
        b.box((-0.15, 0.08, 0.74), (0.30, 0.22, 0.76), p.steel)
        b.box((0.50, -0.20, 0.74), (0.74, 0.12, 0.84), p.rust_fabric)
    with b.model("office chair", 0.8, -4.52, 160.0):
        furniture.office_chair(b, p, p.green_fabric)
    for y in (-1.74, -2.7):
        with b.model("bookshelf", -1.54, y, EAST):
            furniture.bookshelf(b, p, 0.88, 2.2, p.walnut)
    with b.model("filing drawers", 3.14, -4.68, WEST):
        furniture.drawers(b, p, 1.6, 0.46, 0.78, p.oak, 3)
    with b.model("plant", 2.84, -5.21):
        furniture.plant(b, p, 0.55, 0.11, base=0.78)
    with b.model("reading chair", 0.32, -1.37, SOUTH - 20):
        furniture.sofa(b, p, p.mustard_fabric, 1)
    with b.model("floor lamp", -0.77, -1.42):
        furniture.lamp(b, p, 1.7)
    with b.model("globe", -1.12, -5.42):
        b.cylinder((0.0, 0.0), 0.2, 0.0, 0.04, p.walnut)
        b.cylinder((0.0, 0.0), 0.03, 0.04, 0.45, p.walnut, sides=8)
        b.soft_box((-0.24, -0.24, 0.45), (0.24, 0.24, 0.93), p.kids_quilt, 0.16)
    for x in (-0.48, 1.97):
        with b.model("curtain", x, -5.83, NORTH):
            furniture.curtain(b, p, 0.4)
    for x, y, side, wide, tall in (
        (3.14, -4.68, WEST, 1.0, 0.7),
        (-1.54, -5.26, EAST, 0.6, 0.8),
        (3.14, -1.58, WEST, 0.5, 0.7),
        (0.37, -1.11, SOUTH, 0.8, 0.55),
        (2.79, -1.11, SOUTH, 0.35, 0.5),
    ):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.black, 1.65)


def furnish_children(b: Builder, p: HousePalette) -> None:
    """Add bed, desk, tent, wardrobe and toys."""
    with b.model("play rug", 5.74, -3.5):
        furniture.rug(b, p, 2.2, 2.2)
    with b.model("child's bed", 8.5, -4.89, WEST):
        furniture.bed(b, p, 0.95, p.yellow_wood, p.kids_quilt, 1)
    with b.model("toy shelf", 3.26, -4.84, EAST):
        fittings.toy_shelf(b, p, 1.6)
    with b.model("child's desk", 5.21, -5.51):
        furniture.table(b, p.white_wood, 1.1, 0.58, 0.62)
        b.box((-0.35, -0.2, 0.62), (-0.15, 0.0, 0.70), p.rust_fabric)
    with b.model("child's chair", 5.21, -4.73, SOUTH - 10):
        furniture.chair(b, p.yellow_wood, p.blue_fabric)
    with b.model("wardrobe", 4.42, -1.11, SOUTH):
        furniture.cabinet(b, 1.7, 0.56, 1.92, p.sage_wood, 4, p.yellow_wood)
    with b.model("tent", 7.71, -1.88, 15.0):
        fittings.tepee(b, p)
    with b.model("toy chest", 8.45, -3.77, WEST):
        furniture.drawers(b, p, 0.75, 0.42, 0.36, p.teal_wood, 1)
    with b.model("beanbag", 7.39, -3.13, 25.0):
        fittings.beanbag(b, p.rust_fabric)
    with b.model("curtain", 4.74, -5.83, NORTH):
        furniture.curtain(b, p, 0.35)
    with b.model("curtain", 7.18, -5.83, NORTH):
        furniture.curtain(b, p, 0.35)
    for x, y, side, wide, tall in (
        (3.26, -5.0, EAST, 0.9, 0.6),
        (8.5, -4.89, WEST, 0.8, 0.6),
        (7.76, -5.85, NORTH, 0.5, 0.7),
        (7.39, -1.11, SOUTH, 0.6, 0.45),
        (3.26, -1.58, EAST, 0.4, 0.5),
    ):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.yellow_wood, 1.5)


def furnish_bath(b: Builder, p: HousePalette) -> None:
    """Add bathtub, washstand, toilet, washing machine and towels."""
    with b.model("bathtub", -0.68, 5.85, SOUTH):
        fittings.bathtub(b, p, p.bath_wall)
    with b.model("washstand", -1.54, 2.17, EAST):
        fittings.vanity(b, p)
    with b.model("toilet", -1.54, 3.88, EAST):
        fittings.toilet(b, p)
    with b.model("washing machine", 1.54, 1.54, WEST):
        fittings.washing_machine(b, p)
    with b.model("towel shelf", 1.54, 2.49, WEST):
        furniture.cabinet(b, 0.6, 0.34, 1.75, p.white_wood, 1, p.steel)
    with b.model("bath mat", -0.43, 4.57):
        furniture.rug(b, p, 1.0, 0.6)
    with b.model("laundry basket", 1.17, 5.42):
        b.cylinder((0.0, 0.0), 0.2, 0.0, 0.55, p.oak, 0.24, closed=False)
        b.disc((0.0, 0.0), 0.23, 0.5, p.linen)
    with b.model("towel rail", -1.54, 3.13, EAST):
        b.box((-0.25, 0.03, 0.7), (0.25, 0.07, 1.35), p.rust_fabric)
        b.box((-0.3, 0.04, 1.35), (0.3, 0.06, 1.37), p.steel, solid=False)
    for x, y, side, wide, tall in ((1.54, 5.05, WEST, 0.5, 0.7), (1.01, 1.01, NORTH, 0.4, 0.5)):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.walnut, 1.6)


def furnish_bedroom(b: Builder, p: HousePalette) -> None:
    """Add double bed with nightstands, wardrobe, dressing table, bench and chair."""
    with b.model("bedroom rug", 5.9, 3.51):
        furniture.rug(b, p, 2.6, 2.6)
    with b.model("double bed", 8.5, 3.51, WEST):
        furniture.bed(b, p, 1.7, p.walnut, p.tartan, 2)
    for y in (2.25, 4.76):
        with b.model("nightstand", 8.5, y, WEST):
            furniture.drawers(b, p, 0.45, 0.40, 0.50, p.walnut, 2)
            with_lamp = 0.45
            b.cylinder((0.0, 0.2), 0.08, 0.50, 0.52, p.black)
            b.cylinder((0.0, 0.2), 0.015, 0.52, 0.50 + with_lamp - 0.18, p.steel, sides=8)
            b.cylinder((0.0, 0.2), 0.14, 0.50 + with_lamp - 0.2, 0.50 + with_lamp, p.shade, 0.09, closed=False)
    with b.model("bench", 6.22, 3.51, WEST):
        b.soft_box((-0.6, 0.0, 0.38), (0.6, 0.38, 0.47), p.green_fabric, 0.03)
        furniture.legs(b, 0.57, 0.03, 0.35, 0.38, p.walnut)
    with b.model("wardrobe", 6.7, 1.01, NORTH):
        furniture.cabinet(b, 2.4, 0.60, 2.2, p.oak, 4, p.black)
    with b.model("dressing table", 2.61, 5.85, SOUTH):
        furniture.drawers(b, p, 1.1, 0.46, 0.80, p.white_wood, 3)
        b.box((-0.3, 0.02, 0.95), (0.3, 0.04, 1.65), p.oak, faces={"+y": p.mirror})
    with b.model("bedroom chair", 2.51, 1.75, EAST + 35):
        furniture.sofa(b, p, p.green_fabric, 1)
    with b.model("plant", 8.08, 5.45):
        furniture.plant(b, p, 1.3, 0.2)
    with b.model("blanket chest", 4.47, 5.85, SOUTH):
        furniture.drawers(b, p, 1.3, 0.45, 0.46, p.oak, 1)
        b.soft_box((-0.6, 0.03, 0.46), (0.6, 0.43, 0.52), p.linen, 0.025)
    for x in (3.15, 5.8):
        with b.model("curtain", x, 5.83, SOUTH):
            furniture.curtain(b, p, 0.45)
    for x, y, side, wide, tall in (
        (1.66, 2.49, EAST, 0.7, 0.9),
        (1.66, 5.16, EAST, 0.4, 0.55),
        (7.02, 5.85, SOUTH, 0.9, 0.65),
        (2.45, 1.01, NORTH, 0.7, 0.5),
        (5.05, 1.01, NORTH, 0.35, 0.5),
    ):
        with b.model("picture", x, y, side):
            furniture.picture(b, p, wide, tall, p.walnut, 1.55)
