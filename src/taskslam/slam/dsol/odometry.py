"""`DsolOdometry`: align every pair with a window of keyframes; where the view has changed, add one and adjust them all.

When it is lost: a pair fits where the patches of at least `lost_share` of the points in view correlate with it, and
they lie in at least `lost_area` of its cells; what becomes of those that do not fit, `vision/vigil.py` tells. When the
window is given up, a new one begins, as soon as points can be found, where the camera is thought to be (`reinit`). A
camera whose pictures are noisy, and repeat each other byte for byte, is frozen: they do not fit either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import ImuSamples, Measurement
from taskslam.slam.base import Status
from taskslam.slam.dsol.points import GUESSED, MATCHED, PointFinder, cells_of, fill_from_cells
from taskslam.slam.dsol.settings import DsolSettings
from taskslam.slam.dsol.window import Cloud, Keyframe, adjust_window, cloud_of, make_keyframe, make_room
from taskslam.slam.vision.direct_alignment import align, correlations
from taskslam.slam.vision.patches import INLIER, Weighting
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.prediction import Prediction
from taskslam.slam.vision.pyramid import Pyramid, build_pyramid, same_pictures
from taskslam.slam.vision.vigil import Vigil

_CORRELATED = 0.7
_JUDGED_LEVEL = 1  # where noise is half of what it is on the finest
_LEAST_MATCHED = 0.25  # of the points of a new window; swapped images match by chance alone


@dataclass(frozen=True, slots=True)
class Outcome:
    """T_world_camera: (4, 4), the world being the first left camera, optical axes.

    share: of the points in view, those whose patches correlate; area: share of the cells that hold a tracked point.
    keyframe: whether the pair became one.
    """

    T_world_camera: FloatArray
    status: Status
    share: float = 0.0
    area: float = 0.0
    keyframe: bool = False


class _View(NamedTuple):
    """How a pair lies on the window. tracked: (M,) which points of the cloud do, at (M, 2) pixels."""

    T_world_camera: FloatArray
    gain: float
    tracked: npt.NDArray[np.int64]
    pixels: FloatArray
    cells: int
    share: float


class DsolOdometry:
    """Stereo odometry. noisy: whether two pictures of the same thing must differ."""

    def __init__(self, settings: DsolSettings, pinhole: Pinhole, prediction: Prediction, noisy: bool = False) -> None:
        s = self._settings = settings
        self._pinhole, self.prediction, self._noisy = pinhole, prediction, noisy
        self._weighting = Weighting(s.c2, s.nu, s.outlier, s.patch_outliers)
        self._finder = PointFinder(settings, pinhole)
        self._T_world_camera, self._gain = np.eye(4), 1.0
        self._window: list[Keyframe] = []
        self._cloud: Cloud | None = None
        self._points_wanted = 0
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
        pair = build_pyramid(left, s.levels), build_pyramid(right, s.levels)
        cells = max((left.shape[0] // s.cell) * (left.shape[1] // s.cell), 1)
        since = stamp if self._stamp is None else self._stamp
        frozen, self._before = self._noisy and same_pictures(self._before, pair), pair
        motions = self.prediction.motions(since, stamp)
        self.prediction.forget(stamp)
        self._stamp = stamp
        least = s.lost_area * cells
        if not self._window:
            self._T_world_camera = self._T_world_camera @ motions[0]
            if frozen or not self._begin(pair, least):
                return self._miss(stamp)
            self._vigil.fits(stamp)
            return Outcome(self._T_world_camera, Status.TRACKING, 1.0, 1.0, keyframe=True)
        view = None if frozen else self._look(pair, motions, least)
        if view is None:
            self._T_world_camera = self._T_world_camera @ motions[0]
            if s.reinit and self._vigil.gives_up(stamp):
                self._window, self._cloud = [], None
            return self._miss(stamp)
        self._vigil.fits(stamp)
        self.prediction.learn(invert_se3(self._T_world_camera) @ view.T_world_camera, since, stamp)
        self._T_world_camera, self._gain = view.T_world_camera, view.gain
        changed = view.cells < s.keyframe_ratio * self._points_wanted
        added = changed and self._add_keyframe(pair, view, least)
        return Outcome(self._T_world_camera, Status.TRACKING, view.share, view.cells / cells, added)

    def _look(self, pair: tuple[Pyramid, Pyramid], motions: list[FloatArray], least: float) -> _View | None:
        """The first of the predictions from which the pair comes to fit the window, or None."""
        s = self._settings
        assert self._cloud is not None
        for motion in motions:
            view = self._align(pair, self._cloud, self._T_world_camera @ motion)
            if view.share >= s.lost_share and view.cells >= least:
                return view
        return None

    def _align(self, pair: tuple[Pyramid, Pyramid], cloud: Cloud, T_world_camera: FloatArray) -> _View:
        s = self._settings
        T_camera_world = invert_se3(T_world_camera)
        T_camera_hosts = np.stack([T_camera_world @ keyframe.T_world_camera for keyframe in self._window])
        gains = np.array([keyframe.gain for keyframe in self._window])
        found = align(
            *pair,
            self._pinhole,
            T_camera_hosts,
            gains,
            self._gain,
            cloud.hosts,
            cloud.rays,
            cloud.inverse_depths,
            cloud.patches,
            self._weighting,
            s.align_iterations,
            s.gain,
        )
        T_camera_hosts = found.T @ T_camera_hosts
        likeness = correlations(
            pair[0][_JUDGED_LEVEL],
            self._pinhole.at_level(_JUDGED_LEVEL),
            T_camera_hosts,
            cloud.hosts,
            cloud.rays,
            cloud.inverse_depths,
            cloud.patches[_JUDGED_LEVEL],
        )
        seen = np.isfinite(likeness)
        share = int(np.count_nonzero(likeness[seen] > _CORRELATED)) / max(int(np.count_nonzero(seen)), 1)
        tracked = np.flatnonzero(found.states == INLIER)
        pixels = found.pixels[tracked]
        cells = len(np.unique(cells_of(pixels, s.cell)))
        return _View(T_world_camera @ invert_se3(found.T), found.gain, tracked, pixels, cells, share)

    def _begin(self, pair: tuple[Pyramid, Pyramid], least: float) -> bool:
        """Begin a window with this pair, if enough of its points have a disparity."""
        points, inverse_depths = self._finder.find(*pair)
        matched = np.count_nonzero(np.isfinite(inverse_depths))
        if matched < max(least, _LEAST_MATCHED * len(points), 1):
            return False
        information = np.full(len(points), MATCHED)
        self._gain = 1.0
        self.prediction.rest()
        self._hold([make_keyframe(self._T_world_camera, 1.0, pair, self._pinhole, points, inverse_depths, information)])
        return True

    def _add_keyframe(self, pair: tuple[Pyramid, Pyramid], view: _View, least: float) -> bool:
        """Add the pair to the window, if enough of its points have a depth, and adjust all."""
        s, cloud = self._settings, self._cloud
        assert cloud is not None
        points, inverse_depths = self._finder.find(*pair)
        information = np.where(np.isfinite(inverse_depths), MATCHED, GUESSED)
        if np.count_nonzero(information == MATCHED) < least:
            return False
        inverse_depths = fill_from_cells(points, inverse_depths, view.pixels, self._seen_from(view, cloud), s.cell)
        new = make_keyframe(view.T_world_camera, view.gain, pair, self._pinhole, points, inverse_depths, information)
        window = [*make_room(self._window, s.keyframes, cloud.hosts[view.tracked]), new]
        if s.adjust:
            window = adjust_window(window, s, self._pinhole, self._weighting)
        self._T_world_camera = window[-1].T_world_camera
        self._hold(window)
        return True

    def _seen_from(self, view: _View, cloud: Cloud) -> FloatArray:
        """(M,) inverse depths of the tracked points in the view's own camera."""
        T_camera_world = invert_se3(view.T_world_camera)
        poses = np.stack([T_camera_world @ keyframe.T_world_camera for keyframe in self._window])
        rows, rays = poses[cloud.hosts[view.tracked], 2], cloud.rays[view.tracked]
        inverse = cloud.inverse_depths[view.tracked]
        along = rows[:, 0] * rays[:, 0] + rows[:, 1] * rays[:, 1] + rows[:, 2]
        depths: FloatArray = inverse / (along + rows[:, 3] * inverse)
        return depths

    def _hold(self, window: list[Keyframe]) -> None:
        self._window, self._cloud = window, cloud_of(window).at_least(MATCHED)
        self._points_wanted = len(window[-1].points)

    def _miss(self, stamp: int) -> Outcome:
        """Nothing was measured: the camera went on as predicted; one that is lost is expected to stand."""
        status = self._vigil.misses(stamp)
        if status is Status.LOST:
            self.prediction.rest()
        return Outcome(self._T_world_camera, status)
