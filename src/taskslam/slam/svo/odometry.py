"""`SvoOdometry`: sparse alignment with the last pair, features of the map aligned one by one, the pose refined on them.

A pair fits where at least `lost_features` points of the map are seen within `pose_error` of where they must be; what
becomes of those that do not fit, `vision/vigil.py` tells. When the map is given up, a new one begins where the camera
is thought to be (`reinit`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import ImuSamples, Measurement
from taskslam.slam.base import Status
from taskslam.slam.bundle.pose_only import refine_pose
from taskslam.slam.svo.depth_filter import observe, start_depths
from taskslam.slam.svo.features import find_features
from taskslam.slam.svo.keyframe import Keyframe, Points, joined, rays_of
from taskslam.slam.svo.matching import FAILED, MATCHED, match_points
from taskslam.slam.svo.settings import SvoSettings
from taskslam.slam.vision.direct_alignment import align
from taskslam.slam.vision.patches import Patches, Weighting, sample_patches
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.prediction import Prediction
from taskslam.slam.vision.pyramid import Pyramid, build_pyramid, same_pictures
from taskslam.slam.vision.stereo_matching import match_stereo
from taskslam.slam.vision.vigil import Vigil

_WEIGHTING = Weighting(c2=50.0, nu=4.0, outlier=1e9, most_outliers=4)  # of sparse alignment: all patches count
_STEREO_LEVELS = 4
_LEAST_MATCHED = 0.25  # of the features of a new map; swapped images match by chance alone


@dataclass(frozen=True, slots=True)
class Outcome:
    """T_world_camera: (4, 4), the world being the first left camera, optical axes.

    tracked: points on which the pose rests. keyframe: whether the pair became one.
    """

    T_world_camera: FloatArray
    status: Status
    tracked: int = 0
    keyframe: bool = False


class _Pair(NamedTuple):
    """A pair that was tracked, as the next one is aligned with it.

    points: seen in it, it being the host; shift: median number of pixels by which they moved from their own hosts.
    """

    T_world_camera: FloatArray
    gain: float
    points: Points
    patches: tuple[Patches, ...]
    shift: float = 0.0


class SvoOdometry:
    """Stereo odometry. noisy: whether two pictures of the same thing must differ."""

    def __init__(self, settings: SvoSettings, pinhole: Pinhole, prediction: Prediction, noisy: bool = False) -> None:
        s = self._settings = settings
        self._pinhole, self.prediction, self._noisy = pinhole, prediction, noisy
        self._T_world_camera = np.eye(4)
        self._keyframes: list[Keyframe] = []
        self._pictures: tuple[npt.NDArray[np.uint8], ...] = ()  # of the keyframes, stacked, by level
        self._last: _Pair | None = None
        self._before: tuple[Pyramid, Pyramid] | None = None
        self._stamp: int | None = None
        self._vigil = Vigil(s.lost_after, s.reinit_after)

    def hear(self, measurement: Measurement) -> None:
        """Take in inertial samples, stamped after those before; pass over all else."""
        if isinstance(measurement, ImuSamples):
            self.prediction.hear(measurement)

    def process(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], stamp: int) -> Outcome:
        """Take in a pair of (H, W) or (H, W, 3) images, stamped in ns, after those before."""
        s = self._settings
        pair = build_pyramid(left, s.align_coarsest + 1), build_pyramid(right, s.align_coarsest + 1)
        since = stamp if self._stamp is None else self._stamp
        frozen, self._before = self._noisy and same_pictures(self._before, pair), pair
        motions = self.prediction.motions(since, stamp)
        self.prediction.forget(stamp)
        self._stamp = stamp
        if self._last is None:
            self._T_world_camera = self._T_world_camera @ motions[0]
            if frozen or not self._begin(pair):
                return self._miss(stamp)
            self._vigil.fits(stamp)
            return Outcome(self._T_world_camera, Status.TRACKING, keyframe=True)
        found = None if frozen else self._track(pair, self._last, motions)
        if found is None:
            self._T_world_camera = self._T_world_camera @ motions[0]
            if s.reinit and self._vigil.gives_up(stamp):
                self._keyframes, self._last = [], None
            return self._miss(stamp)
        self._vigil.fits(stamp)
        self.prediction.learn(invert_se3(self._T_world_camera) @ found.T_world_camera, since, stamp)
        self._T_world_camera, self._last = found.T_world_camera, found
        wanted = self._wants_keyframe(found)
        if wanted:
            self._add_keyframe(pair, found.gain, found.points)
        return Outcome(self._T_world_camera, Status.TRACKING, len(found.points.pixels), wanted)

    def _track(self, pair: tuple[Pyramid, Pyramid], last: _Pair, motions: list[FloatArray]) -> _Pair | None:
        """The pair as it fits the map from the first of the predictions from which it does, or None."""
        for motion in motions:
            T_camera_world, gain = self._align(pair, last, self._T_world_camera @ motion)
            if (found := self._refine(pair, T_camera_world, gain)) is not None:
                return found
        return None

    def _align(
        self, pair: tuple[Pyramid, Pyramid], last: _Pair, T_world_camera: FloatArray
    ) -> tuple[FloatArray, float]:
        """`T_camera_world` and gain at which the pair shows the points of the last one as that did."""
        s = self._settings
        T_camera_world = invert_se3(T_world_camera)
        found = align(
            *pair,
            self._pinhole,
            (T_camera_world @ last.T_world_camera)[None],
            np.array([last.gain]),
            last.gain,
            np.zeros(len(last.points.pixels), np.int64),
            rays_of(last.points.pixels, self._pinhole),
            np.ascontiguousarray(last.points.depths[:, 0]),
            last.patches,
            _WEIGHTING,
            s.align_iterations,
            s.gain,
            s.align_finest,
        )
        return found.T @ T_camera_world, found.gain

    def _refine(self, pair: tuple[Pyramid, Pyramid], T_camera_world: FloatArray, gain: float) -> _Pair | None:
        """The pose on which the points of the nearest keyframes agree, and what they learn from it."""
        s = self._settings
        near = self._nearest(invert_se3(T_camera_world))
        frames = [self._keyframes[k] for k in near]
        points = joined([frame.points for frame in frames])
        hosts = np.repeat(np.arange(len(frames)), [len(frame.points.pixels) for frame in frames])
        T_world_hosts = np.stack([frame.T_world_camera for frame in frames])
        state, seen, normals = match_points(
            tuple(level[near] for level in self._pictures),
            pair[0][: s.corner_levels],
            self._pinhole,
            T_camera_world @ T_world_hosts,
            hosts,
            points.pixels,
            points.levels,
            points.normals,
            np.ascontiguousarray(points.depths[:, 0]),
            np.lexsort((points.depths[:, 1] / points.depths[:, 0] ** 2, points.failures)),
            s.cell,
            s.features,
            s.feature_iterations,
        )
        matched = np.flatnonzero(state == MATCHED)
        rays = rays_of(points.pixels, self._pinhole)
        T = T_world_hosts[hosts[matched]]
        in_host = rays[matched] / points.depths[matched, :1]
        in_world = np.einsum("nij,nj->ni", T[:, :3, :3], in_host) + T[:, :3, 3]
        weights = 0.5 ** points.levels[matched]
        T_camera_world, errors, solved = refine_pose(
            T_camera_world, in_world, seen[matched], normals[matched], weights, self._pinhole, s.pose_iterations
        )
        good, bad = matched[errors < s.pose_error], matched[errors >= s.pose_error]
        if not solved or len(good) < s.lost_features:
            return None
        T_camera_hosts = T_camera_world @ T_world_hosts
        learned = points.depths[good]
        observe(
            learned,
            T_camera_hosts,
            hosts[good],
            rays[good],
            seen[good],
            normals[good],
            self._pinhole,
            s.pixel_deviation,
        )
        points.depths[good] = learned
        points.failures[(state == FAILED)] += 1
        points.failures[bad] += 1
        points.failures[good] = 0
        for number, k in enumerate(near):
            own = (hosts == number) & (points.failures <= s.most_failures)
            self._keyframes[k] = replace(self._keyframes[k], points=points.only(own))
        here = _rehosted(points.only(good), T_camera_hosts[hosts[good]], rays[good], seen[good], normals[good])
        shift = float(np.median(np.linalg.norm(seen[good] - points.pixels[good], axis=1)))
        return self._pair(invert_se3(T_camera_world), gain, here, pair[0], shift)

    def _pair(self, T: FloatArray, gain: float, points: Points, left: Pyramid, shift: float = 0.0) -> _Pair:
        patches = tuple(sample_patches(image, points.pixels, level) for level, image in enumerate(left))
        return _Pair(T, gain, points, patches, shift)

    def _nearest(self, T_world_camera: FloatArray) -> list[int]:
        """The keyframes to look for points of: the nearest in place and direction, oldest first."""

        def far(keyframe: Keyframe) -> float:
            apart = invert_se3(T_world_camera) @ keyframe.T_world_camera
            return float(np.linalg.norm(apart[:3, 3]) + np.arccos(np.clip(apart[2, 2], -1.0, 1.0)))

        distances = [far(keyframe) for keyframe in self._keyframes]
        chosen = np.argsort(distances, kind="stable")[: self._settings.reprojected_keyframes]
        return sorted(int(k) for k in chosen)

    def _wants_keyframe(self, found: _Pair) -> bool:
        """Few points ask for a keyframe; and not so many do, where the view has changed enough."""
        s, tracked = self._settings, len(found.points.pixels)
        if not s.keyframe_lower <= tracked <= s.keyframe_upper:
            return tracked < s.keyframe_lower
        apart = invert_se3(self._keyframes[-1].T_world_camera) @ found.T_world_camera
        angle = np.degrees(np.arccos(np.clip(0.5 * (np.trace(apart[:3, :3]) - 1.0), -1.0, 1.0)))
        far = np.linalg.norm(apart[:3, 3]) > s.keyframe_distance
        return bool(far or angle > s.keyframe_angle or found.shift > s.keyframe_disparity)

    def _begin(self, pair: tuple[Pyramid, Pyramid]) -> bool:
        """Begin a map with this pair, if enough of its features have a disparity."""
        points, share = self._new_points(pair, np.zeros((0, 2)))
        if len(points.pixels) < self._settings.lost_features or share < _LEAST_MATCHED:
            return False
        self.prediction.rest()
        self._hold(pair[0], 1.0, points)
        return True

    def _add_keyframe(self, pair: tuple[Pyramid, Pyramid], gain: float, tracked: Points) -> None:
        """Keep the pair: it hosts what it sees of the map, and new points where it sees none."""
        s, here = self._settings, self._T_world_camera[:3, 3]
        if len(self._keyframes) == s.keyframes:
            distances = [np.linalg.norm(keyframe.T_world_camera[:3, 3] - here) for keyframe in self._keyframes]
            del self._keyframes[int(np.argmax(distances))]
        self._hold(pair[0], gain, joined([tracked, self._new_points(pair, tracked.pixels)[0]]))

    def _hold(self, left: Pyramid, gain: float, points: Points) -> None:
        self._keyframes.append(Keyframe(self._T_world_camera, left, points))
        levels = range(self._settings.corner_levels)
        self._pictures = tuple(np.stack([keyframe.left[level] for keyframe in self._keyframes]) for level in levels)
        self._last = self._pair(self._T_world_camera, gain, points, left)

    def _new_points(self, pair: tuple[Pyramid, Pyramid], taken: FloatArray) -> tuple[Points, float]:
        """Features with a disparity in the cells without one of the (M, 2) pixels `taken`; and their share of all."""
        s, at_1m = self._settings, self._pinhole.f * self._pinhole.baseline
        pixels, levels, normals = find_features(pair[0], s, taken)
        left, right = (eye[:_STEREO_LEVELS] for eye in pair)
        disparities = match_stereo(left, right, pixels, at_1m / s.min_depth, s.least_correlation)
        known = disparities >= at_1m / s.max_depth
        depths = start_depths(disparities[known] / at_1m, s.disparity_deviation / at_1m)
        count = np.count_nonzero(known)
        points = Points(pixels[known], levels[known], normals[known], depths, np.zeros(count, np.int64))
        return points, int(count) / max(len(pixels), 1)

    def _miss(self, stamp: int) -> Outcome:
        """Nothing was measured: the camera went on as predicted; one that is lost is expected to stand."""
        status = self._vigil.misses(stamp)
        if status is Status.LOST:
            self.prediction.rest()
        return Outcome(self._T_world_camera, status)


def _rehosted(
    points: Points, T_camera_host: FloatArray, rays: FloatArray, seen: FloatArray, normals: FloatArray
) -> Points:
    """The points as if the camera that sees them were their host; T_camera_host: (N, 4, 4).

    Along a ray dd'/dd = (d'/d)^2, so the variance of the inverse depth d goes with the fourth power.
    """
    inverse = points.depths[:, 0]
    z = np.einsum("nj,nj->n", T_camera_host[:, 2, :3], rays) / inverse + T_camera_host[:, 2, 3]
    ratio = 1.0 / (z * inverse)
    depths = np.column_stack([1.0 / z, points.depths[:, 1] * ratio**4, points.depths[:, 2:]])
    return points._replace(pixels=seen, normals=normals, depths=depths)
