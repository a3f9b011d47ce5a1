"""Images without distortion, in which the edges of a tag are straight, and the way back to the pixels of the raw image.

A detector fits straight lines to the edges of a tag. In a raw image they are curved, which moves the corners of a large
tag by tenths of a pixel. Points found in a rectified image and bent back are free of that.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.extra import load_opencv

_WIDEST = 1.5  # tangent of 56 degrees: further out a flat image is mostly stretching
_LARGEST_SIDE = 4  # times the raw image's


class Rectifier:
    """Makes rectified images, as large as the raw image's whole view needs, at the scale of its middle."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        focal = float(np.sqrt(camera.K[0, 0] * camera.K[1, 1]))
        low, high = _seen(camera)
        size = np.minimum(np.ceil((high - low) * focal) + 1, _LARGEST_SIDE * max(camera.width, camera.height))
        self.focal, self._middle = focal, -low * focal
        u, v = np.meshgrid(np.arange(int(size[0])), np.arange(int(size[1])))
        rays = (np.stack([u, v], -1).reshape(-1, 2) - self._middle) / focal
        source = np.nan_to_num(camera.distort(rays), nan=-1e4).astype(np.float32)
        self._source = source.reshape(*u.shape, 2)

    def image(self, raw: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """The rectified image (H', W') of a raw one (H, W); grey where the camera saw nothing."""
        cv2 = load_opencv()
        return np.asarray(cv2.remap(raw, self._source, None, cv2.INTER_CUBIC, borderValue=128), np.uint8)

    def raw(self, points: FloatArray) -> FloatArray:
        """Pixels (N, 2) in the raw image of points (N, 2) in the rectified one."""
        return self._camera.distort((points - self._middle) / self.focal)


def _seen(camera: Camera) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest normalised coordinates (2,) of what the image's border sees."""
    along, down = np.linspace(0, camera.width - 1, 50), np.linspace(0, camera.height - 1, 50)
    border = [
        *((x, y) for x in along for y in (0.0, camera.height - 1.0)),
        *((x, y) for x in (0.0, camera.width - 1.0) for y in down),
    ]
    rays = np.nan_to_num(np.clip(camera.undistort(border), -_WIDEST, _WIDEST), nan=0.0)
    return rays.min(0), rays.max(0)
