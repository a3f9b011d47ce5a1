"""Rooms with walls, doors, windows, skirting and ceilings, from rectangles and a list of openings."""

from __future__ import annotations

from dataclasses import dataclass, field

from taskslam.world.builtin.builder import Builder, Point, Surface

CEILING = 2.5
OUTER_WALL = 0.25
_LINING = 0.03  # boards around an opening; they narrow it by this on each side
_CASING = 0.07  # width of the frame on the wall
_DADO = 1.0  # height of the lower lining of a wall
_RELIEF = 0.015  # how far skirting and frames stand out


@dataclass(frozen=True)
class Opening:
    """A hole in the wall whose middle plane is at `at` on the x (`wall="x"`) or y axis, from `start` to `end` along it.

    bottom, top: heights in metres; a door starts at 0. view: what is seen through a window; None for a passage.
    leaf: of a closed door, which stands in the middle of the wall, so that both sides have a niche.
    """

    wall: str
    at: float
    start: float
    end: float
    bottom: float = 0.0
    top: float = 2.1
    view: Surface | None = None
    leaf: Surface | None = None


@dataclass(frozen=True)
class Room:
    """A rectangle of floor with its finishes; `accent` gives single sides (`+x`, `-x`, `+y`, `-y`) another wall.

    dado: a lining of the lower wall, up to 1 m; rail: a handrail along the walls.
    """

    name: str
    low: tuple[float, float]
    high: tuple[float, float]
    floor: Surface
    wall: Surface
    accent: dict[str, Surface] = field(default_factory=dict)
    dado: Surface | None = None
    rail: Surface | None = None


def room_between(
    low: tuple[float, float],
    high: tuple[float, float],
    outer: tuple[tuple[float, float], tuple[float, float]],
    wall: float,
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the floor between the middle planes of walls, `wall` m thick, except at the inside of the outer walls."""

    def inset(value: float, edge: float, by: float) -> float:
        return value if value == edge else value + by

    (x0, y0), (x1, y1) = low, high
    (left, bottom), (right, top) = outer
    half = wall / 2
    return (
        (inset(x0, left, half), inset(y0, bottom, half)),
        (inset(x1, right, -half), inset(y1, top, -half)),
    )


@dataclass(frozen=True)
class Trim:
    """Surfaces shared by all rooms, and their height."""

    ceiling: Surface
    skirting: Surface
    frame: Surface
    sill: Surface
    height: float = CEILING


@dataclass(frozen=True)
class _Side:
    """One wall of a room: where it starts, the unit direction along it, and the normal into the room."""

    name: str
    axis: str
    start: tuple[float, float]
    along: tuple[float, float]
    inward: tuple[float, float]
    length: float

    def point(self, s: float, z: float, out: float = 0.0) -> Point:
        """Point at `s` metres along the wall, height z, `out` metres into the room."""
        return (
            self.start[0] + s * self.along[0] + out * self.inward[0],
            self.start[1] + s * self.along[1] + out * self.inward[1],
            z,
        )

    def span(self, opening: Opening) -> tuple[float, float] | None:
        """Where an opening lies along this wall, or None if it is in another wall."""
        across = 0 if self.axis == "x" else 1
        near = abs(opening.at - self.start[across]) < OUTER_WALL
        if opening.wall != self.axis or not near:
            return None
        origin, sign = self.start[1 - across], self.along[1 - across]
        ends = sorted(((opening.start - origin) * sign, (opening.end - origin) * sign))
        return (ends[0], ends[1]) if ends[0] >= 0 and ends[1] <= self.length else None


def sides_of(low: tuple[float, float], high: tuple[float, float]) -> list[_Side]:
    """Walls of a room, each running so that the room is on its left."""
    (x0, y0), (x1, y1) = low, high
    return [
        _Side("-y", "y", (x0, y0), (1, 0), (0, 1), x1 - x0),
        _Side("+x", "x", (x1, y0), (0, 1), (-1, 0), y1 - y0),
        _Side("+y", "y", (x1, y1), (-1, 0), (0, -1), x1 - x0),
        _Side("-x", "x", (x0, y1), (0, -1), (1, 0), y1 - y0),
    ]


def build_room(b: Builder, room: Room, openings: list[Opening], trim: Trim) -> None:
    """Add a room's floor, ceiling, walls with holes, skirting and frames."""
    (x0, y0), (x1, y1) = room.low, room.high
    with b.model(f"{room.name} shell"):
        b.panel((x0, y0, 0), (x1 - x0, 0, 0), (0, y1 - y0, 0), room.floor)
        b.panel((x0, y1, trim.height), (x1 - x0, 0, 0), (0, y0 - y1, 0), trim.ceiling)
        for side in sides_of(room.low, room.high):
            found = [(span, o) for o in openings if (span := side.span(o)) is not None]
            holes = sorted(found, key=lambda item: item[0])
            _wall(b, side, holes, room.accent.get(side.name, room.wall), trim.height)
            _band(b, side, [span for span, o in holes if o.bottom == 0], (0.0, 0.09), (0.0, _RELIEF), trim.skirting)
            doors = [span for span, o in holes if o.bottom < _DADO]
            if room.dado is not None:
                _band(b, side, doors, (0.09, _DADO), (0.0, _RELIEF / 2), room.dado)
            if room.rail is not None:
                _band(b, side, doors, (0.82, 0.95), (0.03, 0.07), room.rail)
            for span, opening in holes:
                _casing(b, side, span, opening, trim.frame)


def _wall(
    b: Builder, side: _Side, holes: list[tuple[tuple[float, float], Opening]], surface: Surface, top: float
) -> None:
    """Cover a side around its holes; one texture offset, so that the pattern runs on."""
    extent = surface.extent or (1.0, 1.0)
    du, dv = b.dice.uniform(), b.dice.uniform()

    def patch(s0: float, s1: float, z0: float, z1: float) -> None:
        if s1 - s0 < 1e-6 or z1 - z0 < 1e-6:
            return
        # seen from the room the wall's u axis runs to the right: against `along` of a room on the left
        end = side.point(s1, z0)
        u = (-(s1 - s0) * side.along[0], -(s1 - s0) * side.along[1], 0.0)
        offset = (du - s1 / extent[0], dv + z0 / extent[1])
        b.panel(end, u, (0, 0, z1 - z0), surface, offset=offset)

    at = 0.0
    for (s0, s1), opening in holes:
        patch(at, s0, 0.0, top)
        patch(s0, s1, 0.0, opening.bottom)
        patch(s0, s1, opening.top, top)
        at = s1
    patch(at, side.length, 0.0, top)


def _bar(
    b: Builder, side: _Side, s: tuple[float, float], z: tuple[float, float], out: tuple[float, float], surface: Surface
) -> None:
    """Add a box given in wall coordinates: along, up, into the room."""
    p, q = side.point(s[0], z[0], out[0]), side.point(s[1], z[1], out[1])
    low = (min(p[0], q[0]), min(p[1], q[1]), z[0])
    high = (max(p[0], q[0]), max(p[1], q[1]), z[1])
    b.box(low, high, surface)


def _band(
    b: Builder,
    side: _Side,
    doors: list[tuple[float, float]],
    z: tuple[float, float],
    out: tuple[float, float],
    surface: Surface,
) -> None:
    """Run a strip along a wall between its doors."""
    at = 0.0
    for start, end in [*doors, (side.length + _CASING, 0.0)]:
        if start - _CASING - at > 0.02:
            _bar(b, side, (at, start - _CASING), z, out, surface)
        at = end + _CASING


def _casing(b: Builder, side: _Side, span: tuple[float, float], opening: Opening, surface: Surface) -> None:
    (s0, s1), z0, z1 = span, opening.bottom, opening.top
    out = (0.0, _RELIEF + 0.003)
    low = z0 - _CASING if z0 > 0 else 0.0
    _bar(b, side, (s0 - _CASING, s0), (low, z1 + _CASING), out, surface)
    _bar(b, side, (s1, s1 + _CASING), (low, z1 + _CASING), out, surface)
    _bar(b, side, (s0, s1), (z1, z1 + _CASING), out, surface)


def build_openings(b: Builder, openings: list[Opening], floor: Surface, trim: Trim, inner_wall: float) -> None:
    """Line every hole through the thickness of its wall; windows get bars, a sill and a view."""
    for number, opening in enumerate(openings):
        kind = "doorway" if opening.view is None else "window"
        depth = inner_wall if opening.view is None else OUTER_WALL
        with b.model(f"{kind} {number}"):
            _line(b, opening, depth / 2, trim.frame)
            if opening.view is None:
                _threshold(b, opening, depth / 2, floor)
                if opening.leaf is not None:
                    _leaf(b, opening, opening.leaf, trim.sill)
            else:
                _window(b, opening, depth / 2, trim)


def _box_in(
    b: Builder,
    o: Opening,
    s: tuple[float, float],
    across: tuple[float, float],
    z: tuple[float, float],
    surface: Surface,
    solid: bool = True,
) -> None:
    """Add a box given along the wall, across it (from its middle plane) and up."""
    if o.wall == "x":
        low, high = (o.at + across[0], s[0], z[0]), (o.at + across[1], s[1], z[1])
    else:
        low, high = (s[0], o.at + across[0], z[0]), (s[1], o.at + across[1], z[1])
    b.box(low, high, surface, solid=solid)


def _line(b: Builder, o: Opening, half: float, surface: Surface) -> None:
    reach = (-half - 0.001, half + 0.001)
    for s in ((o.start, o.start + _LINING), (o.end - _LINING, o.end)):
        _box_in(b, o, s, reach, (o.bottom, o.top), surface)
    _box_in(b, o, (o.start + _LINING, o.end - _LINING), reach, (o.top - _LINING, o.top), surface)


def _threshold(b: Builder, o: Opening, half: float, floor: Surface) -> None:
    _box_in(b, o, (o.start + _LINING, o.end - _LINING), (-half - 0.01, half + 0.01), (-0.02, 0.004), floor)


def _leaf(b: Builder, o: Opening, surface: Surface, handle: Surface) -> None:
    """Add a closed door, 5 cm thick, with a handle on both sides."""
    _box_in(b, o, (o.start + _LINING, o.end - _LINING), (-0.025, 0.025), (0.004, o.top - _LINING), surface)
    grip = (o.end - _LINING - 0.20, o.end - _LINING - 0.07)
    _box_in(b, o, grip, (-0.065, 0.065), (1.02, 1.05), handle, solid=False)


def _window(b: Builder, o: Opening, half: float, trim: Trim) -> None:
    assert o.view is not None
    outward = 1.0 if o.at > 0 else -1.0
    pane = outward * half * 0.7
    inside = (o.start + _LINING, o.end - _LINING)
    middle = (inside[0] + inside[1]) / 2
    depth = (min(pane, pane - outward * 0.05), max(pane, pane - outward * 0.05))
    for s in ((inside[0], inside[0] + 0.05), (inside[1] - 0.05, inside[1]), (middle - 0.03, middle + 0.03)):
        _box_in(b, o, s, depth, (o.bottom, o.top - _LINING), trim.frame)
    for z in ((o.bottom, o.bottom + 0.06), (o.top - _LINING - 0.06, o.top - _LINING)):
        _box_in(b, o, inside, depth, z, trim.frame)
    inner = -outward * (half + 0.09)
    edge = (min(inner, pane), max(inner, pane))
    _box_in(b, o, (o.start - 0.05, o.end + 0.05), edge, (o.bottom - 0.035, o.bottom), trim.sill)
    _view(b, o, pane, outward)


def _view(b: Builder, o: Opening, pane: float, outward: float) -> None:
    """Add the picture outside, facing the room."""
    assert o.view is not None
    width, height = o.end - o.start, o.top - o.bottom
    at = o.at + pane
    if o.wall == "x":
        start = (at, o.end if outward > 0 else o.start, o.bottom)
        u: Point = (0.0, -width * outward, 0.0)
    else:
        start = (o.start if outward > 0 else o.end, at, o.bottom)
        u = (width * outward, 0.0, 0.0)
    b.panel(start, u, (0, 0, height), o.view)


def build_shell(
    b: Builder,
    low: tuple[float, float],
    high: tuple[float, float],
    openings: list[Opening],
    wall: Surface,
    core: Surface,
    height: float = CEILING,
) -> None:
    """Add the outside of the house and the slab below it (which also fills cut walls when seen from above)."""
    x0, y0, x1, y1 = low[0] - OUTER_WALL, low[1] - OUTER_WALL, high[0] + OUTER_WALL, high[1] + OUTER_WALL
    with b.model("facade"):
        b.box((x0, y0, -0.30), (x1, y1, -0.005), core)
        b.panel((x0, y0, height + 0.02), (x1 - x0, 0, 0), (0, y1 - y0, 0), core)
        corners = [(x0, y1), (x1, y1), (x1, y0), (x0, y0)]
        spans = [(1, 0), (0, -1), (-1, 0), (0, 1)]
        names = [("y", x1 - x0), ("x", y1 - y0)] * 2
        for corner, along, (axis, length) in zip(corners, spans, names, strict=True):
            inward = (-along[1], along[0])
            side = _Side("", axis, corner, along, inward, length)
            found = [(span, o) for o in openings if o.view is not None and (span := side.span(o)) is not None]
            _wall(b, side, sorted(found, key=lambda item: item[0]), wall, top=height + 0.02)
