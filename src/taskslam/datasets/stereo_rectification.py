"""Rectification: two calibrated, distorted cameras become the distortion-free parallel pair that methods expect.

Both images are resampled as seen by virtual pinholes at the same centres, turned so that their x axes lie along the
baseline and their z axis is the mean of the two optical axes orthogonal to it (the usual construction; Fusiello,
Trucco and Verri 2000). Focal length: the mean of the four given; principal point: the middle of the image.
Distortion: radial-tangential (Brown 1966; OpenCV's k1 k2 p1 p2 k3, then k4 k5 k6 of the rational model) or equidistant
(Kannala and Brandt 2006; k1 to k4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.errors import DatasetError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray, invert_se3
from taskslam.robot import StereoCamera
from taskslam.robot.parts import Mount

Image = npt.NDArray[np.uint8]

_SAME = 1e-6  # rad, and relative to lengths: below this two calibrations are the same one, written differently


@dataclass(frozen=True)
class CameraCalibration:
    """One camera as calibrated: fx fy cx cy in pixels; T_base_optical: (4, 4), z forward. coefficients: see module."""

    width: int
    height: int
    intrinsics: tuple[float, float, float, float]
    model: str
    coefficients: tuple[float, ...]
    T_base_optical: FloatArray


class Rectifier:
    """Makes rectified pairs. camera: what the pair then is; is_identity: the images are rectified as they come."""

    def __init__(self, left: CameraCalibration, right: CameraCalibration, rate: float, color: bool) -> None:
        """Prepare the tables.

        Raises:
            DatasetError: the sizes differ, or the right camera does not stand to the right of the left one.
        """
        if (left.width, left.height) != (right.width, right.height):
            raise DatasetError(
                f"the left images are {left.width}x{left.height}, the right ones {right.width}x{right.height};"
                " expected one size"
            )
        offset = right.T_base_optical[:3, 3] - left.T_base_optical[:3, 3]
        baseline = float(np.linalg.norm(offset))
        if baseline == 0 or offset @ left.T_base_optical[:3, 0] < 0.5 * baseline:
            raise DatasetError(
                f"the right camera stands at {np.round(left.T_base_optical[:3, :3].T @ offset, 4).tolist()} m from the"
                " left one (x right, y down, z forward); expected it to the right: are the two swapped?"
            )
        R_base_new = _axes_along(offset / baseline, left.T_base_optical, right.T_base_optical)
        f = sum(left.intrinsics[:2] + right.intrinsics[:2]) / 4
        T_base_new = left.T_base_optical.copy()
        T_base_new[:3, :3] = R_base_new
        self.camera = StereoCamera(
            mount=mount_of(T_base_new @ invert_se3(OPTICAL_IN_BODY)),
            rate=rate,
            width=left.width,
            height=left.height,
            horizontal_fov=2.0 * math.atan(0.5 * left.width / f),
            baseline=baseline,
            noise=0.0,
            color=color,
        )
        pinhole = (f, *self.camera.center)
        self.is_identity = all(is_already(camera, R_base_new, pinhole) for camera in (left, right))
        self._tables = (
            [] if self.is_identity else [sampling_table(camera, R_base_new, pinhole) for camera in (left, right)]
        )

    def __call__(self, left: Image, right: Image) -> tuple[Image, Image]:
        """The pair, rectified; black where a camera does not see. left, right: (H, W) or (H, W, 3)."""
        if self.is_identity:
            return left, right
        return tuple(resampled_image(image, table) for image, table in zip((left, right), self._tables, strict=True))  # type: ignore[return-value]


def same_camera(one: StereoCamera, other: StereoCamera) -> bool:
    """Whether two descriptions mean the same rectified pair, rounding aside."""
    return (one.width, one.height) == (other.width, other.height) and bool(
        abs(one.focal_length - other.focal_length) <= _SAME * other.focal_length
        and abs(one.baseline - other.baseline) <= _SAME
        and (np.abs(one.mount.matrix() - other.mount.matrix()) <= _SAME).all()
    )


def mount_of(T_base_sensor: FloatArray) -> Mount:
    """A (4, 4) pose as a mount: xyz and fixed-axis roll, pitch, yaw (REP-103)."""
    R = T_base_sensor[:3, :3]
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if math.hypot(R[0, 0], R[1, 0]) > 1e-9:
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
    else:  # looking straight up or down: roll and yaw turn about the same axis
        roll, yaw = 0.0, math.atan2(-R[0, 1], R[1, 1])
    x, y, z = (float(value) for value in T_base_sensor[:3, 3])
    return Mount(xyz=(x, y, z), rpy=(roll + 0.0, pitch + 0.0, yaw + 0.0))


def _axes_along(x: FloatArray, T_left: FloatArray, T_right: FloatArray) -> FloatArray:
    """(3, 3) rotation whose x axis is the baseline and whose z axis lies between the two optical axes."""
    forward = T_left[:3, 2] + T_right[:3, 2]
    z = forward - (forward @ x) * x
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def is_already(camera: CameraCalibration, R_base_new: FloatArray, pinhole: tuple[float, float, float]) -> bool:
    """Whether a camera is the pinhole f, cx, cy without distortion, turned so."""
    f, cx, cy = pinhole
    return bool(
        not any(camera.coefficients)
        and np.allclose(camera.T_base_optical[:3, :3], R_base_new, rtol=0, atol=_SAME)
        and np.allclose(camera.intrinsics, (f, f, cx, cy), rtol=0, atol=_SAME * f)
    )


def sampling_table(
    camera: CameraCalibration, R_base_new: FloatArray, pinhole: tuple[float, float, float]
) -> npt.NDArray[np.float32]:
    """(H, W, 2) float32 place (u, v) in the camera's image of every pixel of the virtual one; NaN if behind it."""
    f, cx, cy = pinhole
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = np.stack([(u - cx) / f, (v - cy) / f, np.ones(u.shape)], axis=-1)
    rays = rays @ (camera.T_base_optical[:3, :3].T @ R_base_new).T
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = np.where(rays[..., 2:] > 1e-6, rays[..., :2] / rays[..., 2:], np.nan)
    fx, fy, cx, cy = camera.intrinsics
    return (distort(flat, camera.model, camera.coefficients) * (fx, fy) + (cx, cy)).astype(np.float32)


def distort(points: FloatArray, model: str, coefficients: tuple[float, ...]) -> FloatArray:
    """Where a distorting lens puts (..., 2) points of the plane z = 1."""
    if not any(coefficients):
        return points
    x, y = points[..., 0], points[..., 1]
    r2 = x * x + y * y
    if model == "equidistant":
        k1, k2, k3, k4 = coefficients
        r = np.sqrt(r2)
        theta = np.arctan(r)
        t2 = theta * theta
        bent = theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
        return points * np.where(r > 1e-12, bent / np.maximum(r, 1e-12), 1.0)[..., None]
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, 0.0, 0.0, 0.0, 0.0)[:8]
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def resampled_image(image: Image, table: npt.NDArray[np.float32]) -> Image:
    """The image at the places of a table, black where a place lies outside."""
    resampled: Image = _bilinear(image.reshape(*image.shape[:2], -1), table)
    return resampled.reshape(image.shape)


@njit(cache=True)
def _bilinear(image, table):  # type: ignore[no-untyped-def]
    """(H, W, C) uint8 resampled at the (H, W, 2) places; 0 where a place lies outside."""
    height, width, channels = image.shape
    out = np.zeros((table.shape[0], table.shape[1], channels), np.uint8)
    for row in range(table.shape[0]):
        for column in range(table.shape[1]):
            u, v = table[row, column, 0], table[row, column, 1]
            if not (0.0 <= u <= width - 1 and 0.0 <= v <= height - 1):
                continue
            left, top = min(int(u), width - 2), min(int(v), height - 2)
            a, b = u - left, v - top
            for channel in range(channels):
                upper = (1 - a) * image[top, left, channel] + a * image[top, left + 1, channel]
                lower = (1 - a) * image[top + 1, left, channel] + a * image[top + 1, left + 1, channel]
                out[row, column, channel] = np.uint8((1 - b) * upper + b * lower + np.float32(0.5))
    return out
