"""Furniture of a hospital: beds, drapes, trolleys, counters, seats. Frames as in `furniture`."""

from __future__ import annotations

from taskslam.world.builtin import furniture
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.palettes import HospitalPalette


def hospital_bed(b: Builder, p: HospitalPalette, quilt: Surface) -> None:
    """Add a bed on castors, 0.96 m wide and 2.1 m long, its head at the back; the base crosses the laser's height."""
    for x in (-0.38, 0.38):
        for y in (0.22, 1.88):
            furniture.wheel(b, p.black, x, y, 0.08, 0.08, 0.05)
            b.box((x - 0.03, y - 0.03, 0.14), (x + 0.03, y + 0.03, 0.30), p.steel)
    b.box((-0.42, 0.14, 0.28), (0.42, 1.96, 0.46), p.porcelain)
    b.soft_box((-0.45, 0.06, 0.46), (0.45, 2.04, 0.62), p.linen, 0.04)
    b.soft_box((-0.47, 0.70, 0.42), (0.47, 2.06, 0.66), quilt, 0.04)
    b.soft_box((-0.34, 0.10, 0.60), (0.34, 0.50, 0.74), p.linen, 0.05)
    b.soft_box((-0.47, 0.0, 0.30), (0.47, 0.05, 1.0), p.oak, 0.02)
    b.soft_box((-0.47, 2.06, 0.30), (0.47, 2.11, 0.86), p.oak, 0.02)
    for x in (-0.50, 0.48):
        for z in (0.68, 0.78, 0.88):
            b.box((x, 0.35, z), (x + 0.02, 1.05, z + 0.025), p.steel)
        for y in (0.36, 1.02):
            b.box((x, y, 0.46), (x + 0.02, y + 0.025, 0.88), p.steel)


def bed_place(b: Builder, p: HospitalPalette, quilt: Surface, number: str) -> None:
    """Add a bed with its wall panel, number, locker, drip stand and monitor."""
    b.box((-1.05, 0.0, 1.30), (1.05, 0.06, 1.52), p.porcelain, skip="-y")
    b.box((-0.9, 0.0, 1.60), (0.2, 0.08, 1.66), p.light_panel, skip="-y", solid=False)
    b.panel((0.86, 0.012, 1.75), (-0.3, 0, 0), (0, 0, 0.3), p.sign(number, (240, 242, 240), (30, 90, 120)), solid=False)
    hospital_bed(b, p, quilt)
    x = 0.92
    b.box((x - 0.24, 0.04, 0.08), (x + 0.24, 0.48, 0.82), p.white_wood)
    for z in (0.12, 0.38, 0.62):
        b.box((x - 0.22, 0.48, z), (x + 0.22, 0.50, z + 0.18), p.teal_wood, skip="-y")
    b.cylinder((x - 0.05, 0.3), 0.04, 0.82, 0.98, p.vinyl, sides=10)
    if b.dice.uniform() < 0.7:
        drip_stand(b, p, -0.72, 0.35)
    else:
        b.box((-0.95, 0.05, 1.05), (-0.55, 0.2, 1.28), p.porcelain, faces={"+y": p.screen})
        b.box((-0.80, 0.05, 0.0), (-0.70, 0.15, 1.05), p.steel)
        b.box((-0.98, 0.02, 0.0), (-0.52, 0.42, 0.05), p.black)


def drip_stand(b: Builder, p: HospitalPalette, x: float, y: float) -> None:
    """Add a pole on a cross-shaped foot with a bag."""
    b.box((x - 0.24, y - 0.02, 0.03), (x + 0.24, y + 0.02, 0.07), p.steel)
    b.box((x - 0.02, y - 0.24, 0.03), (x + 0.02, y + 0.24, 0.07), p.steel)
    b.cylinder((x, y), 0.016, 0.07, 1.85, p.steel, sides=8)
    b.box((x - 0.12, y - 0.01, 1.82), (x + 0.12, y + 0.01, 1.85), p.steel)
    b.soft_box((x + 0.06, y - 0.02, 1.52), (x + 0.18, y + 0.02, 1.80), p.blanket, 0.015)


def drape(b: Builder, p: HospitalPalette, length: float, drawn: float) -> None:
    """Add a rail from the back to `length`, its cloth gathered over the first `drawn` metres; seen from both sides."""
    b.box((-0.02, 0.0, 2.28), (0.02, length, 2.31), p.steel, solid=False)
    folds = max(int(drawn / 0.08), 2)
    step = drawn / folds
    for k in range(folds):
        y0, y1 = 0.03 + k * step, 0.03 + (k + 1) * step
        near, far = (-0.035, 0.035) if k % 2 == 0 else (0.035, -0.035)
        across, up = (far - near, y1 - y0, 0.0), (0.0, 0.0, 2.2)
        b.panel((near + 0.004, y0, 0.06), across, up, p.drape)
        b.panel((far - 0.004, y1, 0.06), (-across[0], -across[1], 0.0), up, p.drape)


def waiting_seats(b: Builder, p: HospitalPalette, seats: int, fabric: Surface) -> None:
    """Add a row of linked seats, 0.58 m each, upholstered to near the floor beam."""
    half = seats * 0.58 / 2
    b.box((-half + 0.05, 0.26, 0.30), (half - 0.05, 0.34, 0.38), p.steel)
    for k in range(seats + 1):
        x = -half + k * 0.58
        if k in (0, seats) or k % 2 == 0:
            b.box((x - 0.03, 0.05, 0.0), (x + 0.03, 0.55, 0.05), p.black)
            b.box((x - 0.025, 0.27, 0.05), (x + 0.025, 0.33, 0.62), p.steel)
        b.box((x - 0.03, 0.08, 0.60), (x + 0.03, 0.50, 0.64), p.walnut)
    for k in range(seats):
        x = -half + k * 0.58
        b.soft_box((x + 0.04, 0.06, 0.37), (x + 0.54, 0.56, 0.47), fabric, 0.03)
        b.soft_box((x + 0.04, 0.0, 0.50), (x + 0.54, 0.08, 0.92), fabric, 0.03)


def desk_counter(b: Builder, p: HospitalPalette, wide: float, front: Surface, screens: int) -> None:
    """Add a counter with its public side at the back: a high ledge, a desk behind it, monitors and paper."""
    b.box((-wide / 2, 0.0, 0.0), (wide / 2, 0.08, 1.10), front, skip="-z")
    b.box((-wide / 2 - 0.03, -0.06, 1.10), (wide / 2 + 0.03, 0.30, 1.14), p.granite)
    b.box((-wide / 2, 0.08, 0.72), (wide / 2, 0.80, 0.76), p.white_wood)
    for x in (-wide / 2, -0.02, wide / 2 - 0.04):
        b.box((x, 0.08, 0.0), (x + 0.04, 0.76, 0.72), p.white_wood)
    for k in range(screens):
        x = -wide / 2 + (k + 0.5) * wide / screens
        b.box((x - 0.26, 0.28, 0.90), (x + 0.26, 0.31, 1.22), p.black, faces={"+y": p.screen})
        b.box((x - 0.04, 0.26, 0.76), (x + 0.04, 0.30, 0.95), p.black)
        b.box((x - 0.2, 0.48, 0.76), (x + 0.2, 0.62, 0.78), p.black)
        b.box((x + 0.28, 0.4, 0.76), (x + 0.5, 0.7, 0.76 + b.dice.uniform(0.01, 0.06)), p.linen)


def trolley(b: Builder, p: HospitalPalette, body: Surface) -> None:
    """Add a treatment trolley with drawers and things on it."""
    for x in (-0.26, 0.26):
        for y in (0.08, 0.42):
            furniture.wheel(b, p.black, x, y, 0.05, 0.05, 0.03)
    b.box((-0.32, 0.0, 0.10), (0.32, 0.5, 0.92), body)
    for k in range(4):
        z = 0.14 + k * 0.19
        b.box((-0.30, 0.5, z), (0.30, 0.515, z + 0.17), p.porcelain, skip="-y")
        b.box((-0.1, 0.515, z + 0.12), (0.1, 0.53, z + 0.14), p.steel, skip="-y", solid=False)
    for x, y, radius, tall in ((-0.2, 0.15, 0.05, 0.16), (-0.06, 0.2, 0.04, 0.2), (0.15, 0.28, 0.08, 0.1)):
        b.cylinder((x, y), radius, 0.92, 0.92 + tall, b.dice.choice([p.vinyl, p.linen, p.scrub_green]), sides=10)


def linen_cart(b: Builder, p: HospitalPalette) -> None:
    """Add a cage on wheels full of folded linen."""
    b.box((-0.45, 0.0, 0.10), (0.45, 0.6, 0.14), p.steel)
    for x in (-0.45, 0.42):
        for y in (0.0, 0.57):
            b.box((x, y, 0.0), (x + 0.03, y + 0.03, 1.6), p.steel, skip="-z")
    for z in (0.14, 0.6, 1.05):
        b.box((-0.45, 0.0, z - 0.02), (0.45, 0.6, z), p.steel)
        for k in range(4):
            x, tall = -0.40 + k * 0.2, b.dice.uniform(0.16, 0.36)
            cloth = b.dice.choice([p.linen, p.blanket, p.scrub_green])
            b.soft_box((x + 0.01, 0.05, z), (x + 0.19, 0.57, z + tall), cloth, 0.02)


def stretcher(b: Builder, p: HospitalPalette) -> None:
    """Add a patient trolley, 0.7 m wide and 2.0 m long."""
    for x in (-0.28, 0.28):
        for y in (0.25, 1.75):
            furniture.wheel(b, p.black, x, y, 0.10, 0.10, 0.04)
    b.box((-0.28, 0.2, 0.18), (0.28, 1.8, 0.34), p.steel)
    for y in (0.5, 1.45):
        b.box((-0.08, y, 0.34), (0.08, y + 0.12, 0.78), p.porcelain)
    b.soft_box((-0.35, 0.0, 0.78), (0.35, 2.0, 0.90), p.vinyl, 0.03)
    b.soft_box((-0.26, 0.05, 0.89), (0.26, 0.4, 0.99), p.linen, 0.04)


def wheelchair(b: Builder, p: HospitalPalette) -> None:
    """Add a wheelchair."""
    for x in (-0.29, 0.29):
        furniture.wheel(b, p.black, x, 0.25, 0.29, 0.29, 0.03)
        furniture.wheel(b, p.steel, x, 0.25, 0.29, 0.22, 0.034)
        furniture.wheel(b, p.black, x * 0.85, 0.68, 0.08, 0.08, 0.03)
        b.box((x - 0.02, 0.1, 0.68), (x + 0.02, 0.55, 0.72), p.black)
        b.box((x * 0.93 - 0.015, 0.08, 0.3), (x * 0.93 + 0.015, 0.11, 0.98), p.steel)
    b.box((-0.25, 0.1, 0.44), (0.25, 0.56, 0.49), p.vinyl)
    b.box((-0.25, 0.08, 0.49), (0.25, 0.11, 0.90), p.vinyl)
    b.box((-0.2, 0.74, 0.10), (0.2, 0.88, 0.13), p.black)


def operating_table(b: Builder, p: HospitalPalette) -> None:
    """Add a table on a column, centred, with a lamp above it."""
    b.box((-0.3, -0.5, 0.02), (0.3, 0.5, 0.16), p.steel)
    b.box((-0.16, -0.22, 0.16), (0.16, 0.22, 0.80), p.steel)
    b.soft_box((-0.28, -1.0, 0.80), (0.28, 1.0, 0.92), p.black, 0.03)
    b.soft_box((-0.36, -0.7, 0.88), (0.36, 0.5, 0.97), p.scrub_green, 0.03)
    b.cylinder((0.0, 0.3), 0.05, 2.3, 2.8, p.steel, sides=10)
    b.cylinder((0.0, 0.3), 0.38, 2.18, 2.30, p.porcelain, 0.2, sides=16, closed=False)
    b.disc((0.0, 0.3), 0.37, 2.185, p.light_panel, sides=16, up=False, solid=False)
