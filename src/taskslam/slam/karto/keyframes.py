"""Keyframes: the scans that the map keeps, with their poses, and the questions asked of them by place and by chain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.karto.scan_points import Points, ScanPoints

Ids = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Reference:
    """Hits of several keyframes in the map frame. points, normals: (N, 2)."""

    points: FloatArray
    normals: FloatArray


class Keyframes:
    """Scans and poses (N, 3) of the base in the map frame, numbered in the order in which they were taken."""

    def __init__(self) -> None:
        self._poses = np.zeros((64, 3))
        self._scans: list[ScanPoints] = []

    def __len__(self) -> int:
        return len(self._scans)

    @property
    def poses(self) -> FloatArray:
        """(N, 3), a view: written by `move`."""
        return self._poses[: len(self._scans)]

    def scan(self, number: int) -> ScanPoints:
        """The scan of one keyframe."""
        return self._scans[number]

    def add(self, scan: ScanPoints, pose: FloatArray) -> int:
        """Append a keyframe; its number. Hits are kept as float32: a tenth of a micrometre is enough."""
        number = len(self._scans)
        if number == len(self._poses):
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)])
        self._poses[number] = pose
        self._scans.append(ScanPoints(_compact(scan.points), _compact(scan.normals), scan.sensor))
        return number

    def move(self, poses: FloatArray) -> None:
        """Replace all poses, (N, 3)."""
        self._poses[: len(self._scans)] = poses

    def distances(self, place: FloatArray) -> FloatArray:
        """(N,) planar distance in metres of every keyframe to (2+,) place."""
        return np.asarray(np.hypot(self.poses[:, 0] - place[0], self.poses[:, 1] - place[1]))

    def reference(self, numbers: list[int], viewpoint: FloatArray) -> Reference:
        """Hits of these keyframes that can be seen from (2+,) viewpoint.

        Faces turned away from the viewpoint are left out, so that the far side of a wall is not taken for its near side
        (what OpenKarto's FindValidPoints is for; there by the order of hits, here by their normals).
        """
        total = sum(len(self._scans[k]) for k in numbers)
        points, normals = np.empty((total, 2)), np.empty((total, 2))
        count = 0
        for k in numbers:
            scan = self._scans[k]
            count = _place(scan.points, scan.normals, self._poses[k], viewpoint, points, normals, count)
        return Reference(points[:count], normals[:count])


def _compact(values: Points) -> npt.NDArray[np.float32]:
    return values.astype(np.float32)


def runs(numbers: Ids) -> list[Ids]:
    """Split ascending keyframe numbers into chains of consecutive ones."""
    if len(numbers) == 0:
        return []
    return np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)


@njit(cache=True)
def _place(
    points: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    pose: FloatArray,
    viewpoint: FloatArray,
    out_points: FloatArray,
    out_normals: FloatArray,
    count: int,
) -> int:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for p in range(points.shape[0]):
        px, py = np.float64(points[p, 0]), np.float64(points[p, 1])
        x = c * px - s * py + pose[0]
        y = s * px + c * py + pose[1]
        ax, ay = np.float64(normals[p, 0]), np.float64(normals[p, 1])
        nx, ny = c * ax - s * ay, s * ax + c * ay
        if nx * (viewpoint[0] - x) + ny * (viewpoint[1] - y) < 0.0:
            continue
        out_points[count, 0] = x
        out_points[count, 1] = y
        out_normals[count, 0] = nx
        out_normals[count, 1] = ny
        count += 1
    return count
