"""`dsol`: direct sparse odometry on stereo images, an independent implementation of Qu et al., IROS 2022.

Chao Qu, Shreyas S. Shivakumar, Ian D. Miller and Camillo J. Taylor, "DSOL: A Fast Direct Sparse Odometry Scheme"
(arXiv 2203.08182); written from the paper, with the constants of its authors' release and of the benchmark's runs
(`slam/dsol/settings.py`). Every pair is aligned, from the coarsest level of its pyramid to the finest, with the points
of a window of five keyframes; where the view has changed, the pair becomes a keyframe, stereo matching gives its points
a depth, and a photometric bundle adjustment puts the window right (`slam/dsol/odometry.py`). Odometry: it closes no
loop, and drifts by centimetres in a house.

The gyro, where the robot has one, predicts the rotation between two pairs, as the benchmark's runs had it (option
`gyro`). The preset `paper` has the benchmark's settings; `indoor` adds keyframes sooner (`keyframe_ratio` 0.8 for 0.4),
which halves the error in rooms at twice the time.

Where it differs from the published runs, and why:

- The gain of the exposure is estimated with the pose (option `gain`): this robot's cameras adapt to the light as real
  ones do, Gazebo's do not. Without, a turn towards a window is the end.
- It says when it is lost, and tries other predictions first (`slam/dsol/odometry.py`). The original never does.
- Budgets are iterations, so that the same input gives the same bytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import ImuSamples, Measurement, Sensor, StereoImages
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod
from taskslam.slam.dsol.settings import DsolSettings

if TYPE_CHECKING:
    from taskslam.slam.dsol.odometry import DsolOdometry


class Dsol(SlamMethod):
    """Direct sparse stereo odometry. Options: the fields of `DsolSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="dsol",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.STEREO_IMAGES,),
        optional_sensors=(Sensor.IMU,),
        summary="independent implementation of DSOL (Qu et al., IROS 2022): direct sparse stereo odometry",
        map_mode=MapMode.NONE,
        deterministic=True,
        latency=0.015,
        queue=1,
        homepage="https://arxiv.org/abs/2203.08182",
    )

    def __init__(self, **options: object) -> None:
        self._settings = DsolSettings.from_options(options)
        self._odometry: DsolOdometry | None = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty window. Raises InputError: no stereo camera, or pictures too small for the pyramid."""
        if rig.stereo is None:
            raise InputError("dsol needs a stereo camera, and this robot's sensor rig has none (rig.stereo)")
        camera, s = rig.stereo, self._settings
        smallest = _LEAST_SIDE << (s.levels - 1)
        if min(camera.width, camera.height) < smallest:
            raise InputError(
                f"dsol: pictures of {camera.width} x {camera.height} are too small for {s.levels} levels (option"
                f" 'levels'); expected at least {smallest} pixels a side"
            )
        from taskslam.slam.dsol.odometry import DsolOdometry  # numba comes with it: not to read a card
        from taskslam.slam.dsol.prediction import Prediction
        from taskslam.slam.dsol.warm_up import warm_up
        from taskslam.slam.vision.pinhole import Pinhole

        warm_up(s)
        self._T_base_camera: FloatArray = camera.mount.matrix() @ OPTICAL_IN_BODY
        self._T_camera_base: FloatArray = np.linalg.inv(self._T_base_camera)
        gyro = rig.imu if s.gyro else None
        R_camera_imu = None if gyro is None else self._T_camera_base[:3, :3] @ gyro.mount.matrix()[:3, :3]
        self._shape = (camera.height, camera.width)
        prediction = Prediction(s.velocity_blend, R_camera_imu)
        self._odometry = DsolOdometry(s, Pinhole.of(camera), prediction, noisy=camera.noise > 0)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every pair; None for the IMU. Raises InputError: pictures of another size than the rig's."""
        if self._odometry is None:
            raise InputError("dsol: call start before feed")
        if isinstance(measurement, ImuSamples):
            self._odometry.prediction.hear(measurement)
        if not isinstance(measurement, StereoImages):
            return None
        if not measurement.left.shape[:2] == measurement.right.shape[:2] == self._shape:
            raise InputError(
                f"dsol: pictures of {measurement.left.shape[:2]} and {measurement.right.shape[:2]} pixels, rows first;"
                f" expected {self._shape} of both, as the sensor rig says"
            )
        outcome = self._odometry.process(measurement.left, measurement.right, measurement.stamp)
        T_start_base = self._T_base_camera @ outcome.T_world_camera @ self._T_camera_base
        return PoseEstimate(measurement.stamp, T_start_base, outcome.status)


_LEAST_SIDE = 15  # pixels on the coarsest level: the window of the stereo matcher and room to move it
