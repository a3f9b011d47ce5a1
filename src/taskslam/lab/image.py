"""Tags and a robot drawn into a picture as a lens sees them, exact to the samples within each pixel.

Each pixel is the mean of 16 samples that form a lattice: no two share a row, a column or an instant of the exposure,
so that an edge along the pixels is as smooth as any other, and what moves is blurred. A sample follows its ray through
the lens to the planes of the tags and the cylinders of the robot; no triangle, texture filter or warp is in between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.lab.lens import Backdrop, _between

SAMPLES = 16
"""Samples a pixel, and instants of an exposure."""

PAPER, INK = 0.85, 0.04
"""Share of light that white paper and black toner throw back."""

_DEPTH_SLACK = 0.03  # m that a card may lie behind the surface it is stuck to
_SHADOW_REACH, _SHADOW_DEPTH = 0.16, 0.5  # m around a robot's foot, share of light lost right beside it


@dataclass(frozen=True)
class Cards:
    """N printed square cards, each a sheet of m by m cells.

    reflectance: (N, m, m) float32, row 0 at the top of the artwork; side: m, of the whole sheet; poses: (16, N, 4, 4)
    T_camera_card at the instants of the exposure, origin in the sheet's middle, x to the artwork's top, y to its left,
    z out of the paper.
    """

    reflectance: npt.NDArray[np.float32]
    side: float
    poses: FloatArray


@dataclass(frozen=True)
class Body:
    """Upright cylinders that make up a robot.

    cylinders: (C, 6) x, y, low z, high z, radius (m, in the robot's frame) and reflectance; poses: (16, 4, 4)
    T_camera_robot at the instants of the exposure.
    """

    cylinders: FloatArray
    poses: FloatArray


def sheet(cells: npt.NDArray[np.bool_], quiet: int = 1) -> npt.NDArray[np.float32]:
    """Reflectance (n + 2 quiet, n + 2 quiet) of a tag's cells (n, n; True is white) with a white rim around them."""
    rimmed = np.pad(cells, quiet, constant_values=True)
    return np.where(rimmed, PAPER, INK).astype(np.float32)


def draw(
    behind: Backdrop, rays: FloatArray, light: float, cards: Cards | None, body: Body | None
) -> tuple[npt.NDArray[np.float32], tuple[slice, slice]]:
    """The backdrop with cards and body in it, linear light, and the rows and columns that have changed.

    rays: (H + 1, W + 1, 2) the lens (see `lab_lens`); light: what falls on paper and robot, in the backdrop's unit.
    """
    out = behind.radiance.copy()
    card_poses = np.empty((SAMPLES, 0, 3, 4)) if cards is None else np.ascontiguousarray(cards.poses[:, :, :3])
    looks = np.empty((0, 1, 1), np.float32) if cards is None else cards.reflectance
    body_poses = np.zeros((SAMPLES, 3, 4)) if body is None else np.ascontiguousarray(body.poses[:, :3])
    cylinders = np.empty((0, 6)) if body is None else body.cylinders
    side = 1.0 if cards is None else cards.side
    box = _draw(behind.depth, rays, light, card_poses, looks, side, body_poses, cylinders, out)
    return out, (slice(box[0], box[1]), slice(box[2], box[3]))


@njit(cache=True)
def _draw(depth, rays, light, cards, looks, side, bodies, cylinders, out):  # type: ignore[no-untyped-def]
    rows, columns = out.shape
    spheres = _spheres(cards, side, bodies, cylinders)
    box = np.array([rows, 0, columns, 0])
    middle = bodies[SAMPLES // 2]
    for i in range(rows):
        for j in range(columns):
            x, y = _between(rays, i, j, 0.5, 0.5, 0), _between(rays, i, j, 0.5, 0.5, 1)
            solid = _near_any(x, y, spheres, 0.0)
            if not solid and not (cylinders.shape[0] and _near_any(x, y, spheres[-1:], 2 * _SHADOW_REACH)):
                continue
            ground = out[i, j]
            if cylinders.shape[0]:
                ground *= _shadow(x, y, depth[i, j], middle, cylinders[0, 4])
            kept, added = 0, 0.0
            for k in range(SAMPLES if solid else 1):
                a, b = ((5 * k) % SAMPLES + 0.5) / SAMPLES, (k + 0.5) / SAMPLES
                instant = (7 * k) % SAMPLES
                x, y = _between(rays, i, j, a, b, 0), _between(rays, i, j, a, b, 1)
                near, shade = _card_hit(x, y, cards[instant], looks, side)
                if cylinders.shape[0] and near == np.inf:
                    near, shade = _body_hit(x, y, bodies[instant], cylinders)
                if near < depth[i, j] + _DEPTH_SLACK:
                    added += shade * light
                else:
                    kept += 1
            out[i, j] = (added + kept * ground) / (SAMPLES if solid else 1)
            box[0], box[1] = min(box[0], i), max(box[1], i + 1)
            box[2], box[3] = min(box[2], j), max(box[3], j + 1)
    return box


@njit(cache=True)
def _spheres(cards, side, bodies, cylinders):  # type: ignore[no-untyped-def]
    """(N, 4) centre and radius, in the camera's frame, around all that may be hit; motion blur included."""
    count = cards.shape[1] + (1 if cylinders.shape[0] else 0)
    spheres = np.zeros((count, 4))
    first, last = 0, SAMPLES - 1
    for n in range(cards.shape[1]):
        spheres[n, :3] = 0.5 * (cards[first, n, :, 3] + cards[last, n, :, 3])
        moved = np.sqrt(((cards[first, n, :, 3] - cards[last, n, :, 3]) ** 2).sum())
        spheres[n, 3] = 0.72 * side + moved
    if cylinders.shape[0]:
        top = cylinders[:, 3].max()
        reach = (np.sqrt(cylinders[:, 0] ** 2 + cylinders[:, 1] ** 2) + cylinders[:, 4]).max()
        for pose, weight in ((bodies[first], 0.5), (bodies[last], 0.5)):
            spheres[-1, :3] += weight * (pose[:, 3] + 0.5 * top * pose[:, 2])
        moved = np.sqrt(((bodies[first][:, 3] - bodies[last][:, 3]) ** 2).sum())
        spheres[-1, 3] = math.sqrt(reach**2 + 0.25 * top**2) + moved
    return spheres


@njit(cache=True)
def _near_any(x, y, spheres, margin):  # type: ignore[no-untyped-def]
    """Whether the ray (x, y, 1) passes within `margin`, m, of a sphere; false for NaN."""
    length = x * x + y * y + 1.0
    for n in range(spheres.shape[0]):
        along = (x * spheres[n, 0] + y * spheres[n, 1] + spheres[n, 2]) / length
        gap = (along * x - spheres[n, 0]) ** 2 + (along * y - spheres[n, 1]) ** 2 + (along - spheres[n, 2]) ** 2
        if along > 0.0 and gap < (spheres[n, 3] + margin) ** 2:
            return True
    return False


@njit(cache=True)
def _card_hit(x, y, poses, looks, side):  # type: ignore[no-untyped-def]
    """Depth and reflectance where the ray (x, y, 1) first meets the front of a card; +inf and 0 for none."""
    near, shade = np.inf, 0.0
    cells = looks.shape[1]
    for n in range(poses.shape[0]):
        R, t = poses[n, :, :3], poses[n, :, 3]
        facing = R[0, 2] * x + R[1, 2] * y + R[2, 2]
        if facing >= 0.0:  # the back of the card, or along it
            continue
        z = (R[0, 2] * t[0] + R[1, 2] * t[1] + R[2, 2] * t[2]) / facing
        if z <= 0.0 or z >= near:
            continue
        dx, dy, dz = z * x - t[0], z * y - t[1], z - t[2]
        down = 0.5 - (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz) / side
        right = 0.5 - (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz) / side
        if right >= 0.0 and right < 1.0 and down >= 0.0 and down < 1.0:
            near = z
            shade = looks[n, int(down * cells), int(right * cells)]
    return near, shade


@njit(cache=True)
def _body_hit(x, y, pose, cylinders):  # type: ignore[no-untyped-def]
    """Depth and shaded reflectance where the ray (x, y, 1) first meets a cylinder; +inf and 0 for none."""
    R, t = pose[:, :3], pose[:, 3]
    direction, origin = np.empty(3), np.empty(3)
    for axis in range(3):
        direction[axis] = R[0, axis] * x + R[1, axis] * y + R[2, axis]
        origin[axis] = -(R[0, axis] * t[0] + R[1, axis] * t[1] + R[2, axis] * t[2])
    near, shade = np.inf, 0.0
    for n in range(cylinders.shape[0]):
        center_x, center_y, low, high, radius, reflectance = cylinders[n]
        dx, dy = origin[0] - center_x, origin[1] - center_y
        if direction[2] < 0.0:
            z = (high - origin[2]) / direction[2]
            at_x, at_y = dx + z * direction[0], dy + z * direction[1]
            if 0.0 < z < near and at_x * at_x + at_y * at_y <= radius * radius:
                near, shade = z, reflectance
        a = direction[0] ** 2 + direction[1] ** 2
        b = dx * direction[0] + dy * direction[1]
        inside = b * b - a * (dx * dx + dy * dy - radius * radius)
        if a <= 0.0 or inside <= 0.0:
            continue
        z = (-b - math.sqrt(inside)) / a
        height = origin[2] + z * direction[2]
        if 0.0 < z < near and low <= height <= high:
            side_x = (dx + z * direction[0]) / radius
            near, shade = z, reflectance * (0.45 + 0.3 * side_x)  # lit a little more from one side
    return near, shade


@njit(cache=True)
def _shadow(x, y, depth, pose, radius):  # type: ignore[no-untyped-def]
    """Share of light left on the floor near the robot's foot."""
    R, t = pose[:, :3], pose[:, 3]
    dx, dy, dz = depth * x - t[0], depth * y - t[1], depth - t[2]
    along = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
    across = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
    up = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
    if not abs(up) < 0.05:
        return 1.0
    gap = max(math.sqrt(along * along + across * across) - radius, 0.0) / _SHADOW_REACH
    return 1.0 - _SHADOW_DEPTH * math.exp(-gap * gap)
