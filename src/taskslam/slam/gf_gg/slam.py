"""`GfGgSlam`: track every pair against the map, and let the map grow where the view has changed.

A pair is tracked in steps: its features; where the camera should be by now; the points of the last pair, found where
they should be, and the pose from them; the points of the map around, good ones first, and the pose from all that were
found; the other points, once the pose is out; and a keyframe where too little of what is seen is known.

When it is lost: fewer than `least_inliers` points fit a pose. Such a pair is no measurement; the camera is taken to go
on as it did for `lost_after` seconds, and is lost then, standing, until a pair is tracked or a keyframe is recognised.
A camera whose pictures are noisy, and repeat each other byte for byte, is frozen: they are no measurement either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS
from taskslam.slam.base import Status
from taskslam.slam.bundle.stereo_pose import fits_pose, solve_stereo_pose
from taskslam.slam.bundle.three_point_pose import draw_pose
from taskslam.slam.gf_gg.frame import Frame, FrameMaker
from taskslam.slam.gf_gg.good_features import match_good, pose_information
from taskslam.slam.gf_gg.keyframe_map import KeyframeMap
from taskslam.slam.gf_gg.local_mapping import LocalMapping
from taskslam.slam.gf_gg.loop_closing import LoopClosing
from taskslam.slam.gf_gg.motion import Motion
from taskslam.slam.gf_gg.places import Places, match_by_words
from taskslam.slam.gf_gg.search import Views, search
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.vision.binary_words import Words
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
_LEAST_FIRST = 100  # features with a depth that begin a map
_LEAST_MATCHED = 0.25  # of all features; those of swapped pictures match by chance alone
_FEW, _LEAST = 20, 10  # matches with the last frame: where they are few it is looked further, of fewer nothing follows
_LEAST_FOR_KEYFRAME = 15
_LEAST_BY_WORDS = 15
_ALIKE = 0.75  # of the second best, by which a match of words must be better
_RECENT_S = 1.0  # after a relocalisation, in which more points are asked for
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
        self.loops = LoopClosing(s, pinhole, self.map, self._mapping, self._places)
        self._last: Frame | None = None
        self._reference = -1
        self._frames = self._keyframe_at = 0
        self._T_world_camera = np.eye(4)
        self._stamp: int | None = None
        self._fitted_at: int | None = None
        self._relocalised_at: int | None = None
        self._before: tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]] | None = None

    def process(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], stamp: int) -> Outcome:
        """Take in a pair of (H, W) or (H, W, 3) images, stamped in ns, after those before."""
        self._frames += 1
        frozen = self._repeats(left, right)
        frame = self._maker.make(left, right, stamp)
        self._fitted_at = stamp if self._fitted_at is None else self._fitted_at
        self._stamp = stamp if self._stamp is None else self._stamp
        since, self._stamp = self._stamp, stamp
        if self._last is None:
            return self._outcome(stamp) if frozen or not self._begin(frame) else self._fitted(frame, 0, True)
        motions = self.motion.expected(since, stamp)
        lost = self._is_lost(stamp)
        inliers = 0
        if not frozen:
            inliers = self._track(frame, [self._T_world_camera @ motion for motion in motions])
            if not inliers and lost:
                inliers = self._relocalise(frame)
        if not inliers:
            if not lost:
                self._T_world_camera = self._T_world_camera @ motions[0]
            return self._outcome(stamp)
        self.motion.learn(invert_se3(self._T_world_camera) @ invert_se3(frame.T_camera_world), since, stamp, lost)
        added = self._wants_keyframe(frame, inliers)
        if added:
            self._add_keyframe(frame)
        return self._fitted(frame, inliers, added)

    def _begin(self, frame: Frame) -> bool:
        """Begin the map with this pair, if enough of its features have a depth."""
        matched = int(np.count_nonzero(np.isfinite(frame.features.seen[:, 2])))
        if matched < max(_LEAST_FIRST, _LEAST_MATCHED * len(frame)):
            return False
        frame.T_camera_world = invert_se3(self._T_world_camera)
        self._add_keyframe(frame)
        return True

    def _track(self, frame: Frame, predictions: list[FloatArray]) -> int:
        """Points of the map that fit the pose found from the first prediction that leads to one; 0: none does."""
        for T_world_camera in predictions:
            frame.points[:] = -1
            frame.T_camera_world = invert_se3(T_world_camera)
            if self._track_last(frame) >= _LEAST:
                inliers = self._track_map(frame)
                if inliers >= self._least_inliers(frame.stamp):
                    return inliers
        return 0

    def _track_last(self, frame: Frame) -> int:
        """Find the points of the last frame, and the pose from them; returns how many fit it."""
        s, last = self._settings, self._last
        assert last is not None
        points = last.points[last.points >= 0]
        views = self._mapping.views(frame.T_camera_world, points)
        views.reach[:] = 1.0
        for radius in (s.last_frame_radius, 2.0 * s.last_frame_radius):
            taken = np.zeros(len(frame), np.bool_)
            found = search(
                frame.features,
                views,
                self.map.point_descriptors[points],
                radius,
                s.scale,
                taken,
                s.match_distance,
                1.0,
            )
            if np.count_nonzero(found >= 0) >= _FEW:
                break
        return self._solve(frame, points[found >= 0], found[found >= 0])

    def _track_map(self, frame: Frame) -> int:
        """Find the points of the map around, and the pose from all; returns how many fit it."""
        s, slam_map = self._settings, self.map
        points = slam_map.points_of(self._around(frame))
        views = self._mapping.views(frame.T_camera_world, points)
        known = np.full(slam_map.point_rows, -1, np.int64)
        matched = np.flatnonzero(frame.points >= 0)
        known[frame.points[matched]] = matched
        known = known[points]
        descriptors = slam_map.point_descriptors[points]
        limits = s.local_map_radius, s.scale, s.match_distance, s.ratio
        chosen = s.good_features and self._frames > s.full_frames
        if chosen:
            information = pose_information(frame.T_camera_world, slam_map.places[points], views, self._pinhole, s.scale)
            radius, scale, most, ratio = limits
            found = match_good(
                frame.features,
                views,
                descriptors,
                known,
                information,
                s.features_wanted,
                s.queries,
                radius,
                scale,
                most,
                ratio,
                s.seed % 2147483646 + 1,
            )
        else:
            found = self._look_further(frame, views, descriptors, known)
        self._solve(frame, points[found >= 0], found[found >= 0])
        if chosen:
            self._take_others(frame, points, views, descriptors, known)
        inliers = int(np.count_nonzero(frame.points >= 0))
        slam_map.visible[points[views.octaves >= 0]] += 1.0
        slam_map.found[frame.points[frame.points >= 0]] += 1.0
        return inliers

    def _look_further(self, frame: Frame, views: Views, descriptors: Words, known: Ints) -> Ints:
        """(N,) features of all points: those known, and of the others what is found."""
        s = self._settings
        taken = np.zeros(len(frame), np.bool_)
        taken[known[known >= 0]] = True
        asked = views._replace(octaves=np.where(known >= 0, -1, views.octaves))
        found = search(
            frame.features, asked, descriptors, s.local_map_radius, s.scale, taken, s.match_distance, s.ratio
        )
        return np.where(known >= 0, known, found)

    def _take_others(self, frame: Frame, points: Ints, views: Views, descriptors: Words, known: Ints) -> None:
        """With the pose as it is, take in the points that were not needed for it and fit it."""
        slam_map = self.map
        there = np.full(slam_map.point_rows, -1, np.int64)
        matched = np.flatnonzero(frame.points >= 0)
        there[frame.points[matched]] = matched
        there = there[points]
        used = np.zeros(len(frame), np.bool_)
        used[matched] = True
        spare = (there < 0) & (known >= 0)
        spare[spare] = ~used[known[spare]]
        there[spare] = known[spare]
        found = self._look_further(frame, views, descriptors, there)
        asked = np.flatnonzero(found >= 0)
        features = found[asked]
        fits = fits_pose(
            frame.T_camera_world,
            slam_map.places[points[asked]],
            frame.features.seen[features],
            1.0 / frame.variances[features],
            self._pinhole,
        )
        frame.points[features[fits]] = points[asked[fits]]

    def _solve(self, frame: Frame, points: Ints, features: Ints) -> int:
        """Pose of the frame from points in features; it keeps those that fit, and their number is returned."""
        T, fits, _ = solve_stereo_pose(
            frame.T_camera_world,
            self.map.places[points],
            frame.features.seen[features],
            1.0 / frame.variances[features],
            self._pinhole,
        )
        frame.T_camera_world = T
        frame.points[:] = -1
        frame.points[features[fits]] = points[fits]
        return int(np.count_nonzero(fits))

    def _around(self, frame: Frame) -> Ints:
        """Keyframes that share points with the frame, and the neighbours of the one that shares most, the reference."""
        s = self._settings
        shared = self.map.shared(frame.points)
        order = np.argsort(-shared, kind="stable")
        sharing = order[shared[order] > 0][: s.local_keyframes]
        if not len(sharing):
            return sharing
        self._reference = int(sharing[0])
        further = self._mapping.neighbours(self._reference)[: s.neighbours]
        return np.union1d(sharing, further)[: s.local_keyframes]

    def _least_inliers(self, stamp: int) -> int:
        s = self._settings
        recent = self._relocalised_at is not None and stamp - self._relocalised_at < _RECENT_S * NANOSECONDS
        return s.least_relocalised if recent else s.least_inliers

    def _relocalise(self, frame: Frame) -> int:
        """Find the frame in the keyframes that look most like it; returns how many points fit, 0: in none."""
        s, slam_map = self._settings, self.map
        bag, groups = self._places.words.describe(frame.features.descriptors)
        keyframes = slam_map.keyframes()
        scores = self._places.scores(bag, keyframes)
        for k in keyframes[np.argsort(-scores, kind="stable")[: s.candidates]]:
            rows = np.flatnonzero(slam_map.point_of[k] >= 0)
            matches = match_by_words(
                slam_map.descriptors[k, rows],
                slam_map.words[k, rows],
                frame.features.descriptors,
                groups,
                s.strict_distance,
                _ALIKE,
            )
            points, features = slam_map.point_of[k, rows[matches >= 0]], matches[matches >= 0]
            if len(points) < _LEAST_BY_WORDS:
                continue
            T, fits = draw_pose(
                slam_map.places[points],
                frame.features.seen[features],
                1.0 / frame.variances[features],
                self._pinhole,
                s.ransac_draws,
                s.seed,
            )
            frame.T_camera_world = T
            if np.count_nonzero(fits) < _LEAST or self._solve(frame, points[fits], features[fits]) < _LEAST:
                continue
            self._track_map(frame)
            inliers = self._track_map(frame)  # again, with the neighbours of those found
            if inliers >= s.least_relocalised:
                self._relocalised_at = frame.stamp
                return inliers
        return 0

    def _wants_keyframe(self, frame: Frame, inliers: int) -> bool:
        """Whether the view has changed: fewer points than the reference shows, or too few near ones.

        Mur-Artal and Tardos 2017, section III.E, and their release.
        """
        s, slam_map = self._settings, self.map
        if self._frames - self._keyframe_at < s.keyframe_gap or inliers <= _LEAST_FOR_KEYFRAME:
            return False
        shown = slam_map.point_of[self._reference]
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
        self._reference, self._keyframe_at = k, self._frames

    def _fitted(self, frame: Frame, inliers: int, added: bool) -> Outcome:
        self._last, self._fitted_at = frame, frame.stamp
        self._T_world_camera = invert_se3(frame.T_camera_world)
        return Outcome(self._T_world_camera, Status.TRACKING, inliers, added)

    def _is_lost(self, stamp: int) -> bool:
        assert self._fitted_at is not None
        return stamp - self._fitted_at >= self._settings.lost_after * NANOSECONDS

    def _outcome(self, stamp: int) -> Outcome:
        """Of a pair that was not tracked."""
        if self._last is None:
            assert self._fitted_at is not None
            waited = stamp - self._fitted_at
            status = Status.LOST if waited >= _PATIENCE_S * NANOSECONDS else Status.STARTING
        else:
            status = Status.LOST if self._is_lost(stamp) else Status.TRACKING
        if status is Status.LOST:
            self.motion.rest()
        return Outcome(self._T_world_camera, status)

    def _repeats(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8]) -> bool:
        before, self._before = self._before, (left.copy(), right.copy())
        return (
            self._noisy and before is not None and np.array_equal(before[0], left) and np.array_equal(before[1], right)
        )
