"""The robot in the virtual lab: what it looks like from above, and how it sways on a floor that is never quite even."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, pose_from_xyz_rpy
from taskslam.simulation.streams import stream

_WAVES = 8
_LONGEST, _SHORTEST = 0.9, 0.15  # m, of the floor's unevenness along the way
_TURN = 0.1  # m of way that a radian of turning on the spot counts for


def robot_cylinders(radius: float, height: float, tag_height: float) -> FloatArray:
    """(C, 6) cylinders of a TurtleBot-like robot: a base, plates on poles, and a post that carries the tag's board."""
    plates = [0.16, 0.5 * (0.16 + height), height]
    plate_radius = 0.9 * radius
    rows = [[0.0, 0.0, 0.015, 0.11, radius, 0.05]]
    rows += [[0.0, 0.0, z - 0.008, z, plate_radius, 0.10] for z in plates]
    poles = [(0.7 * plate_radius * x, 0.7 * plate_radius * y) for x in (-1, 1) for y in (-1, 1)]
    rows += [[x, y, 0.11, tag_height - 0.006, 0.007, 0.35] for x, y in poles]
    return np.array(rows)


@dataclass(frozen=True)
class Sway:
    """How far a standing robot is from level. tilt: sd of roll and of pitch, rad; height: sd, m.

    pivot: height above the floor, m, of the point that stays where it is as the robot tilts. With the pivot on the
    floor a tag on top of the robot moves sideways by its height times the tilt.
    """

    tilt: float = 0.0
    height: float = 0.0
    pivot: float = 0.0


class Floor:
    """The unevenness of one round: a smooth function of the way travelled, so that a robot at rest is at rest."""

    def __init__(self, sway: Sway, seed: int, round_number: int) -> None:
        dice = stream(seed, "lab/floor", round_number)
        self._sway = sway
        self._waves = dice.uniform(2 * np.pi / _LONGEST, 2 * np.pi / _SHORTEST, (3, _WAVES))
        self._phases = dice.uniform(0.0, 2 * np.pi, (3, _WAVES))

    def poses(self, planar: FloatArray, way: FloatArray) -> FloatArray:
        """(N, 4, 4) poses in space of (N, 3) planar poses x, y, theta, after (N,) metres of way."""
        unit = np.sqrt(2.0 / _WAVES) * np.cos(self._waves[:, :, None] * way + self._phases[:, :, None]).sum(axis=1)
        roll, pitch = self._sway.tilt * unit[0], self._sway.tilt * unit[1]
        up, pivot = self._sway.height * unit[2], self._sway.pivot
        out = np.empty((len(planar), 4, 4))
        for row, (x, y, theta) in enumerate(planar):
            about = pose_from_xyz_rpy((0, 0, pivot + up[row]), (roll[row], pitch[row], 0.0))
            about[:3, 3] -= about[:3, :3] @ np.array([0, 0, pivot])
            out[row] = pose_from_xyz_rpy((x, y, 0), (0, 0, theta)) @ about
        return out


def travelled(planar: FloatArray) -> FloatArray:
    """(N,) metres of way up to each of (N, 3) planar poses, turning included."""
    step = np.diff(planar, axis=0)
    turn = np.abs(np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2])))
    return np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]) + _TURN * turn)])
