"""`orb_slam3_rgbd`: ORB-SLAM3 on an RGB-D camera: an image and the depth of its pixels instead of a second image.

All else is as in `orb_slam3.py`: which poses count, pacing, vocabulary. A point is taken into the map from one frame
alone where it is nearer than 60 baselines, 3 m for a D435i: beyond that its depth is worth little.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

from taskslam.measurements import Sensor
from taskslam.robot import Camera, SensorRig
from taskslam.slam.base import MethodCard
from taskslam.slam.methods.orb_slam3 import OrbSlam3
from taskslam.slam.orb.settings_file import OrbSettings

_CLOSE_DEPTH = 60.0


class OrbSlam3Rgbd(OrbSlam3):
    """Options: as of `OrbSlam3`."""

    card: ClassVar[MethodCard] = replace(
        OrbSlam3.card,
        name="orb_slam3_rgbd",
        sensors=(Sensor.RGBD_IMAGES,),
        summary="ORB-SLAM3 itself (pyorbslam3): RGB-D, keyframes, bundle adjustment, loop closing, several maps",
    )
    _mode = "RGBD"

    def __init__(
        self,
        vocabulary: str = "",
        features: int = OrbSettings.features,
        fast_threshold: int = OrbSettings.fast_threshold,
        lowest_fast_threshold: int = OrbSettings.lowest_fast_threshold,
        close_depth: float = _CLOSE_DEPTH,
    ) -> None:
        super().__init__(vocabulary, features, fast_threshold, lowest_fast_threshold, close_depth)

    def _camera(self, rig: SensorRig) -> Camera | None:
        return rig.rgbd

    def _track(self, images: Any, seconds: float) -> Any:
        return self._slam.track_rgbd(images.image, images.depth, seconds)
