"""The stereo camera in bags: an Image and a CameraInfo for left and right, rectified on the way if they are raw."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from taskslam.datasets import bag_rig, ros_decoding
from taskslam.datasets.bag_sensor import BagSensor, Recording
from taskslam.datasets.ros_encoding import RosEncoder, Said
from taskslam.datasets.stamp_order import Pairing
from taskslam.datasets.stereo_rectification import Rectifier, same_camera
from taskslam.errors import DatasetError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import StereoImages
from taskslam.robot import Camera, StereoCamera

_SIDES = ("left", "right")
_OPTICAL = ("left_camera_optical_frame", "right_camera_optical_frame")


class Pairs(BagSensor):
    """A stereo camera."""

    def __init__(self, recording: Recording, given: StereoCamera | None) -> None:
        topics = [recording.topic(side) for side in _SIDES]
        infos = [info_beside(topic) for topic in topics]
        self._rectifier: Rectifier | None = None
        first = recording.first(topics[0])
        image = ros_decoding.image(first[0])
        if not all(map(recording.has, infos)):
            if given is None:
                raise DatasetError(
                    f"The images have no {' and '.join(infos)}, so their cameras cannot be told: give --robot"
                )
            self.part: StereoCamera = given
            return
        left, right = (recording.first(info)[0] for info in infos)
        calibrated = bag_rig.cameras(left, right, topics[0], recording.frames, first[0].header.frame_id)
        self._rectifier = Rectifier(*calibrated, bag_rig.rate_of(first), image.ndim == 3)
        camera = self._rectifier.camera
        self.part = given if given is not None and same_camera(camera, given) else camera

    @staticmethod
    def frames(part: StereoCamera) -> list[tuple[str, FloatArray]]:
        """Both optical frames."""
        found = []
        for eye, frame in enumerate(_OPTICAL):
            beside = np.eye(4)
            beside[1, 3] = -part.baseline * eye
            found.append((frame, part.mount.matrix() @ beside @ OPTICAL_IN_BODY))
        return found

    @staticmethod
    def messages(encoder: RosEncoder, part: StereoCamera, measurement: StereoImages) -> Iterator[Said]:
        """Both images, each with its camera."""
        stamp = measurement.stamp
        for eye, image in enumerate((measurement.left, measurement.right)):
            folder, frame = f"/stereo/{_SIDES[eye]}", _OPTICAL[eye]
            yield f"{folder}/image_rect", stamp, encoder.image(stamp, frame, image)
            yield f"{folder}/camera_info", stamp, encoder.camera_info(stamp, frame, part, part.baseline * eye)

    def measurement(self, role: str, content: Any, pairing: Pairing) -> StereoImages | None:
        """The pair that an image completes."""
        image = expected_image(ros_decoding.image(content), self.part)
        pair = pairing.add(_SIDES.index(role), ros_decoding.stamp_of(content), image)
        if pair is None:
            return None
        stamp, left, right = pair
        return StereoImages(stamp, *(self._rectifier(left, right) if self._rectifier else (left, right)))


def info_beside(topic: str) -> str:
    """The topic of the CameraInfo of an image topic."""
    return topic.rsplit("/", 1)[0] + "/camera_info"


def expected_image(image: ros_decoding.Image, camera: Camera) -> ros_decoding.Image:
    """The image, of the size and kind of the first one. Raises DatasetError."""
    if image.shape != camera.image_shape:
        raise DatasetError(f"an image of shape {image.shape}; expected {camera.image_shape} as the first one")
    return image
