"""What our stereo methods have in common as guests: the camera of the rig, its size, its mount, and the gyro's."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import Measurement, StereoImages
from taskslam.robot import SensorRig, StereoCamera
from taskslam.slam.base import PoseEstimate, SlamMethod, Status
from taskslam.slam.needs import need_stereo
from taskslam.slam.registry import unavailable

_LEAST_SIDE = 15  # pixels on the coarsest level: the window of the stereo matcher and room to move it


class Found(Protocol):
    """What came of a pair. T_world_camera: (4, 4), the world being the first left camera, optical axes."""

    @property
    def T_world_camera(self) -> FloatArray:  # noqa: N802
        """Of the left camera."""

    @property
    def status(self) -> Status:
        """How sure it is of that."""


class StereoTracker(Protocol):
    """A stereo method at work."""

    def hear(self, measurement: Measurement) -> None:
        """Take in what says how the camera moves between two pairs, if it is used; pass over all else."""

    def process(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], stamp: int) -> Found:
        """Take in a pair of (H, W) or (H, W, 3) images, stamped in ns, after those before."""


class StereoMethod(SlamMethod):
    """A method around a `StereoTracker`.

    levels: of the pyramid that disparities come from; gyro: whether the IMU, if there is one, is heard.
    """

    levels: int
    gyro: bool = False
    _tracker: StereoTracker | None = None

    @abstractmethod
    def make_tracker(self, camera: StereoCamera, R_camera_imu: FloatArray | None) -> Any:
        """The compiled tracker of this camera; (3, 3) rotation to its optical axes from the IMU's, if that is heard."""

    def start(self, rig: SensorRig) -> None:
        """Begin with nothing seen.

        Raises:
            InputError: no stereo camera, or pictures too small for the pyramid.
            MethodUnavailableError: a package of the method's extra is not installed; names the extra.
        """
        name = self.card.name
        camera, smallest = need_stereo(name, rig), _LEAST_SIDE << (self.levels - 1)
        if min(camera.width, camera.height) < smallest:
            raise InputError(
                f"{name}: pictures of {camera.width} x {camera.height} are too small for {self.levels} levels; expected"
                f" at least {smallest} pixels a side"
            )
        self._T_base_camera: FloatArray = camera.mount.matrix() @ OPTICAL_IN_BODY
        self._T_camera_base: FloatArray = np.linalg.inv(self._T_base_camera)
        imu = rig.imu if self.gyro else None
        R_camera_imu = None if imu is None else self._T_camera_base[:3, :3] @ imu.mount.matrix()[:3, :3]
        self._shape = (camera.height, camera.width)
        try:
            self._tracker = self.make_tracker(camera, R_camera_imu)
        except ModuleNotFoundError as error:
            raise unavailable(name, self.card, error) from error

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every pair, else None. Raises InputError: pictures of another size than the rig's."""
        name, tracker = self.card.name, self._tracker
        if tracker is None:
            raise InputError(f"{name}: call start before feed")
        if not isinstance(measurement, StereoImages):
            tracker.hear(measurement)
            return None
        if not measurement.left.shape[:2] == measurement.right.shape[:2] == self._shape:
            raise InputError(
                f"{name}: pictures of {measurement.left.shape[:2]} and {measurement.right.shape[:2]} pixels, rows"
                f" first; expected {self._shape} of both, as the sensor rig says"
            )
        found = tracker.process(measurement.left, measurement.right, measurement.stamp)
        T_start_base = self._T_base_camera @ found.T_world_camera @ self._T_camera_base
        return PoseEstimate(measurement.stamp, T_start_base, found.status)
