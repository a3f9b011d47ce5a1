"""A stereo pair of smooth made-up pictures, and points with patches sampled from one of them."""

import numpy as np

from taskslam.slam.vision.patches import Weighting, sample_patches
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import build_pyramid

PINHOLE = Pinhole(90.0, 80.0, 60.0, 0.1)
SHAPE = (120, 160)
EVERYTHING = Weighting(c2=50.0, nu=4.0, outlier=1e9, most_outliers=4)  # nothing is an outlier
DEPTH, SLANT = 2.0, 0.3


def wall_at(X, Y):
    """Grey levels of a wall with waves of several lengths, by metres on it."""
    waves = sum(np.sin(a * X + b * Y + c) for a, b, c in ((9, 2, 0), (-3, 11, 1), (17, -5, 2), (6, 21, 3), (-25, 9, 4)))
    return 128.0 + 22.0 * waves


def see(T_world_camera, gain=1.0, pinhole=PINHOLE, shape=SHAPE):
    """Left and right picture of the slanted wall z = DEPTH + SLANT x, seen from a pose of the left camera."""
    v, u = np.mgrid[: shape[0], : shape[1]].astype(float)
    rays = np.stack([(u - pinhole.cx) / pinhole.f, (v - pinhole.cy) / pinhole.f, np.ones(shape)], -1)
    pair = []
    for offset in (0.0, pinhole.baseline):
        origin = T_world_camera[:3, 3] + T_world_camera[:3, :3] @ [offset, 0.0, 0.0]
        d = rays @ T_world_camera[:3, :3].T
        along = (DEPTH + SLANT * origin[0] - origin[2]) / (d[..., 2] - SLANT * d[..., 0])
        at = origin + along[..., None] * d
        pair.append(np.clip(np.round(gain * wall_at(at[..., 0], at[..., 1])), 0, 255).astype(np.uint8))
    return pair


def points_of(T_world_camera, spacing=9):
    """(N, 2) pixels in a grid and their (N,) true inverse depths."""
    u, v = np.meshgrid(np.arange(14.0, SHAPE[1] - 14, spacing), np.arange(14.0, SHAPE[0] - 14, spacing))
    points = np.stack([u.ravel(), v.ravel()], -1)
    rays = (points - (PINHOLE.cx, PINHOLE.cy)) / PINHOLE.f
    d = np.c_[rays, np.ones(len(rays))] @ T_world_camera[:3, :3].T
    o = T_world_camera[:3, 3]
    return points, rays, (d[:, 2] - SLANT * d[:, 0]) / (DEPTH + SLANT * o[0] - o[2])


def host(T_world_camera, levels=3, gain=1.0):
    """Pyramids of a view, and of its points rays, inverse depths and patches by level."""
    left, right = (build_pyramid(image, levels) for image in see(T_world_camera, gain))
    points, rays, inverse_depths = points_of(T_world_camera)
    return left, right, rays, inverse_depths, tuple(sample_patches(im, points, n) for n, im in enumerate(left))
