"""Furniture of a warehouse: pallets, racks, shelves, trucks, doors. Frames as in `furniture`.

What a pallet carries is packed at random, so that every bay shows another profile at the height of a laser scan.
"""

from __future__ import annotations

from taskslam.world.builtin import furniture
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.palettes import WarehousePalette

PALLET = (1.2, 0.8, 0.144)  # EUR pallet, ISO 6780: wide, deep, high


def pallet(b: Builder, p: WarehousePalette, x: float, y: float, z: float = 0.0) -> None:
    """Add a pallet, the middle of its back at x, y, z."""
    wide, deep, high = PALLET
    x0 = x - wide / 2
    for k in range(3):
        at = y + k * (deep - 0.1) / 2
        b.box((x0, at, z), (x0 + wide, at + 0.1, z + high - 0.022), p.deal, skip="-z")
    for k in range(5):
        at = y + k * (deep - 0.12) / 4
        b.box((x0, at, z + high - 0.022), (x0 + wide, at + 0.12, z + high), p.deal)


def carton(b: Builder, p: WarehousePalette, low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
    """Add a cardboard box between two corners."""
    face, other, lid = (b.dice.choice(p.cartons) for _ in range(3))
    b.box(low, high, face, faces={"+x": other, "-x": other, "+z": lid}, skip="-z")


def stack(
    b: Builder, p: WarehousePalette, wide: float, deep: float, height: float, x: float, y: float, z: float
) -> None:
    """Add layers of cartons, the middle of the back at x, y, z; ragged at the front and at the top."""
    columns, rows = b.dice.choice([(2, 1), (2, 2), (3, 2), (3, 1)])
    tall = b.dice.uniform(0.28, 0.5)
    layers = max(int(height / tall), 1)
    for layer in range(layers):
        for i in range(columns):
            for j in range(rows):
                if layer == layers - 1 and layers > 1 and b.dice.uniform() < 0.3:
                    continue
                gap = b.dice.uniform(0.008, 0.03)
                x0, y0 = x - wide / 2 + i * wide / columns, y + j * deep / rows
                y1 = y0 + deep / rows - gap - (b.dice.uniform(0.0, 0.06) if j == rows - 1 else 0.0)
                z0 = z + layer * tall
                carton(b, p, (x0 + gap, y0 + gap, z0), (x0 + wide / columns - gap, y1, z0 + tall - 0.004))


def loaded_pallet(
    b: Builder, p: WarehousePalette, height: float, x: float = 0.0, y: float = 0.0, z: float = 0.0
) -> None:
    """Add a pallet with cartons up to about `height` above it."""
    pallet(b, p, x, y, z)
    stack(b, p, PALLET[0] - 0.04, PALLET[1] - 0.03, height, x, y + 0.015, z + PALLET[2])


def drums(b: Builder, p: WarehousePalette, surface: Surface) -> None:
    """Add a pallet with four steel drums."""
    pallet(b, p, 0.0, 0.0)
    low = PALLET[2]
    for x in (-0.3, 0.3):
        for y in (0.21, 0.6):
            radius = 0.19
            for z in (0.0, 0.26, 0.52):
                b.cylinder((x, y), radius, low + z, low + z + 0.26, surface, radius - 0.006, sides=12, closed=False)
            b.disc((x, y), radius - 0.006, low + 0.78, p.steel, sides=12)


def rack(
    b: Builder, p: WarehousePalette, bays: int, levels: int, name: str, bay: float = 2.7, deep: float = 1.0
) -> None:
    """Add a pallet rack: uprights, beams, two pallets in most places of every bay, the bay's number on a plate."""
    half, top = bays * bay / 2, 0.3 + levels * 1.42
    for k in range(bays + 1):
        x = -half + k * bay
        for y in (0.0, deep - 0.08):
            b.box((x - 0.045, y, 0.0), (x + 0.045, y + 0.08, top), p.rack_blue, skip="-z")
            b.box((x - 0.07, y - 0.01, 0.0), (x + 0.07, y + 0.09, 0.012), p.rack_blue, skip="-z")
        for z in (0.25, 1.2, 2.2, 3.2):
            if z < top:
                b.box((x - 0.02, 0.08, z), (x + 0.02, deep - 0.08, z + 0.04), p.rack_blue)
        b.box((x - 0.075, deep, 0.0), (x + 0.075, deep + 0.05, 0.42), p.yellow_paint, skip="-z -y")
    for k in range(bays):
        x0, x1 = -half + k * bay + 0.045, -half + (k + 1) * bay - 0.045
        middle = (x0 + x1) / 2
        for level in range(levels):
            z = level * 1.45
            if level:
                for y in (0.02, deep - 0.07):
                    b.box((x0, y, z - 0.11), (x1, y + 0.05, z), p.rack_orange)
                b.box((x0, 0.07, z - 0.03), (x1, deep - 0.07, z - 0.008), p.deal)
            for side in (-0.64, 0.64):
                if b.dice.uniform() < 0.14:
                    continue
                shift = b.dice.uniform(-0.03, 0.03)
                loaded_pallet(b, p, b.dice.uniform(0.45, 1.02), middle + side + shift, b.dice.uniform(0.05, 0.16), z)
        plate = p.sign(f"{name}{k + 1}")
        b.panel((x0 + 0.34, deep - 0.015, 1.455), (-0.28, 0, 0), (0, 0, 0.16), plate, solid=False)


def shelving(b: Builder, p: WarehousePalette, wide: float, deep: float = 0.5, height: float = 2.2) -> None:
    """Add steel shelves with tubs and small cartons; the lowest board lies at 0.10 m, the next at 0.5 m."""
    for x in (-wide / 2, wide / 2 - 0.04):
        for y in (0.0, deep - 0.04):
            b.box((x, y, 0.0), (x + 0.04, y + 0.04, height), p.steel, skip="-z")
    boards = [0.08, 0.52, 0.96, 1.40, 1.84]
    for z in boards:
        b.box((-wide / 2, 0.0, z), (wide / 2, deep, z + 0.03), p.steel)
        x = -wide / 2 + 0.06
        while x < wide / 2 - 0.2:
            size = b.dice.uniform(0.2, 0.42)
            end = min(x + size, wide / 2 - 0.06)
            tall, back = b.dice.uniform(0.14, 0.36), b.dice.uniform(0.02, 0.16)
            chance = b.dice.uniform()
            if chance < 0.45:
                b.box((x, back, z + 0.03), (end, deep - 0.02, z + 0.03 + tall * 0.7), b.dice.choice(p.tubs), skip="-z")
            elif chance < 0.88:
                carton(b, p, (x, back, z + 0.03), (end, deep - 0.03, z + 0.03 + tall))
            x = end + b.dice.uniform(0.015, 0.09)


def pallet_jack(b: Builder, p: WarehousePalette) -> None:
    """Add a hand pallet truck, forks towards +y, its tiller upright at the origin."""
    for x in (-0.27, 0.11):
        b.box((x, 0.36, 0.06), (x + 0.16, 1.5, 0.10), p.yellow_paint)
        b.box((x + 0.05, 1.3, 0.0), (x + 0.11, 1.42, 0.06), p.rubber, skip="-z +z")
    b.box((-0.27, 0.24, 0.06), (0.27, 0.38, 0.46), p.yellow_paint)
    b.cylinder((0.0, 0.14), 0.10, 0.0, 0.20, p.rubber, sides=10)
    b.cylinder((0.0, 0.14), 0.06, 0.20, 0.60, p.red_paint, sides=10)
    b.box((-0.025, 0.09, 0.60), (0.025, 0.14, 1.18), p.black)
    b.box((-0.16, 0.08, 1.16), (0.16, 0.13, 1.24), p.red_paint)


def forklift(b: Builder, p: WarehousePalette) -> None:
    """Add a counterbalance truck, forks towards +y, 1.1 m wide and 2.9 m long."""
    for x in (-0.55, 0.33):
        for y in (0.28, 1.42):
            furniture.wheel(b, p.rubber, x + 0.11, y + 0.23, 0.25, 0.25, 0.2)
            furniture.wheel(b, p.yellow_paint, x + 0.11, y + 0.23, 0.25, 0.12, 0.21)
    b.soft_box((-0.5, 0.0, 0.22), (0.5, 0.72, 1.02), p.yellow_paint, 0.09)
    b.box((-0.48, 0.6, 0.22), (0.48, 1.8, 0.56), p.yellow_paint)
    b.box((-0.42, 1.45, 0.56), (0.42, 1.62, 1.02), p.black)
    b.soft_box((-0.28, 0.62, 0.60), (0.28, 1.12, 0.72), p.black, 0.04)
    b.soft_box((-0.27, 0.56, 0.72), (0.27, 0.68, 1.26), p.black, 0.05)
    b.cylinder((0.0, 1.36), 0.17, 1.02, 1.05, p.black, sides=12)
    for x in (-0.46, 0.41):
        for y, bottom in ((0.3, 1.0), (1.55, 0.56)):
            b.box((x, y, bottom), (x + 0.05, y + 0.05, 2.08), p.black)
    b.box((-0.48, 0.26, 2.08), (0.48, 1.64, 2.13), p.black)
    for x in (-0.40, 0.28):
        b.box((x, 1.82, 0.08), (x + 0.12, 1.94, 2.3), p.rack_blue)
    for z in (0.3, 1.1, 2.2):
        b.box((-0.28, 1.84, z), (0.28, 1.92, z + 0.08), p.rack_blue)
    b.box((-0.46, 1.94, 0.16), (0.46, 1.98, 0.62), p.black)
    for x in (-0.34, 0.22):
        b.box((x, 1.98, 0.12), (x + 0.12, 2.95, 0.16), p.steel)
    b.box((-0.5, -0.005, 0.30), (0.5, 0.02, 0.48), p.hazard, solid=False)


def dock_door(b: Builder, p: WarehousePalette, name: str, wide: float = 2.8, tall: float = 3.2) -> None:
    """Add a closed roller shutter with its guides, box, bumpers and number."""
    b.box((-wide / 2, 0.0, 0.0), (wide / 2, 0.05, tall), p.shutter, skip="-y -z")
    for x in (-wide / 2 - 0.16, wide / 2):
        b.box((x, 0.0, 0.0), (x + 0.16, 0.14, tall), p.hazard, skip="-y -z")
    b.box((-wide / 2 - 0.2, 0.0, tall), (wide / 2 + 0.2, 0.36, tall + 0.4), p.steel, skip="-y")
    for x in (-wide / 2 - 0.45, wide / 2 + 0.17):
        b.box((x, 0.0, 0.15), (x + 0.26, 0.12, 0.65), p.rubber, skip="-y")
    b.panel((wide / 2 + 0.75, 0.012, 1.9), (-0.36, 0, 0), (0, 0, 0.5), p.sign(name, (240, 190, 40), (30, 30, 30)))


def packing_table(b: Builder, p: WarehousePalette, wide: float = 1.8) -> None:
    """Add a bench with a shelf below, a monitor, a roll of film and cartons."""
    b.box((-wide / 2, 0.0, 0.86), (wide / 2, 0.8, 0.90), p.deal)
    b.box((-wide / 2 + 0.04, 0.06, 0.34), (wide / 2 - 0.04, 0.74, 0.37), p.deal)
    furniture.legs(b, wide / 2 - 0.02, 0.02, 0.78, 0.86, p.steel)
    stack(b, p, wide - 0.3, 0.55, 0.46, 0.0, 0.1, 0.37)
    b.box((-0.7, 0.14, 1.08), (-0.2, 0.18, 1.40), p.black, faces={"+y": p.screen})
    b.box((-0.48, 0.12, 0.90), (-0.42, 0.16, 1.2), p.black)
    b.cylinder((0.25, 0.3), 0.07, 0.90, 1.36, p.linen, sides=12)
    carton(b, p, (0.42, 0.2, 0.90), (0.8, 0.6, 1.2))
    b.box((-wide / 2, 0.0, 1.75), (wide / 2, 0.35, 1.78), p.steel)
    for x in (-wide / 2, wide / 2 - 0.04):
        b.box((x, 0.0, 0.90), (x + 0.04, 0.04, 1.78), p.steel)
    for x in (-0.6, 0.0, 0.5):
        carton(b, p, (x - 0.2, 0.04, 1.78), (x + 0.2, 0.32, 1.78 + b.dice.uniform(0.15, 0.35)))


def bollard(b: Builder, p: WarehousePalette) -> None:
    """Add a post, 0.2 m across."""
    for low, high, surface in ((0.0, 0.3, p.yellow_paint), (0.3, 0.45, p.black), (0.45, 0.95, p.yellow_paint)):
        b.cylinder((0.0, 0.0), 0.1, low, high, surface, sides=14, closed=False)
    b.disc((0.0, 0.0), 0.1, 0.95, p.yellow_paint, sides=14)


def line(b: Builder, surface: Surface, x0: float, y0: float, x1: float, y1: float) -> None:
    """Paint a rectangle of floor marking, 3 mm thick; driven over."""
    b.panel((x0, y0, 0.003), (x1 - x0, 0, 0), (0, y1 - y0, 0), surface, solid=False)


def outline(b: Builder, surface: Surface, x0: float, y0: float, x1: float, y1: float, thick: float = 0.1) -> None:
    """Paint the border of a rectangle on the floor."""
    line(b, surface, x0, y0, x1, y0 + thick)
    line(b, surface, x0, y1 - thick, x1, y1)
    line(b, surface, x0, y0 + thick, x0 + thick, y1 - thick)
    line(b, surface, x1 - thick, y0 + thick, x1, y1 - thick)
