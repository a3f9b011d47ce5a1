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

from typing import ClassVar

from taskslam.geometry import FloatArray
from taskslam.measurements import Sensor
from taskslam.robot import StereoCamera
from taskslam.slam.base import Kind, MapMode, MethodCard
from taskslam.slam.dsol.settings import DsolSettings
from taskslam.slam.methods.stereo_method import StereoMethod, StereoTracker


class Dsol(StereoMethod):
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
        self.levels, self.gyro = self._settings.levels, self._settings.gyro

    def make_tracker(self, camera: StereoCamera, R_camera_imu: FloatArray | None) -> StereoTracker:
        """Compiled by a made-up drive."""
        from taskslam.slam.dsol.odometry import DsolOdometry  # numba comes with it: not to read a card
        from taskslam.slam.dsol.warm_up import warm_up
        from taskslam.slam.vision.pinhole import Pinhole
        from taskslam.slam.vision.prediction import Prediction

        warm_up(self._settings)
        prediction = Prediction(self._settings.velocity_blend, R_camera_imu)
        return DsolOdometry(self._settings, Pinhole.of(camera), prediction, noisy=camera.noise > 0)
