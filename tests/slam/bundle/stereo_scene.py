"""Cameras, points and what the cameras see of them."""

import numpy as np

from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3

PINHOLE = Pinhole(360.0, 376.0, 240.0, 0.11)


def points(random, count):
    """(N, 3) in the world, two to eight metres before the first camera."""
    return np.column_stack(
        (random.uniform(-2.0, 2.0, count), random.uniform(-1.2, 1.2, count), random.uniform(2.0, 8.0, count))
    )


def see(T, places):
    """(N, 3) u, v, and u in the right picture."""
    p = places @ T[:3, :3].T + T[:3, 3]
    u = PINHOLE.f * p[:, 0] / p[:, 2] + PINHOLE.cx
    v = PINHOLE.f * p[:, 1] / p[:, 2] + PINHOLE.cy
    return np.column_stack((u, v, u - PINHOLE.f * PINHOLE.baseline / p[:, 2]))


def pose(random, metres, radians):
    """(4, 4) a motion of about so much."""
    return exp_se3(np.concatenate((random.normal(0, metres, 3), random.normal(0, radians, 3))))
