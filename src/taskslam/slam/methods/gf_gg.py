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

from typing import ClassVar

from taskslam.geometry import FloatArray
from taskslam.measurements import Sensor
from taskslam.robot import StereoCamera
from taskslam.slam.base import Kind, MapMode, MethodCard
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.methods.stereo_method import StereoMethod, StereoTracker


class GfGg(StereoMethod):
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

    levels = 4  # of the stereo matcher's pyramid; the options count those of the ORB features

    def __init__(self, **options: object) -> None:
        self._settings = GfGgSettings.from_options(options)

    def make_tracker(self, camera: StereoCamera, R_camera_imu: FloatArray | None) -> StereoTracker:  # noqa: ARG002
        """With an empty map, compiled by a made-up drive."""
        from taskslam.slam.gf_gg.motion import Motion  # numba comes with these: not to read a card
        from taskslam.slam.gf_gg.slam import GfGgSlam
        from taskslam.slam.gf_gg.warm_up import warm_up
        from taskslam.slam.vision.pinhole import Pinhole

        s = self._settings
        warm_up(s)
        motion = Motion(s.velocity_blend, self._T_base_camera if s.odometry_prior else None)
        return GfGgSlam(s, Pinhole.of(camera), camera.width, camera.height, motion, noisy=camera.noise > 0)
