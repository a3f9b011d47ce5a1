"""Furniture of offices, in any building: desks, boards, signs, cabinets, machines. Frames as in `furniture`."""

from __future__ import annotations

from taskslam.world.builtin import furniture
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.palette import Palette


def desk(
    b: Builder, p: Palette, wood: Surface, wide: float = 1.6, screens: int = 1, fabric: Surface | None = None
) -> None:
    """Add a desk with its sitting side at the front, drawers, screens and, if `fabric` is given, a swivel chair."""
    half = wide / 2
    b.box((-half, 0.0, 0.70), (half, 0.80, 0.74), wood)
    b.box((-half + 0.05, 0.06, 0.25), (half - 0.05, 0.08, 0.70), wood)
    furniture.legs(b, half - 0.02, 0.04, 0.76, 0.70, p.steel)
    b.box((half - 0.50, 0.14, 0.06), (half - 0.08, 0.70, 0.62), p.white_wood)
    for k in range(3):
        z = 0.08 + k * 0.18
        b.box((half - 0.48, 0.70, z), (half - 0.10, 0.715, z + 0.16), p.white_wood, skip="-y")
    for k in range(screens):
        x = -half + (k + 0.5) * wide / screens - 0.06 + b.dice.uniform(-0.06, 0.06)
        b.box((x - 0.27, 0.16, 0.88), (x + 0.27, 0.19, 1.22), p.black, faces={"+y": p.screen})
        b.box((x - 0.04, 0.13, 0.74), (x + 0.04, 0.16, 1.0), p.black)
        b.box((x - 0.10, 0.10, 0.74), (x + 0.10, 0.26, 0.752), p.black)
    b.box((-0.22, 0.46, 0.74), (0.2, 0.60, 0.76), p.black)
    b.box((-half + 0.08, 0.3, 0.74), (-half + 0.32, 0.62, 0.75 + b.dice.uniform(0.01, 0.12)), p.linen)
    b.cylinder((half - 0.18, 0.32), 0.04, 0.74, 0.84, b.dice.choice([p.terracotta, p.porcelain, p.black]), sides=10)
    if fabric is not None:
        shift = b.dice.uniform(-0.12, 0.12)
        furniture.swivel_chair_at(b, p, fabric, shift, 0.78)


def board(b: Builder, p: Palette, wide: float, tall: float, surface: Surface, height: float = 1.55) -> None:
    """Add a framed board on a wall, its middle at `height`."""
    low, high = height - tall / 2, height + tall / 2
    b.box((-wide / 2 - 0.03, 0.0, low - 0.03), (wide / 2 + 0.03, 0.025, high + 0.03), p.steel, skip="-y")
    b.panel((wide / 2, 0.0255, low), (-wide, 0, 0), (0, 0, tall), surface, solid=False)


def plate(b: Builder, surface: Surface, wide: float, height: float = 1.6) -> None:
    """Add a small sign on a wall, its middle at `height`; three quarters as high as wide per character."""
    tall = 0.16
    b.panel((wide / 2, 0.012, height - tall / 2), (-wide, 0, 0), (0, 0, tall), surface, solid=False)


def hanging_sign(b: Builder, p: Palette, surface: Surface, wide: float, ceiling: float) -> None:
    """Add a sign below the ceiling, centred, read from the front and from the back."""
    low = ceiling - 0.55
    b.box(
        (-wide / 2, -0.02, low),
        (wide / 2, 0.02, low + 0.28),
        p.steel,
        faces={"-y": surface, "+y": surface},
        solid=False,
    )
    for x in (-wide / 2 + 0.1, wide / 2 - 0.12):
        b.box((x, -0.008, low + 0.28), (x + 0.016, 0.008, ceiling), p.steel, solid=False)


def file_shelf(b: Builder, p: Palette, body: Surface, files: Surface, wide: float, rows: int = 5) -> None:
    """Add an open shelf of lever-arch files, 0.38 m deep."""
    step = 0.38
    top = rows * step + 0.06
    for x in (-wide / 2, wide / 2 - 0.025):
        b.box((x, 0.0, 0.0), (x + 0.025, 0.38, top), body, skip="-z")
    b.box((-wide / 2, 0.0, 0.0), (wide / 2, 0.015, top), body, skip="-z")
    for row in range(rows + 1):
        z = 0.03 + row * step
        b.box((-wide / 2 + 0.025, 0.015, z), (wide / 2 - 0.025, 0.37, z + 0.025), body)
        if row < rows:
            front, share = b.dice.uniform(0.28, 0.35), b.dice.uniform(0.55, 1.0)
            x0 = -wide / 2 + 0.03
            x1 = x0 + (wide - 0.06) * share
            low, offset = z + 0.025, (b.dice.uniform(), 0.0)
            b.panel((x1, front, low), (x0 - x1, 0, 0), (0, 0, 0.3), files, offset=offset)
            b.panel((x1, 0.02, low), (0, front - 0.02, 0), (0, 0, 0.3), p.blue_fabric)
            b.panel((x0, front, low + 0.3), (x1 - x0, 0, 0), (0, 0.02 - front, 0), p.black)


def lockers(b: Builder, p: Palette, doors: int, body: Surface) -> None:
    """Add a row of tall lockers, 0.4 m wide each."""
    half = doors * 0.2
    b.box((-half, 0.0, 0.0), (half, 0.48, 1.9), p.steel, skip="-z")
    for k in range(doors):
        x = -half + k * 0.4
        for low, high in ((0.06, 0.95), (0.97, 1.86)):
            b.box((x + 0.01, 0.48, low), (x + 0.39, 0.50, high), body, skip="-y")
            for vent in range(3):
                z = high - 0.12 - vent * 0.05
                b.box((x + 0.10, 0.50, z), (x + 0.30, 0.504, z + 0.015), p.black, skip="-y", solid=False)
            b.box((x + 0.32, 0.50, low + 0.4), (x + 0.35, 0.52, low + 0.52), p.black, skip="-y", solid=False)


def vending_machine(b: Builder, p: Palette, body: Surface) -> None:
    """Add a vending machine with rows of goods behind its pane."""
    b.box((-0.48, 0.0, 0.04), (0.48, 0.78, 1.85), body, skip="-z")
    b.box((-0.44, 0.78, 0.0), (0.44, 0.785, 0.04), p.black, skip="-z")
    b.box((-0.42, 0.78, 0.55), (0.18, 0.79, 1.75), p.black, skip="-y")
    goods = (p.rust_fabric, p.mustard_fabric, p.blue_fabric, p.green_fabric, p.linen, p.terracotta)
    for row in range(5):
        for k in range(5):
            x, z = -0.38 + k * 0.11, 0.62 + row * 0.22
            b.box((x, 0.79, z), (x + 0.08, 0.80, z + 0.15), b.dice.choice(goods), skip="-y", solid=False)
    b.box((0.24, 0.78, 1.0), (0.42, 0.80, 1.5), p.steel, skip="-y")
    b.box((-0.3, 0.78, 0.2), (0.06, 0.80, 0.4), p.black, skip="-y")


def copier(b: Builder, p: Palette) -> None:
    """Add a floor-standing copier."""
    b.box((-0.32, 0.05, 0.0), (0.32, 0.68, 0.95), p.porcelain, skip="-z")
    for k in range(3):
        z = 0.08 + k * 0.2
        b.box((-0.30, 0.68, z), (0.30, 0.70, z + 0.18), p.steel, skip="-y")
    b.soft_box((-0.33, 0.04, 0.95), (0.33, 0.66, 1.12), p.black, 0.03)
    b.box((0.33, 0.2, 0.6), (0.62, 0.6, 0.63), p.porcelain)
    b.box((0.1, 0.6, 1.12), (0.32, 0.72, 1.15), p.black, faces={"+z": p.screen})


def extinguisher(b: Builder, p: Palette, red: Surface) -> None:
    """Add a fire extinguisher on a wall, its foot 0.2 m above the floor."""
    b.cylinder((0.0, 0.10), 0.08, 0.20, 0.66, red, sides=12)
    b.cylinder((0.0, 0.10), 0.03, 0.66, 0.76, p.black, sides=8)


def lift_doors(b: Builder, p: Palette) -> None:
    """Add the closed doors of a lift on a wall, with call button and display."""
    b.box((-0.75, 0.0, 0.0), (0.75, 0.04, 2.3), p.granite, skip="-y -z")
    for x0, x1 in ((-0.6, -0.006), (0.006, 0.6)):
        b.box((x0, 0.04, 0.01), (x1, 0.05, 2.12), p.steel, skip="-y -z")
    b.box((-0.16, 0.04, 2.15), (0.16, 0.06, 2.26), p.black, skip="-y")
    b.box((0.85, 0.0, 1.0), (0.95, 0.02, 1.2), p.steel, skip="-y")
