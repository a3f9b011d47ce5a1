"""Fittings of kitchen, bathroom, hall and children's room. Frames as in `furniture`."""

from __future__ import annotations

from itertools import pairwise

from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.furniture import cabinet
from taskslam.world.builtin.palette import Palette


def counter(b: Builder, p: Palette, wide: float, doors: int, body: Surface, tiles: Surface) -> None:
    """Add base cabinets under a granite top at 0.90 m, with tiles behind."""
    cabinet(b, wide, 0.60, 0.88, body, doors, p.black, plinth=0.10)
    b.box((-wide / 2, 0.0, 0.88), (wide / 2, 0.63, 0.92), p.granite)
    b.box((-wide / 2, 0.0, 0.92), (wide / 2, 0.012, 1.45), tiles, skip="-y -z")


def wall_cabinets(b: Builder, p: Palette, wide: float, doors: int, body: Surface) -> None:
    """Add hanging cabinets from 1.45 to 2.15 m."""
    b.box((-wide / 2, 0.0, 1.45), (wide / 2, 0.33, 2.15), body)
    step = wide / doors
    for k in range(doors):
        x = -wide / 2 + k * step
        b.box((x + 0.006, 0.33, 1.455), (x + step - 0.006, 0.35, 2.145), body, skip="-y")
        b.box((x + 0.05, 0.35, 1.50), (x + 0.07, 0.365, 1.62), p.black, solid=False, skip="-y")


def stove(b: Builder, p: Palette) -> None:
    """Add hob, oven front and hood to a counter."""
    b.box((-0.29, 0.06, 0.92), (0.29, 0.56, 0.928), p.black, skip="-z")
    for x in (-0.14, 0.14):
        for y in (0.19, 0.43):
            b.disc((x, y), 0.085, 0.930, p.steel, solid=False)
    b.box((-0.29, 0.60, 0.16), (0.29, 0.625, 0.84), p.black, faces={"+y": p.steel})
    b.box((-0.24, 0.625, 0.30), (0.24, 0.63, 0.62), p.black, solid=False)
    b.box((-0.22, 0.63, 0.70), (0.22, 0.66, 0.72), p.steel, solid=False)
    b.box((-0.30, 0.0, 1.55), (0.30, 0.48, 1.63), p.steel)
    b.box((-0.13, 0.0, 1.63), (0.13, 0.26, 2.48), p.steel)


def sink(b: Builder, p: Palette) -> None:
    """Add a basin with a tap to a counter."""
    b.box((-0.38, 0.10, 0.92), (0.38, 0.54, 0.93), p.steel, skip="-z")
    b.box((-0.32, 0.15, 0.929), (0.02, 0.49, 0.934), p.black, skip="-z", solid=False)
    b.cylinder((0.15, 0.12), 0.018, 0.92, 1.18, p.steel, sides=8)
    b.box((0.13, 0.12, 1.16), (0.17, 0.30, 1.19), p.steel)


def fridge(b: Builder, p: Palette) -> None:
    """Add a fridge-freezer with notes on its door."""
    b.box((-0.33, 0.0, 0.0), (0.33, 0.62, 1.90), p.steel, skip="-z")
    for low, high in ((0.05, 0.70), (0.72, 1.88)):
        b.box((-0.33, 0.62, low), (0.33, 0.67, high), p.porcelain, skip="-y")
        b.box((0.26, 0.67, low + 0.08), (0.285, 0.70, min(low + 0.5, high - 0.05)), p.steel, solid=False)
    for x, z, size in ((-0.18, 1.50, 0.20), (0.02, 1.34, 0.15), (-0.12, 1.16, 0.12)):
        note = p.painting(size, size)
        b.panel((x + size / 2, 0.672, z), (-size, 0, 0), (0, 0, size), note, solid=False)


def bathtub(b: Builder, p: Palette, tiles: Surface, wide: float = 1.7, deep: float = 0.75) -> None:
    """Add a bathtub with a hollow."""
    x, top = wide / 2, 0.56
    b.box((-x, 0.0, 0.0), (x, deep, top - 0.03), tiles, skip="-z +z")
    for low, high in (
        ((-x, 0.0), (x, 0.07)),
        ((-x, deep - 0.07), (x, deep)),
        ((-x, 0.07), (-x + 0.12, deep - 0.07)),
        ((x - 0.12, 0.07), (x, deep - 0.07)),
    ):
        b.box((*low, 0.18), (*high, top), p.porcelain)
    b.panel((-x + 0.12, 0.07, 0.18), (wide - 0.24, 0, 0), (0, deep - 0.14, 0), p.porcelain)
    b.cylinder((x - 0.06, deep / 2), 0.02, top, top + 0.22, p.steel, sides=8)


def toilet(b: Builder, p: Palette) -> None:
    """Add a toilet with its cistern."""
    b.soft_box((-0.19, 0.0, 0.36), (0.19, 0.18, 0.82), p.porcelain, 0.03)
    b.soft_box((-0.13, 0.04, 0.0), (0.13, 0.50, 0.34), p.porcelain, 0.05)
    b.soft_box((-0.19, 0.16, 0.32), (0.19, 0.66, 0.43), p.porcelain, 0.06)
    b.soft_box((-0.195, 0.17, 0.43), (0.195, 0.665, 0.46), p.white_wood, 0.014)


def vanity(b: Builder, p: Palette) -> None:
    """Add a washstand with basin, tap and mirror."""
    cabinet(b, 1.0, 0.48, 0.84, p.walnut, 2, p.steel)
    b.cylinder((0.0, 0.26), 0.15, 0.84, 0.96, p.porcelain, 0.21)
    b.cylinder((0.0, 0.06), 0.018, 0.84, 1.10, p.steel, sides=8)
    b.box((-0.02, 0.06, 1.07), (0.02, 0.20, 1.10), p.steel)
    b.box((-0.45, 0.0, 1.18), (0.45, 0.025, 1.92), p.walnut, skip="-y", faces={"+y": p.mirror})
    b.box((-0.40, 0.10, 0.84), (-0.30, 0.20, 1.00), p.mustard_fabric)


def washing_machine(b: Builder, p: Palette) -> None:
    """Add a washing machine."""
    b.box((-0.30, 0.0, 0.0), (0.30, 0.58, 0.85), p.porcelain, skip="-z")
    b.box((-0.30, 0.58, 0.70), (0.30, 0.59, 0.83), p.steel)
    b.box((-0.20, 0.58, 0.22), (0.20, 0.60, 0.62), p.steel)
    b.box((-0.15, 0.60, 0.27), (0.15, 0.605, 0.57), p.black, solid=False)
    b.soft_box((-0.22, 0.10, 0.85), (0.16, 0.45, 1.02), p.tartan, 0.04)


def front_door(b: Builder, p: Palette) -> None:
    """Add a closed panelled door with its frame on a wall."""
    for x0, x1, top in ((-0.57, -0.50, 2.17), (0.50, 0.57, 2.17)):
        b.box((x0, 0.0, 0.0), (x1, 0.05, top), p.white_wood, skip="-y -z")
    b.box((-0.57, 0.0, 2.10), (0.57, 0.05, 2.17), p.white_wood, skip="-y")
    b.box((-0.50, 0.0, 0.01), (0.50, 0.03, 2.10), p.teal_wood, skip="-y")
    for x in (-0.40, 0.06):
        for low, high in ((0.15, 0.85), (1.0, 1.9)):
            b.box((x, 0.03, low), (x + 0.34, 0.042, high), p.teal_wood, skip="-y")
    b.box((0.42, 0.03, 1.0), (0.46, 0.08, 1.12), p.steel, solid=False)


def coat_rack(b: Builder, p: Palette, wide: float) -> None:
    """Add a bench for shoes with coats hanging above it."""
    b.soft_box((-wide / 2, 0.0, 0.40), (wide / 2, 0.34, 0.47), p.rust_fabric, 0.03)
    b.box((-wide / 2, 0.0, 0.0), (wide / 2, 0.33, 0.06), p.oak)
    for x in (-wide / 2, wide / 2 - 0.04):
        b.box((x, 0.0, 0.06), (x + 0.04, 0.33, 0.40), p.oak)
    b.box((-wide / 2, 0.0, 1.62), (wide / 2, 0.03, 1.74), p.oak, skip="-y")
    coats = (p.green_fabric, p.blue_fabric, p.mustard_fabric, p.tartan)
    for k, coat in enumerate(coats):
        x = -wide / 2 + (k + 0.5) * wide / len(coats)
        low = 0.78 + 0.12 * (k % 3)
        b.soft_box((x - 0.13, 0.03, low), (x + 0.13, 0.17, 1.66), coat, 0.06)


def tepee(b: Builder, p: Palette) -> None:
    """Add a play tent: six cloth sides and poles that cross above."""
    b.cylinder((0.0, 0.0), 0.62, 0.0, 1.55, p.kids_quilt, 0.06, sides=6, closed=False)
    b.cylinder((0.0, 0.0), 0.06, 1.55, 1.80, p.oak, 0.16, sides=6, closed=False)


def toy_shelf(b: Builder, p: Palette, wide: float, height: float = 0.78) -> None:
    """Add a low shelf with coloured bins."""
    deep, columns, rows = 0.36, max(round(wide / 0.4), 1), 2
    b.box((-wide / 2, 0.0, 0.0), (wide / 2, 0.02, height), p.white_wood, skip="-z")
    step, rise = wide / columns, (height - 0.03) / rows
    for k in range(columns + 1):
        x = -wide / 2 + k * step
        b.box((x - 0.012, 0.02, 0.0), (x + 0.012, deep, height - 0.024), p.white_wood, skip="-z")
    for row in range(rows + 1):
        z = row * rise
        b.box((-wide / 2 - 0.012, 0.02, z), (wide / 2 + 0.012, deep, z + 0.024), p.white_wood)
    bins = (p.mustard_fabric, p.rust_fabric, p.blue_fabric, p.green_fabric, p.kids_quilt)
    for row in range(rows):
        for k in range(columns):
            x, z = -wide / 2 + k * step, row * rise + 0.024
            tall = b.dice.uniform(0.5, 0.85) * (rise - 0.024)
            b.box((x + 0.03, 0.03, z), (x + step - 0.03, deep - 0.02, z + tall), b.dice.choice(bins), skip="-z")
    b.soft_box((-wide / 4, 0.1, height), (-wide / 4 + 0.24, 0.3, height + 0.26), p.mustard_fabric, 0.08)


def beanbag(b: Builder, fabric: Surface) -> None:
    """Add a beanbag, 0.9 m wide and 0.6 m high."""
    profile = ((0.36, 0.0), (0.45, 0.12), (0.43, 0.26), (0.32, 0.42), (0.18, 0.54), (0.07, 0.60))
    for (low_radius, low), (radius, high) in pairwise(profile):
        b.cylinder((0.0, 0.0), low_radius, low, high, fabric, radius, sides=14, closed=False)
    b.disc((0.0, 0.0), 0.07, 0.60, fabric, sides=14)
