"""The RGB-D camera of a robot: a pinhole and, from a stereo pair of its own, the depth of each of its pixels."""

from __future__ import annotations

import math

from taskslam.field_types import NonNegative, Positive
from taskslam.robot.parts import Camera


class RgbdCamera(Camera):
    """The mount is that of the camera whose pixels the depth is given for; baseline: of the pair that measures it.

    depth_min, depth_max: metres along the optical axis between which depth is measured. depth_noise: standard deviation
    in metres at one metre; it grows with the square of the depth. depth_resolution: smallest step, metres.
    """

    depth_min: Positive
    depth_max: Positive
    depth_noise: NonNegative
    depth_resolution: NonNegative = 0.001

    def image_bytes(self) -> tuple[int, ...]:
        """Image and depth."""
        return math.prod(self.image_shape), 4 * self.width * self.height
