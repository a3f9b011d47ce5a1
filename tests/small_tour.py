"""The file of a tour in a room of 6 m with nothing in it: what tests drive that want a drive, and no particular one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

_WALLS = ((-3, 0, 0.2, 6), (3, 0, 0.2, 6), (0, -3, 6, 0.2), (0, 3, 6, 0.2))
_BOX = "<geometry><box><size>{2} {3} 1</size></box></geometry><pose>{0} {1} 0.5 0 0 0</pose>"


def write_tour(folder: Path, goals: Sequence[Sequence[float]], protocol: str) -> Path:
    """`tour.yaml` in the folder, and its Gazebo world beside it. goals: x, y, heading; protocol: its keys, in YAML."""
    boxes = enumerate(_BOX.format(*wall) for wall in _WALLS)
    walls = "".join(f"<collision name='c{n}'>{box}</collision><visual name='v{n}'>{box}</visual>" for n, box in boxes)
    (folder / "room.world").write_text(
        "<sdf version='1.6'><world name='w'><model name='walls'><static>1</static>"
        f"<link name='l'>{walls}</link></model></world></sdf>"
    )
    file = folder / "tour.yaml"
    file.write_text(
        f"name: tour\nworld: {{file: {folder / 'room.world'}}}\nfloor_plan: {{resolution: 0.1}}\n"
        f"start: {{x: 0, y: 0, theta: 0}}\nsequence: {{waypoints: {[list(goal) for goal in goals]}}}\n"
        f"protocol: {{{protocol}}}\n"
    )
    return file
