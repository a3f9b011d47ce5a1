"""`Tracker`: the pose of a frame in the map, from where the camera should be by now, or from nothing at all.

A frame is tracked in steps: the points of the last frame, found where they should be, and the pose from them; the
points of the map around, good ones first, and the pose from all that were found; the other points, once the pose is
out.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS
from taskslam.slam.bundle.stereo_pose import fits_pose, solve_stereo_pose
from taskslam.slam.bundle.three_point_pose import draw_pose
from taskslam.slam.gf_gg.frame import Frame
from taskslam.slam.gf_gg.good_features import match_good, pose_information
from taskslam.slam.gf_gg.keyframe_map import KeyframeMap
from taskslam.slam.gf_gg.local_mapping import LocalMapping
from taskslam.slam.gf_gg.places import Places, match_by_words
from taskslam.slam.gf_gg.search import Views, search
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.vision.binary_words import Words
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
_FEW, _LEAST = 20, 10  # matches with the last frame: where they are few it is looked further, of fewer nothing follows
_LEAST_BY_WORDS = 15
_ALIKE = 0.75  # of the second best, by which a match of words must be better
_RECENT_S = 1.0  # after a relocalisation, in which more points are asked for
_MODULUS = 2147483646  # of the seeds of the generator in `good_features.py`


class Tracker:
    """Works on one map. reference: the keyframe that shares most points with the last frame."""

    def __init__(
        self, settings: GfGgSettings, pinhole: Pinhole, slam_map: KeyframeMap, mapping: LocalMapping, places: Places
    ) -> None:
        self._settings, self._pinhole = settings, pinhole
        self._map, self._mapping, self._places = slam_map, mapping, places
        self.reference = -1
        self._relocalised_at: int | None = None

    def track(self, frame: Frame, last: Frame, predictions: list[FloatArray], select: bool) -> int:
        """Points of the map that fit the pose found from the first prediction that leads to one; 0: none does.

        predictions: (4, 4) `T_world_camera` each. select: whether good features are looked for first.
        """
        for T_world_camera in predictions:
            frame.points[:] = -1
            frame.T_camera_world = invert_se3(T_world_camera)
            if self._track_last(frame, last) >= _LEAST:
                inliers = self._track_map(frame, select)
                if inliers >= self._least_inliers(frame.stamp):
                    return inliers
        return 0

    def relocalise(self, frame: Frame) -> int:
        """Find the frame in the keyframes that look most like it; returns how many points fit, 0: in none."""
        s, slam_map = self._settings, self._map
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
            self._track_map(frame, False)
            inliers = self._track_map(frame, False)  # again, with the neighbours of those found
            if inliers >= s.least_relocalised:
                self._relocalised_at = frame.stamp
                return inliers
        return 0

    def _track_last(self, frame: Frame, last: Frame) -> int:
        """Find the points of the last frame, and the pose from them; returns how many fit it."""
        s = self._settings
        points = last.points[last.points >= 0]
        views = self._mapping.views(frame.T_camera_world, points)
        views.reach[:] = 1.0
        for radius in (s.last_frame_radius, 2.0 * s.last_frame_radius):
            taken = np.zeros(len(frame), np.bool_)
            found = search(
                frame.features,
                views,
                self._map.point_descriptors[points],
                radius,
                s.scale,
                taken,
                s.match_distance,
                1.0,
            )
            if np.count_nonzero(found >= 0) >= _FEW:
                break
        return self._solve(frame, points[found >= 0], found[found >= 0])

    def _track_map(self, frame: Frame, select: bool) -> int:
        """Find the points of the map around, and the pose from all; returns how many fit it."""
        s, slam_map = self._settings, self._map
        points = slam_map.points_of(self._around(frame))
        views = self._mapping.views(frame.T_camera_world, points)
        known = np.full(slam_map.point_rows, -1, np.int64)
        matched = np.flatnonzero(frame.points >= 0)
        known[frame.points[matched]] = matched
        known = known[points]
        descriptors = slam_map.point_descriptors[points]
        if select:
            information = pose_information(frame.T_camera_world, slam_map.places[points], views, self._pinhole, s.scale)
            found = match_good(
                frame.features,
                views,
                descriptors,
                known,
                information,
                s.features_wanted,
                s.queries,
                s.local_map_radius,
                s.scale,
                s.match_distance,
                s.ratio,
                s.seed % _MODULUS + 1,
            )
        else:
            found = self._look_further(frame, views, descriptors, known)
        self._solve(frame, points[found >= 0], found[found >= 0])
        if select:
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
        slam_map = self._map
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
            self._map.places[points],
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
        shared = self._map.shared(frame.points)
        order = np.argsort(-shared, kind="stable")
        sharing = order[shared[order] > 0][: s.local_keyframes]
        if not len(sharing):
            return sharing
        self.reference = int(sharing[0])
        further = self._mapping.neighbours(self.reference)[: s.neighbours]
        return np.union1d(sharing, further)[: s.local_keyframes]

    def _least_inliers(self, stamp: int) -> int:
        s = self._settings
        recent = self._relocalised_at is not None and stamp - self._relocalised_at < _RECENT_S * NANOSECONDS
        return s.least_relocalised if recent else s.least_inliers
