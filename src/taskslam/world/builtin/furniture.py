"""Furniture of living rooms, bedrooms and studies.

Each piece stands with the middle of its back on the origin of its frame, its front towards +y and x to its right.
Sizes are metres, heights those of common furniture; most pieces cross the height of a laser scan (0.41 m).
"""

from __future__ import annotations

from taskslam.world.builtin.builder import Builder, Surface, unit_circle
from taskslam.world.builtin.palette import Palette


def legs(b: Builder, x: float, y0: float, y1: float, top: float, surface: Surface, thick: float = 0.05) -> None:
    """Add four square legs at +-x, from y0 to y1."""
    for lx in (-x, x - thick):
        for ly in (y0, y1 - thick):
            b.box((lx, ly, 0.0), (lx + thick, ly + thick, top), surface, skip="-z +z")


def wheel(
    b: Builder, surface: Surface, x: float, y: float, z: float, radius: float, wide: float, sides: int = 12
) -> None:
    """Add a wheel with its axle along x, its middle at x, y, z."""
    circle = unit_circle(sides)
    low, high = x - wide / 2, x + wide / 2
    for k in range(sides):
        (c0, s0), (c1, s1) = ((radius * c, radius * s) for c, s in (circle[k], circle[(k + 1) % sides]))
        b.panel((high, y + c0, z + s0), (-wide, 0, 0), (0, c1 - c0, s1 - s0), surface)
    for k in range(0, sides, 2):
        rim = [(radius * c, radius * s) for c, s in (circle[k], circle[k + 1], circle[(k + 2) % sides])]
        uv = [(0.5 + c, 0.5 + s) for c, s in ((0.0, 0.0), *rim)]
        near = [(high, y + c, z + s) for c, s in ((0.0, 0.0), *rim)]
        b.quad(near, uv, surface)
        b.quad([(low, *point[1:]) for point in (near[0], *near[:0:-1])], uv, surface)


def sofa(b: Builder, p: Palette, fabric: Surface, seats: int = 3, accent: Surface | None = None) -> None:
    """Add a sofa (or, with one seat, an armchair) with loose cushions; 0.92 m deep, seat at 0.43 m."""
    seat, arm = 0.66, 0.18
    half = seats * seat / 2
    legs(b, half + arm - 0.04, 0.05, 0.87, 0.12, p.walnut)
    b.soft_box((-half, 0.05, 0.10), (half, 0.88, 0.30), fabric, 0.03)
    b.soft_box((-half, 0.0, 0.10), (half, 0.22, 0.80), fabric, 0.06)
    for side in (-1.0, 1.0):
        x0, x1 = sorted((side * half, side * (half + arm)))
        b.soft_box((x0, 0.0, 0.10), (x1, 0.90, 0.60), fabric, 0.06)
    for k in range(seats):
        x = -half + k * seat
        b.soft_box((x + 0.01, 0.20, 0.29), (x + seat - 0.01, 0.90, 0.44), fabric, 0.05)
        b.soft_box((x + 0.03, 0.20, 0.44), (x + seat - 0.03, 0.38, 0.84), fabric, 0.07)
    if accent is not None:
        b.soft_box((-half + 0.08, 0.40, 0.44), (-half + 0.50, 0.54, 0.82), accent, 0.06)
        b.soft_box((half - 0.46, 0.39, 0.44), (half - 0.06, 0.53, 0.80), p.linen, 0.06)


def low_table(b: Builder, p: Palette, wide: float, deep: float, height: float = 0.43) -> None:
    """Add a coffee table with a shelf below and things on it."""
    b.box((-wide / 2, 0.0, height - 0.04), (wide / 2, deep, height), p.walnut)
    b.box((-wide / 2 + 0.06, 0.06, 0.14), (wide / 2 - 0.06, deep - 0.06, 0.16), p.walnut)
    legs(b, wide / 2 - 0.02, 0.02, deep - 0.02, height - 0.04, p.walnut)
    b.box((-wide / 4 - 0.12, deep / 3, height), (-wide / 4 + 0.12, deep / 3 + 0.17, height + 0.04), p.rust_fabric)
    b.cylinder((wide / 4, deep / 2), 0.07, height, height + 0.16, p.terracotta, 0.05, sides=12)


def cabinet(
    b: Builder, wide: float, deep: float, height: float, body: Surface, doors: int, knob: Surface, plinth: float = 0.08
) -> None:
    """Add a closed cabinet: a plinth set back, a body, doors standing out, knobs, a top board."""
    b.box((-wide / 2 + 0.02, 0.0, 0.0), (wide / 2 - 0.02, deep - 0.05, plinth), knob, skip="-z +z")
    b.box((-wide / 2, 0.0, plinth), (wide / 2, deep - 0.02, height - 0.025), body, skip="+z")
    b.box((-wide / 2 - 0.01, 0.0, height - 0.025), (wide / 2 + 0.01, deep + 0.01, height), body)
    step = wide / doors
    for k in range(doors):
        x = -wide / 2 + k * step
        b.box((x + 0.006, deep - 0.02, plinth + 0.01), (x + step - 0.006, deep, height - 0.035), body, skip="-y")
        grip = x + (step - 0.07 if k % 2 == 0 else 0.05)
        middle = (plinth + height) / 2
        b.box((grip, deep, middle - 0.07), (grip + 0.02, deep + 0.02, middle + 0.07), knob, solid=False, skip="-y")


def drawers(b: Builder, p: Palette, wide: float, deep: float, height: float, body: Surface, count: int) -> None:
    """Add a chest of drawers."""
    b.box((-wide / 2, 0.0, 0.0), (wide / 2, deep - 0.02, height), body, skip="-z")
    step = (height - 0.08) / count
    for k in range(count):
        z = 0.05 + k * step
        b.box((-wide / 2 + 0.012, deep - 0.02, z), (wide / 2 - 0.012, deep, z + step - 0.012), body, skip="-y")
        b.box((-0.08, deep, z + step / 2), (0.08, deep + 0.02, z + step / 2 + 0.015), p.black, solid=False, skip="-y")


def bookshelf(b: Builder, p: Palette, wide: float, height: float, body: Surface, deep: float = 0.32) -> None:
    """Add an open shelf full of books and a few boxes; every row of spines is cut from another place."""
    b.box((-wide / 2, 0.0, 0.0), (-wide / 2 + 0.03, deep, height), body, skip="-z")
    b.box((wide / 2 - 0.03, 0.0, 0.0), (wide / 2, deep, height), body, skip="-z")
    b.box((-wide / 2 + 0.03, 0.0, 0.0), (wide / 2 - 0.03, 0.015, height), body, skip="-z")
    spines = p.books()
    rows = max(int((height - 0.1) / 0.34), 1)
    step = (height - 0.1) / rows
    for row in range(rows + 1):
        z = 0.06 + row * step
        b.box((-wide / 2 + 0.03, 0.015, z), (wide / 2 - 0.03, deep - 0.01, z + 0.025), body)
        if row == rows:
            break
        split = b.dice.uniform(0.35, 0.8)
        x0, x1 = -wide / 2 + 0.035, wide / 2 - 0.035
        cut = x0 + (x1 - x0) * split
        tall = min(0.27, step - 0.06)
        offset = (b.dice.uniform(), 0.0)
        set_back = b.dice.uniform(0.03, 0.09)
        front = deep - set_back
        b.panel((cut, front, z + 0.025), (x0 - cut, 0, 0), (0, 0, tall), spines, offset=offset)
        b.panel((x0, front, z + 0.025 + tall), (cut - x0, 0, 0), (0, 0.02 - front, 0), p.linen, offset=(0, 0))
        b.panel((cut, 0.02, z + 0.025), (0, front - 0.02, 0), (0, 0, tall), p.rust_fabric)
        fabric = b.dice.choice([p.mustard_fabric, p.green_fabric, p.blue_fabric, p.terracotta])
        if x1 - cut > 0.22:
            tall = b.dice.uniform(0.12, min(0.24, step - 0.06))
            b.box((cut + 0.05, 0.04, z + 0.025), (x1 - 0.03, deep - 0.05, z + 0.025 + tall), fabric, skip="-z")


def table(b: Builder, surface: Surface, wide: float, deep: float, height: float = 0.74) -> None:
    """Add a table, centred on its origin."""
    b.box((-wide / 2, -deep / 2, height - 0.035), (wide / 2, deep / 2, height), surface)
    b.box(
        (-wide / 2 + 0.08, -deep / 2 + 0.08, height - 0.11),
        (wide / 2 - 0.08, deep / 2 - 0.08, height - 0.035),
        surface,
        skip="+z",
    )
    legs(b, wide / 2 - 0.05, -deep / 2 + 0.05, deep / 2 - 0.05, height - 0.035, surface, 0.07)


def chair(b: Builder, surface: Surface, cushion: Surface) -> None:
    """Add a dining chair: 0.44 m wide, legs, slats and a seat pad at 0.46 m."""
    legs(b, 0.21, 0.0, 0.43, 0.42, surface, 0.04)
    b.box((-0.22, 0.0, 0.41), (0.22, 0.44, 0.435), surface)
    b.soft_box((-0.20, 0.05, 0.435), (0.20, 0.43, 0.475), cushion, 0.02)
    for x in (-0.21, 0.17):
        b.box((x, 0.0, 0.435), (x + 0.04, 0.04, 0.92), surface, skip="-z")
    for z in (0.58, 0.70, 0.82):
        b.box((-0.17, 0.008, z), (0.17, 0.03, z + 0.06), surface)


def office_chair(b: Builder, p: Palette, fabric: Surface) -> None:
    """Add a swivel chair on a five-spoked base."""
    b.cylinder((0.0, 0.25), 0.27, 0.05, 0.10, p.black, 0.06, sides=10)
    b.cylinder((0.0, 0.25), 0.035, 0.10, 0.42, p.steel, sides=10)
    b.soft_box((-0.25, 0.02, 0.40), (0.25, 0.50, 0.50), fabric, 0.04)
    b.soft_box((-0.23, -0.02, 0.56), (0.23, 0.06, 1.05), fabric, 0.05)
    b.box((-0.04, -0.03, 0.44), (0.04, 0.0, 0.62), p.black)


def swivel_chair_at(b: Builder, p: Palette, fabric: Surface, x: float, y: float) -> None:
    """Add a swivel chair that looks towards the back of the frame, its seat's middle at x, y + 0.25 m."""
    b.cylinder((x, y + 0.25), 0.27, 0.05, 0.10, p.black, 0.06, sides=10)
    b.cylinder((x, y + 0.25), 0.035, 0.10, 0.42, p.steel, sides=10)
    b.soft_box((x - 0.25, y, 0.40), (x + 0.25, y + 0.48, 0.50), fabric, 0.04)
    b.soft_box((x - 0.23, y + 0.44, 0.56), (x + 0.23, y + 0.52, 1.05), fabric, 0.05)
    b.box((x - 0.04, y + 0.50, 0.44), (x + 0.04, y + 0.53, 0.62), p.black)


def bed(b: Builder, p: Palette, wide: float, frame: Surface, quilt: Surface, pillows: int) -> None:
    """Add a bed 2.08 m long with its headboard at the back."""
    b.box((-wide / 2 - 0.04, 0.0, 0.0), (wide / 2 + 0.04, 0.06, 1.05), frame, skip="-z")
    b.box((-wide / 2 - 0.03, 0.06, 0.06), (wide / 2 + 0.03, 2.08, 0.32), frame)
    b.soft_box((-wide / 2, 0.06, 0.30), (wide / 2, 2.05, 0.52), p.linen, 0.05)
    b.soft_box((-wide / 2 - 0.05, 0.62, 0.24), (wide / 2 + 0.05, 2.09, 0.56), quilt, 0.05)
    step = wide / pillows
    for k in range(pillows):
        x = -wide / 2 + k * step
        b.soft_box((x + 0.06, 0.10, 0.51), (x + step - 0.06, 0.52, 0.65), p.linen, 0.06)


def lamp(b: Builder, p: Palette, height: float = 1.6, base: float = 0.0) -> None:
    """Add a lamp on a stem; `base` is the height of what it stands on."""
    scale = 1.0 if height > 1.0 else 0.6
    b.cylinder((0.0, 0.0), 0.16 * scale, base, base + 0.03, p.black)
    b.cylinder((0.0, 0.0), 0.02, base + 0.03, base + height - 0.25 * scale, p.steel, sides=8)
    top = base + height
    b.cylinder((0.0, 0.0), 0.22 * scale, top - 0.30 * scale, top, p.shade, 0.15 * scale, closed=False)


def plant(b: Builder, p: Palette, height: float, pot: float = 0.2, base: float = 0.0) -> None:
    """Add a pot with long leaves fanning out; the leaves are seen by the laser but give way to the robot."""
    rim = base + pot * 1.7
    b.cylinder((0.0, 0.0), pot * 0.72, base, rim, p.terracotta, pot, closed=False)
    b.disc((0.0, 0.0), pot * 0.97, rim - 0.03, p.soil)
    reach = height - (rim - base)
    for _ in range(34):
        x, y = b.dice.uniform(-1.0, 1.0), b.dice.uniform(-1.0, 1.0)
        length = (x * x + y * y) ** 0.5
        if length < 0.2:
            continue
        x, y = x / length, y / length
        up = b.dice.uniform(0.35, 1.0) * reach
        out = b.dice.uniform(0.5, 1.1) * pot * 1.5
        wide = b.dice.uniform(0.025, 0.055)
        bend = (x * out * 0.55, y * out * 0.55, rim + up * 0.75)
        tip = (x * out, y * out, rim + up * b.dice.uniform(0.75, 1.0))
        foot = (x * 0.03, y * 0.03, rim - 0.03)
        left = (bend[0] - y * wide, bend[1] + x * wide, bend[2])
        right = (bend[0] + y * wide, bend[1] - x * wide, bend[2])
        du, dv = b.dice.uniform(), b.dice.uniform()
        uv = [(du, dv), (du + 0.2, dv + 0.6), (du + 0.1, dv + 1.0), (du, dv + 0.6)]
        b.quad([foot, right, tip, left], uv, p.leaf, solid=False)
        # the underside lies 2 mm outwards, so that a ray meets the side that faces it
        under = [(px + 0.002 * x, py + 0.002 * y, pz) for px, py, pz in (foot, left, tip, right)]
        b.quad(under, uv, p.leaf, solid=False)


def picture(b: Builder, p: Palette, wide: float, tall: float, frame: Surface, height: float = 1.5) -> None:
    """Add a framed picture on a wall, its middle at `height`."""
    low, high = height - tall / 2, height + tall / 2
    edge = 0.035
    b.box((-wide / 2 - edge, 0.0, low - edge), (wide / 2 + edge, 0.02, high + edge), frame, skip="-y")
    b.panel((wide / 2, 0.0205, low), (-wide, 0, 0), (0, 0, tall), p.painting(wide, tall), solid=False)


def rug(b: Builder, p: Palette, wide: float, deep: float) -> None:
    """Add a rug, 8 mm thick, centred on its origin; low enough to be driven over."""
    pile = p.rug(wide, deep)
    b.box((-wide / 2, -deep / 2, 0.0), (wide / 2, deep / 2, 0.008), p.linen, faces={"+z": pile}, skip="-z", solid=False)


def curtain(b: Builder, p: Palette, wide: float, height: float = 2.3) -> None:
    """Add one gathered curtain hanging to just above the floor."""
    folds = max(int(wide / 0.07), 2)
    step = wide / folds
    for k in range(folds):
        x = -wide / 2 + k * step
        near, far = (0.05, 0.10) if k % 2 == 0 else (0.10, 0.05)
        b.panel((x + step, far, 0.04), (-step, near - far, 0), (0, 0, height - 0.04), p.curtain)
    b.box((-wide / 2 - 0.05, 0.06, height), (wide / 2 + 0.05, 0.085, height + 0.025), p.black, solid=False)
