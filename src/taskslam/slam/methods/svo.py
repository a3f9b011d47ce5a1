"""`svo`: semi-direct visual odometry, stereo, an independent implementation of Forster et al., T-RO 2017.

Christian Forster, Zichao Zhang, Michael Gassner, Manuel Werlberger and Davide Scaramuzza, "SVO: Semidirect Visual
Odometry for Monocular and Multicamera Systems", IEEE Transactions on Robotics 33(2), 2017; written from the paper, with
the constants of its authors' stereo release (`slam/svo/settings.py`). A pair is aligned directly with the features of
the last one; then the points of the nearest keyframes are looked for one by one, the pose is refined on where they were
found, and their depths learn from it. A keyframe brings new corners and edgelets, whose depth the second camera tells.
Odometry: no backend adjusts its keyframes, no loop is closed.

Where it differs from the authors' release, and why:

- Features whose depth the two cameras do not tell are left out, edgelets along the rows among them: no filter is
  started from a guess. Every other depth is filtered as in the paper.
- Sparse alignment compares crosses of five pixels (`slam/vision/patches.py`), in both images.
- Gain and offset of the light are estimated wherever patches are compared: this robot's cameras adapt to the light.
- It says when it is lost (`slam/vision/vigil.py`), and relocalises in its last keyframes alone.
- Budgets are iterations, so that the same input gives the same bytes.
"""

from __future__ import annotations

from typing import ClassVar

from taskslam.geometry import FloatArray
from taskslam.measurements import Sensor
from taskslam.robot import StereoCamera
from taskslam.slam.base import Kind, MapMode, MethodCard
from taskslam.slam.methods.stereo_method import StereoMethod, StereoTracker
from taskslam.slam.option_settings import read_options
from taskslam.slam.svo.settings import SvoSettings


class Svo(StereoMethod):
    """Semi-direct stereo odometry. Options: the fields of `SvoSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="svo",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.STEREO_IMAGES,),
        summary="independent implementation of SVO (Forster et al., T-RO 2017): semi-direct stereo odometry",
        map_mode=MapMode.NONE,
        deterministic=True,
        latency=0.012,
        queue=1,
        homepage="https://rpg.ifi.uzh.ch/svo2.html",
    )

    def __init__(self, **options: object) -> None:
        self._settings = read_options(SvoSettings, "svo", options)
        self.levels = self._settings.align_coarsest + 1

    def make_tracker(self, camera: StereoCamera, R_camera_imu: FloatArray | None) -> StereoTracker:
        """Compiled by a made-up drive."""
        from taskslam.slam.svo.odometry import SvoOdometry  # numba comes with it: not to read a card
        from taskslam.slam.svo.warm_up import warm_up
        from taskslam.slam.vision.pinhole import Pinhole
        from taskslam.slam.vision.prediction import Prediction

        warm_up(self._settings)
        prediction = Prediction(self._settings.velocity_blend, R_camera_imu)
        return SvoOdometry(self._settings, Pinhole.of(camera), prediction, noisy=camera.noise > 0)
