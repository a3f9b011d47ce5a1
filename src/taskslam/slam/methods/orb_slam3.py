"""`orb_slam3`: the adapter of pyorbslam3, which is ORB-SLAM3 (Campos et al. 2021) with a Python interface; stereo.

The pose belongs to the stamp of the image pair. A pose counts only if the tracker says `OK` and the map is the one that
began at the start (`orb/start_map.py`): while it relocalises, the package goes on to give poses metres away, and after
three seconds it begins a new map with a new origin. Both are `lost` here, never a jump.

Settings are those of the paper's runs in simulation (protocol 1.3): 800 features on 8 levels, FAST 20/7. A lower
threshold of 12/5 tracks no better on rendered images and lets more noise in.

The card's latency is what a pair takes on two cores of this decade. It is below the 33 ms between two frames of the
published cameras, so none is skipped: image-to-image rotation of more than some 6 degrees is what loses ORB-SLAM3. On a
robot that is slower than that (`measured` with a `cpu_scale`) the newest pair wins, as in the authors' ROS node, whose
subscribers have a queue of one.

Not deterministic: mapping and loop closing run in threads of their own; `pacing.py` keeps them in step with simulated
time. Maps are not saved: a loaded map is only merged by chance later, with poses from a new origin until then.

Its loop closer divides by a rotation and would end the process where that is zero: `orb/equal_views.py` guards it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import NANOSECONDS, Measurement, Sensor
from taskslam.robot import Camera, SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.orb.equal_views import EqualViews
from taskslam.slam.orb.settings_file import OrbSettings, write_settings
from taskslam.slam.orb.start_map import StartMap
from taskslam.slam.orb.system_libraries import install_command, missing_libraries
from taskslam.slam.orb.vocabulary import check_text, shipped_vocabulary, write_text
from taskslam.slam.registry import one_line

VOCABULARY_VARIABLE = "PYORBSLAM3_VOCAB"
_STILL_START_S = 1.0


class OrbSlam3(SlamMethod):
    """Options: vocabulary (a file in the format of ORBvoc.txt; default: PYORBSLAM3_VOCAB, or the shipped one).

    And those of `OrbSettings`: features, fast_threshold, lowest_fast_threshold, close_depth.
    """

    card: ClassVar[MethodCard] = MethodCard(
        name="orb_slam3",
        version="1.1",
        licence="GPL-3.0-only",
        kind=Kind.SLAM,
        sensors=(Sensor.STEREO_IMAGES,),
        summary="ORB-SLAM3 itself (pyorbslam3): stereo, keyframes, bundle adjustment, loop closing, several maps",
        needs_still_start=_STILL_START_S,
        map_mode=MapMode.CONTINUE,
        deterministic=False,
        asynchronous=True,
        latency=0.033,
        queue=1,
        homepage="https://github.com/Vulcan758/pyorbslam3",
        extra="orb-slam3",
    )

    _mode = "STEREO"  # of the package's sensors

    def __init__(
        self,
        vocabulary: str = "",
        features: int = OrbSettings.features,
        fast_threshold: int = OrbSettings.fast_threshold,
        lowest_fast_threshold: int = OrbSettings.lowest_fast_threshold,
        close_depth: float = OrbSettings.close_depth,
    ) -> None:
        self._vocabulary = vocabulary or os.environ.get(VOCABULARY_VARIABLE, "")
        self._settings = OrbSettings(features, fast_threshold, lowest_fast_threshold, close_depth)
        self._slam: Any = None
        self._views: EqualViews | None = None

    def start(self, rig: SensorRig) -> None:
        """Load vocabulary and camera.

        Raises:
            MethodUnavailableError: a system library that the package needs is absent.
            InputError: the vocabulary cannot be used, or the robot has no such camera.
        """
        camera = self._camera(rig)
        if camera is None:
            raise InputError(f"{self.card.name} needs {', '.join(self.card.sensors)}, which the robot has not")
        package = _package()
        scratch = Path.cwd()
        settings = scratch / "orb-slam3.yaml"
        write_settings(settings, camera, self._settings)
        self._views = _guard(package)
        self._slam = package.Slam(self._vocabulary_file(scratch), str(settings), getattr(package.Sensor, self._mode))
        self._tracked_state = package.TrackingState.OK
        self._map = StartMap(self._slam, scratch / "keyframes.tum")
        self._T_base_optical: FloatArray = camera.mount.matrix() @ OPTICAL_IN_BODY
        self._T_optical_base: FloatArray = np.linalg.inv(self._T_base_optical)
        self._T_start_base: FloatArray = np.eye(4)
        self._first_stamp: int | None = None
        self._origin_known = True

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """Track the images of one instant."""
        if measurement.sensor not in self.card.sensors:
            return None
        stamp = measurement.stamp
        if self._first_stamp is None:
            self._first_stamp = stamp
        result = self._track(measurement, stamp / NANOSECONDS)
        tracked = result.state == self._tracked_state and result.pose_wc is not None
        if tracked and not self._map.began:
            # A map that begins later begins where the robot has driven to, and nobody knows where that is.
            self._origin_known = stamp - self._first_stamp <= _STILL_START_S * NANOSECONDS
        if self._map.holds(tracked, stamp) and self._origin_known:
            T_start_camera = np.asarray(result.pose_wc, dtype=np.float64)
            self._T_start_base = self._T_base_optical @ T_start_camera @ self._T_optical_base
            return PoseEstimate(stamp, self._T_start_base, Status.TRACKING)
        status = Status.LOST if self._map.began else Status.STARTING
        return PoseEstimate(stamp, self._T_start_base, status)

    def stop(self) -> None:
        """Let its threads end."""
        if self._slam is not None:
            self._slam.shutdown()
        if self._views is not None and self._views.happened:
            sys.stdout.write(f"guesses of a loop without rotation, which would have aborted: {self._views.happened}\n")

    def _camera(self, rig: SensorRig) -> Camera | None:
        return rig.stereo

    def _track(self, images: Any, seconds: float) -> Any:
        return self._slam.track_stereo(images.left, images.right, seconds)

    def _vocabulary_file(self, scratch: Path) -> str:
        if self._vocabulary:
            check_text(Path(self._vocabulary))
            return self._vocabulary
        file = scratch / "vocabulary.txt"
        write_text(shipped_vocabulary(), file)
        return str(file)


def _package() -> Any:
    try:
        import pyorbslam3
    except ModuleNotFoundError:
        raise
    except ImportError as error:
        if missing := missing_libraries():
            remedy = f"system libraries {', '.join(missing)}, which are not installed: {install_command(missing)}"
            raise MethodUnavailableError(f"ORB-SLAM3 needs the {remedy}") from error
        raise MethodUnavailableError(f"ORB-SLAM3: pyorbslam3 cannot be loaded: {one_line(error)}") from error
    return pyorbslam3


def _guard(package: Any) -> EqualViews | None:
    try:
        return EqualViews(Path(package._core.__file__))
    except (AttributeError, OSError, ValueError) as error:  # a build that binds its functions in another way
        sys.stdout.write(f"the loop closer is not guarded against views without rotation: {one_line(error)}\n")
        return None
