"""`Pinhole`: a rectified stereo pair of pinholes without distortion, at any level of a pyramid."""

from __future__ import annotations

from typing import NamedTuple

from taskslam.robot import StereoCamera


class Pinhole(NamedTuple):
    """f, cx, cy: pixels, a pixel's centre having whole coordinates (OpenCV). baseline: m to the right camera's centre.

    Optical axes: x right, y down, z forward. A point (x, y, z) of the left camera is at u = f x / z + cx,
    v = f y / z + cy, and in the right image at u - f baseline / z.
    """

    f: float
    cx: float
    cy: float
    baseline: float

    @staticmethod
    def of(camera: StereoCamera) -> Pinhole:
        """The pair of a data sheet."""
        return Pinhole(camera.focal_length, *camera.center, camera.baseline)

    def at_level(self, level: int) -> Pinhole:
        """On images halved `level` times, each pixel the mean of 2 x 2.

        A pixel's centre (u, v) becomes ((u + 1/2) / 2^level - 1/2, ...): it is half-pixel corners that are scaled.
        """
        scale = 0.5**level
        return Pinhole(self.f * scale, (self.cx + 0.5) * scale - 0.5, (self.cy + 0.5) * scale - 0.5, self.baseline)
