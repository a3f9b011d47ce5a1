"""`GfGgSlam`: track every pair against the map, and let the map grow where the view has changed.

When it is lost: fewer than `least_inliers` points fit a pose. What becomes of such a pair, `vision/vigil.py` tells;
lost, it is looked for in the keyframes, too. The map is never given up. A camera whose pictures are noisy, and repeat
each other byte for byte, is frozen: they are no measurement either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import Measurement, WheelOdometry
from taskslam.slam.base import Status
from taskslam.slam.gf_gg.frame import Frame, FrameMaker
from taskslam.slam.gf_gg.keyframe_map import KeyframeMap
from taskslam.slam.gf_gg.local_mapping import LocalMapping
from taskslam.slam.gf_gg.loop_closing import LoopClosing
from taskslam.slam.gf_gg.motion import Motion
from taskslam.slam.gf_gg.places import Places
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.gf_gg.tracking import Tracker
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import Pyramid, same_pictures
from taskslam.slam.vision.vigil import Vigil

_LEAST_FIRST = 100  # features with a depth that begin a map
_LEAST_MATCHED = 0.25  # of all features; those of swapped pictures match by chance alone
_LEAST_FOR_KEYFRAME = 15
_PATIENCE_S = 1.0  # with pictures in which no map can begin


@dataclass(frozen=True, slots=True)
class Outcome:
    """T_world_camera: (4, 4), the world being the first left camera, optical axes.

    inliers: points of the map that fit the pose. keyframe: whether the pair became one.
    """

    T_world_camera: FloatArray
    status: Status
    inliers: int = 0
    keyframe: bool = False


class GfGgSlam:
    """Stereo SLAM of pictures of one size. noisy: whether two pictures of the same thing must differ."""

    def __init__(
        self, settings: GfGgSettings, pinhole: Pinhole, width: int, height: int, motion: Motion, noisy: bool = False
    ) -> None:
        s = self._settings = settings
        self._pinhole, self.motion, self._noisy = pinhole, motion, noisy
        self._maker = FrameMaker(s, pinhole)
        self.map = KeyframeMap(s.features, s.scale, s.levels)
        self._mapping = LocalMapping(s, pinhole, width, height, self.map)
        self._places = Places()
        self._tracker = Tracker(s, pinhole, self.map, self._mapping, self._places)
        self.loops = LoopClosing(s, pinhole, self.map, self._mapping, self._places)
        self._last: Frame | None = None
        self._frames = self._keyframe_at = 0
        self._T_world_camera = np.eye(4)
        self._stamp: int | None = None
        self._vigil = Vigil(s.lost_after, _PATIENCE_S)
        self._before: tuple[Pyramid, Pyramid] | None = None

    def hear(self, measurement: Measurement) -> None:
        """Take in wheel odometry, stamped after that before; pass over all else."""
        if isinstance(measurement, WheelOdometry):
            self.motion.hear(measurement)

    def process(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], stamp: int) -> Outcome:
        """Take in a pair of (H, W) or (H, W, 3) images, stamped in ns, after those before."""
        self._frames += 1
        pair = (left.copy(),), (right.copy(),)
        frozen, self._before = self._noisy and same_pictures(self._before, pair), pair
        frame = self._maker.make(left, right, stamp)
        self._stamp = stamp if self._stamp is None else self._stamp
        since, self._stamp = self._stamp, stamp
        motions = self.motion.expected(since, stamp)
        if self._last is None:
            return self._wait(frame, motions[0], frozen)
        status = self._vigil.misses(stamp)
        lost = status is Status.LOST
        inliers = 0
        if not frozen:
            select = self._settings.good_features and self._frames > self._settings.full_frames
            predictions = [self._T_world_camera @ motion for motion in motions]
            inliers = self._tracker.track(frame, self._last, predictions, select)
            if not inliers and lost:
                inliers = self._tracker.relocalise(frame)
        if not inliers:
            if lost:
                self.motion.rest()
            else:
                self._T_world_camera = self._T_world_camera @ motions[0]
            return Outcome(self._T_world_camera, status)
        self.motion.learn(invert_se3(self._T_world_camera) @ invert_se3(frame.T_camera_world), since, stamp, lost)
        added = self._wants_keyframe(frame, inliers)
        if added:
            self._add_keyframe(frame)
        return self._fitted(frame, inliers, added)

    def _wait(self, frame: Frame, motion: FloatArray, frozen: bool) -> Outcome:
        """Begin the map with this pair, if enough of its features have a depth, and if it is known where it is.

        That is so at the start, and as long as the wheels are heard; a map that began later would begin at a place that
        nobody knows.
        """
        self._T_world_camera = self._T_world_camera @ motion
        status = self._vigil.misses(frame.stamp)
        matched = int(np.count_nonzero(np.isfinite(frame.features.seen[:, 2])))
        enough = matched >= max(_LEAST_FIRST, _LEAST_MATCHED * len(frame))
        if frozen or not enough or (status is Status.LOST and not self.motion.by_wheels):
            return Outcome(self._T_world_camera, status)
        frame.T_camera_world = invert_se3(self._T_world_camera)
        self._add_keyframe(frame)
        return self._fitted(frame, 0, True)

    def _wants_keyframe(self, frame: Frame, inliers: int) -> bool:
        """Whether the view has changed: fewer points than the reference shows, or too few near ones.

        Mur-Artal and Tardos 2017, section III.E, and their release.
        """
        s, slam_map = self._settings, self.map
        if self._frames - self._keyframe_at < s.keyframe_gap or inliers <= _LEAST_FOR_KEYFRAME:
            return False
        shown = slam_map.point_of[self._tracker.reference]
        least = 2 if len(slam_map.keyframes()) > 2 else 1
        expected = np.count_nonzero(slam_map.observers[shown[shown >= 0]] >= least)
        near = frame.depths(self._pinhole) <= s.close_depth * self._pinhole.baseline
        tracked = np.count_nonzero(near & (frame.points >= 0))
        untracked = np.count_nonzero(near & (frame.points < 0))
        starved = tracked < s.close_tracked and untracked > s.close_untracked
        return bool(inliers < s.keyframe_ratio * expected or starved)

    def _add_keyframe(self, frame: Frame) -> None:
        bag, groups = self._places.words.describe(frame.features.descriptors)
        k = self.map.add_keyframe(frame, groups)
        self._places.keep(k, bag)
        self._mapping.add_stereo_points(k, frame)
        s = self._settings
        ahead = self.motion.ahead(s.virtual_frame_ahead) if s.virtual_frame_ahead else None
        self._mapping.process(k, None if ahead is None else invert_se3(ahead))
        if s.loop_closing:
            self.loops.process(k)
        frame.points = self.map.point_of[k, : len(frame)].copy()
        frame.T_camera_world = self.map.T_camera_world[k].copy()
        self._tracker.reference, self._keyframe_at = k, self._frames

    def _fitted(self, frame: Frame, inliers: int, added: bool) -> Outcome:
        self._last = frame
        self._vigil.fits(frame.stamp)
        self._T_world_camera = invert_se3(frame.T_camera_world)
        return Outcome(self._T_world_camera, Status.TRACKING, inliers, added)
