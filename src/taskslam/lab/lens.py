"""A world through a real lens: what a pinhole sees, bent as a camera's calibration says.

A lens comes as a table: the normalised ray (x/z, y/z in the optical frame) of every corner between pixels. Within a
pixel the ray is interpolated between its four corners; the lens bends so little over one pixel that this is exact to
some 1e-4 px. Any lens model serves, and this room need know none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.errors import WorldError
from taskslam.geometry import FloatArray
from taskslam.simulation.rendering.rasterizer import Pinhole
from taskslam.simulation.rendering.scene import Scene

_FAR = 120.0  # m
_LARGEST = 6000  # px, of a pinhole's side: a fisheye's rim cannot be had through one


@dataclass(frozen=True)
class Backdrop:
    """A world as a camera sees it, before tags and robot are drawn.

    radiance: (H, W) float32 linear light, averaged over each pixel; depth: (H, W) float32 m along the optical axis at
    the pixel's centre, +inf where nothing is seen.
    """

    radiance: npt.NDArray[np.float32]
    depth: npt.NDArray[np.float32]


def pixel_corners(width: int, height: int) -> FloatArray:
    """(H + 1, W + 1, 2) pixel coordinates of the corners between pixels; (0, 0) is the centre of the first pixel."""
    u, v = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    return np.stack([u, v], axis=2)


def covering_pinhole(rays: FloatArray, fineness: float = 2.0) -> Pinhole:
    """The pinhole that sees all that a lens sees, so many times finer than its pixels.

    rays: (H + 1, W + 1, 2) normalised rays at the pixels' corners; NaN where no light comes through.

    Raises:
        WorldError: the lens sees so wide that no pinhole of reasonable size covers it.
    """
    low, high = np.nanmin(rays, axis=(0, 1)), np.nanmax(rays, axis=(0, 1))
    step = float(np.nanmedian(np.diff(rays[..., 0], axis=1)))
    focal = fineness / step
    size = np.ceil((high - low) * focal).astype(int) + 2
    if max(size) > _LARGEST:
        raise WorldError(
            f"the lens sees so wide that a pinhole of {size[0]} x {size[1]} pixels would be needed to cover it;"
            f" expected at most {_LARGEST}"
        )
    center = (float(-low[0] * focal) + 0.5, float(-low[1] * focal) + 0.5)
    return Pinhole(int(size[0]), int(size[1]), focal, center, far=_FAR)


def backdrop(
    scene: Scene, T_world_camera: FloatArray, rays: FloatArray, pinhole: Pinhole, threads: int = 1
) -> Backdrop:
    """The scene at `T_world_camera` (4, 4), the pose of the optical frame, through the lens with these `rays`."""
    view = scene.view(T_world_camera, pinhole, threads)
    light = np.empty((rays.shape[0] - 1, rays.shape[1] - 1), np.float32)
    depth = np.empty_like(light)
    _bend(view.radiance_root, view.depth(), rays, pinhole.focal, *pinhole.center, light, depth)
    return Backdrop(light, depth)


def natural_vignetting(rays: FloatArray) -> npt.NDArray[np.float32]:
    """(H, W) share of the light that reaches each pixel: the fourth power of the cosine of its angle."""
    middle = 0.25 * (rays[:-1, :-1] + rays[1:, :-1] + rays[:-1, 1:] + rays[1:, 1:])
    share = 1.0 / (1.0 + np.einsum("ijk,ijk->ij", middle, middle)) ** 2
    return np.asarray(np.nan_to_num(share), np.float32)


@njit(cache=True)
def _bend(root, view_depth, rays, focal, center_x, center_y, light, depth):  # type: ignore[no-untyped-def]
    """Average 2 x 2 bilinear looks of the pinhole's picture into each pixel of the lens's."""
    rows, columns = light.shape
    for i in range(rows):
        for j in range(columns):
            total = 0.0
            for k in range(5):
                a, b = (0.5, 0.5) if k == 4 else (0.25 + 0.5 * (k % 2), 0.25 + 0.5 * (k // 2))
                x = _between(rays, i, j, a, b, 0) * focal + center_x
                y = _between(rays, i, j, a, b, 1) * focal + center_y
                if not (x >= 0.0 and y >= 0.0 and x < root.shape[1] - 1 and y < root.shape[0] - 1):
                    depth[i, j] = np.inf
                    continue
                if k == 4:
                    depth[i, j] = view_depth[int(y + 0.5), int(x + 0.5)]
                    continue
                m, n = int(y), int(x)
                p, q = y - m, x - n
                total += (1 - p) * ((1 - q) * root[m, n] ** 2 + q * root[m, n + 1] ** 2)
                total += p * ((1 - q) * root[m + 1, n] ** 2 + q * root[m + 1, n + 1] ** 2)
            light[i, j] = 0.25 * total


@njit(cache=True)
def _between(rays, i, j, a, b, axis):  # type: ignore[no-untyped-def]
    """Ray component `axis` at the share (a across, b down) of pixel (i, j)."""
    upper = (1 - a) * rays[i, j, axis] + a * rays[i, j + 1, axis]
    lower = (1 - a) * rays[i + 1, j, axis] + a * rays[i + 1, j + 1, axis]
    return (1 - b) * upper + b * lower
