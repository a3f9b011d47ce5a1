"""`gf_gg`: stereo SLAM with good features and good graph, an independent implementation of Zhao and Vela, T-RO 2020.

Yipu Zhao and Patricio A. Vela, "Good Feature Matching: Toward Accurate, Robust VO/VSLAM With Low Latency", IEEE T-RO
36(3), 2020; Yipu Zhao, Justin S. Smith and Patricio A. Vela, "Good Graph to Optimize: Cost-Effective, Budget-Aware
Bundle Adjustment in Visual SLAM", 2020 (arXiv 2008.10123); both stand on Raul Mur-Artal and Juan D. Tardos,
"ORB-SLAM2", IEEE T-RO 33(5), 2017. Written from the papers, with the constants of their authors' releases and of the
benchmark's runs (`slam/gf_gg/settings.py`).

ORB features of the left picture, each with a disparity where there is one, are matched against a map of points and
keyframes (`slam/gf_gg/slam.py`). Of the points that could be seen those are looked for that determine the pose best
(`good_features.py`); of the keyframes around, where they are more than the budget, those are adjusted that determine
the most (`good_graph.py`). With the options `good_features=false` and `good_graph=false` what remains is
ORB-SLAM2-like, so that what the two bring can be seen. The map is kept while the method runs: lost, it is found again
in any keyframe.

Where it differs from the published method, and why:

- Budgets are counted in keyframes and iterations and not in milliseconds, mapping is a step and no thread, and the
  draws are seeded, so that the same input gives the same bytes.
- Disparities come from correlation, from coarse to fine (`slam/vision/stereo_matching.py`), not from ORB in both.
- Features are spread by cells of the picture, not by a quadtree.
- The vocabulary is the one that comes with this package (`slam/orb/vocabulary.py`).
- A pair is no measurement if its pictures repeat those before, byte for byte, though they are noisy.
- `odometry_prior`: the wheels predict the motion between two pairs. Off as in the published runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import Measurement, Sensor, StereoImages, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.registry import unavailable

if TYPE_CHECKING:
    from taskslam.slam.gf_gg.slam import GfGgSlam

_LEAST_SIDE = 120  # pixels: fifteen on the coarsest level of the stereo matcher


class GfGg(SlamMethod):
    """Stereo SLAM. Options: the fields of `GfGgSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="gf_gg",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.SLAM,
        sensors=(Sensor.STEREO_IMAGES,),
        optional_sensors=(Sensor.WHEEL_ODOMETRY,),
        summary="independent implementation of good features and good graph (Zhao and Vela 2020): stereo SLAM with ORB",
        map_mode=MapMode.CONTINUE,
        deterministic=True,
        latency=0.033,
        queue=1,
        homepage="https://arxiv.org/abs/2008.10123",
        extra="gf-gg",
    )

    def __init__(self, **options: object) -> None:
        self._settings = GfGgSettings.from_options(options)
        self._slam: GfGgSlam | None = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map.

        Raises:
            InputError: no stereo camera, or pictures too small.
            MethodUnavailableError: OpenCV is not installed.
        """
        if rig.stereo is None:
            raise InputError("gf_gg needs a stereo camera, and this robot's sensor rig has none (rig.stereo)")
        camera, s = rig.stereo, self._settings
        if min(camera.width, camera.height) < _LEAST_SIDE:
            raise InputError(
                f"gf_gg: pictures of {camera.width} x {camera.height} are too small; expected at least {_LEAST_SIDE}"
                f" pixels a side"
            )
        from taskslam.slam.gf_gg.motion import Motion  # numba comes with these: not to read a card
        from taskslam.slam.gf_gg.slam import GfGgSlam
        from taskslam.slam.gf_gg.warm_up import warm_up
        from taskslam.slam.vision.pinhole import Pinhole

        try:
            warm_up(s)
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        self._T_base_camera: FloatArray = camera.mount.matrix() @ OPTICAL_IN_BODY
        self._T_camera_base: FloatArray = np.linalg.inv(self._T_base_camera)
        self._shape = (camera.height, camera.width)
        motion = Motion(s.velocity_blend, self._T_base_camera if s.odometry_prior else None)
        noisy = camera.noise > 0
        self._slam = GfGgSlam(s, Pinhole.of(camera), camera.width, camera.height, motion, noisy)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every pair, else None. Raises InputError: pictures of another size than the rig's."""
        if self._slam is None:
            raise InputError("gf_gg: call start before feed")
        if isinstance(measurement, WheelOdometry):
            self._slam.motion.hear(measurement)
        if not isinstance(measurement, StereoImages):
            return None
        if not measurement.left.shape[:2] == measurement.right.shape[:2] == self._shape:
            raise InputError(
                f"gf_gg: pictures of {measurement.left.shape[:2]} and {measurement.right.shape[:2]} pixels, rows first;"
                f" expected {self._shape} of both, as the sensor rig says"
            )
        outcome = self._slam.process(measurement.left, measurement.right, measurement.stamp)
        T_start_base = self._T_base_camera @ outcome.T_world_camera @ self._T_camera_base
        return PoseEstimate(measurement.stamp, T_start_base, outcome.status)
