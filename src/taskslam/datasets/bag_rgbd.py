"""The RGB-D camera in bags: images, and the depth that is aligned to them, each with a CameraInfo, as RealSense has it.

Depth is a sensor_msgs/Image in metres (32FC1, nothing measured is NaN) or millimetres (16UC1, nothing is 0), REP-118;
we write the former. Images of a lens that distorts are resampled; depths are never blended.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.datasets import bag_rig, ros_decoding
from taskslam.datasets.bag_cameras import expected_image, info_beside
from taskslam.datasets.bag_sensor import BagSensor, Recording
from taskslam.datasets.ros_encoding import RosEncoder, Said
from taskslam.datasets.stamp_order import Pairing
from taskslam.datasets.stereo_rectification import is_already, mount_of, resampled_image, sampling_table
from taskslam.errors import DatasetError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray, invert_se3
from taskslam.measurements import RgbdImages
from taskslam.robot.rgbd import RgbdCamera

_ROLES = ("color", "depth")
_FOLDERS = ("/camera/color", "/camera/aligned_depth_to_color")
_OPTICAL = "camera_color_optical_frame"
_DEPTH_UNITS = {"32FC1": ("f4", 1.0), "16UC1": ("u2", 0.001), "mono16": ("u2", 0.001)}
_NOMINAL = {"baseline": 0.05, "depth_min": 0.1, "depth_max": 10.0, "depth_noise": 0.0}  # where no robot is given


class ColorAndDepth(BagSensor):
    """An RGB-D camera."""

    def __init__(self, recording: Recording, given: RgbdCamera | None) -> None:
        topic = recording.topic("color")
        first = recording.first(topic)
        image = ros_decoding.image(first[0])
        depth = depth_of(recording.first(recording.topic("depth"))[0])
        if depth.shape != image.shape[:2]:
            raise DatasetError(
                f"The depth images are {depth.shape[1]}x{depth.shape[0]}, the images {image.shape[1]}x{image.shape[0]};"
                " expected depth that is aligned to them: name it, --topic depth=TOPIC"
            )
        self._table: npt.NDArray[np.float32] | None = None
        beside = info_beside(topic)
        if not recording.has(beside):
            if given is None:
                raise DatasetError(f"The images have no {beside}, so their camera cannot be told: give --robot")
            self.part = given
            return
        info = recording.first(beside)[0]
        T_base_optical = recording.frames.T_base(first[0].header.frame_id or info.header.frame_id)
        calibrated = bag_rig.raw_camera(info, T_base_optical)
        focal = (calibrated.intrinsics[0] + calibrated.intrinsics[1]) / 2
        told: dict[str, Any] = {
            "mount": mount_of(T_base_optical @ invert_se3(OPTICAL_IN_BODY)),
            "rate": bag_rig.rate_of(first),
            "width": calibrated.width,
            "height": calibrated.height,
            "horizontal_fov": 2.0 * math.atan(0.5 * calibrated.width / focal),
            "noise": 0.0,
            "color": image.ndim == 3,
        }
        camera = RgbdCamera(**_NOMINAL | told)
        self.part = given if given is not None and _alike(given, camera) else camera
        pinhole = (self.part.focal_length, *self.part.center)
        if not is_already(calibrated, T_base_optical[:3, :3], pinhole):
            self._table = sampling_table(calibrated, T_base_optical[:3, :3], pinhole)

    @staticmethod
    def frames(part: RgbdCamera) -> list[tuple[str, FloatArray]]:
        """The colour camera's optical frame, which is that of the depth too."""
        return [(_OPTICAL, part.mount.matrix() @ OPTICAL_IN_BODY)]

    @staticmethod
    def messages(encoder: RosEncoder, part: RgbdCamera, measurement: RgbdImages) -> Iterator[Said]:
        """Image and depth, each with the camera."""
        stamp, depth = measurement.stamp, measurement.depth
        nothing_is_nan = np.where(depth > 0, depth, np.float32(np.nan))
        for folder, image in zip(_FOLDERS, (measurement.image, nothing_is_nan), strict=True):
            yield f"{folder}/image_raw", stamp, encoder.image(stamp, _OPTICAL, image)
            yield f"{folder}/camera_info", stamp, encoder.camera_info(stamp, _OPTICAL, part)

    def measurement(self, role: str, content: Any, pairing: Pairing) -> RgbdImages | None:
        """The measurement that an image or its depth completes."""
        which = _ROLES.index(role)
        said = expected_image(ros_decoding.image(content), self.part) if which == 0 else self._depth(content)
        found = pairing.add(which, ros_decoding.stamp_of(content), said)
        if found is None:
            return None
        stamp, image, depth = found
        if self._table is not None:
            image, depth = resampled_image(image, self._table), nearest(depth, self._table)
        return RgbdImages(stamp, image, depth)

    def _depth(self, content: Any) -> npt.NDArray[np.float32]:
        depth, expected = depth_of(content), self.part.image_shape[:2]
        if depth.shape != expected:
            raise DatasetError(f"a depth image of shape {depth.shape}; expected {expected} as the first one")
        return depth


def depth_of(message: Any) -> npt.NDArray[np.float32]:
    """(H, W) float32 metres of a sensor_msgs/Image, 0 where nothing was measured. Raises DatasetError."""
    if message.encoding not in _DEPTH_UNITS:
        raise DatasetError(f"depth encoded as '{message.encoding}'; expected one of {', '.join(_DEPTH_UNITS)}")
    name, unit = _DEPTH_UNITS[message.encoding]
    kind = np.dtype((">" if message.is_bigendian else "<") + name)
    height, width, step = int(message.height), int(message.width), int(message.step)
    data = np.asarray(message.data, dtype=np.uint8)
    if not (height and width) or step < width * kind.itemsize or len(data) < height * step:
        raise DatasetError(f"depth of {width}x{height} with {len(data)} bytes; expected {height * step}")
    rows = data[: height * step].reshape(height, step)[:, : width * kind.itemsize]
    values = np.ascontiguousarray(rows).view(kind).astype(np.float32)
    if kind.kind == "u":
        values *= np.float32(unit)
    return np.where(np.isfinite(values) & (values > 0), values, np.float32(0))


def nearest(depth: npt.NDArray[np.float32], table: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """(H, W) depths of the pixels nearest to the (H, W, 2) places; 0 where a place lies outside."""
    places = np.nan_to_num(np.rint(table), nan=-1.0)
    columns, rows = places[..., 0], places[..., 1]
    inside = (columns >= 0) & (columns < depth.shape[1]) & (rows >= 0) & (rows < depth.shape[0])
    found = depth[np.where(inside, rows, 0).astype(np.intp), np.where(inside, columns, 0).astype(np.intp)]
    return np.where(inside, found, np.float32(0))


def _alike(one: RgbdCamera, other: RgbdCamera) -> bool:
    """Whether two descriptions mean the same pinhole at the same place, rounding aside."""
    return one.image_shape == other.image_shape and bool(
        abs(one.focal_length - other.focal_length) <= 1e-6 * other.focal_length
        and np.allclose(one.mount.matrix(), other.mount.matrix(), rtol=0, atol=1e-6)
    )
