"""Features of a rectified pair: tracked from frame to frame and from left to right, renewed where a cell has few.

Sun et al., Sec. III-D: FAST corners in a grid, pyramidal Lucas-Kanade begun where the gyro says, the epipolar
constraint of the pair, and two-point RANSAC with the gyro's rotation between frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.msckf.two_point_ransac import one_translation
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import GreyImage
from taskslam.slam.vision.stereo_matching import correlations

Pixels = npt.NDArray[np.float32]
Numbers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
_APART = 3  # pixels between a feature and a new corner, at least
_STILL = 1.0  # pixels: of less, a mean shift has no direction
_SEED = 0


@dataclass(frozen=True, slots=True)
class Features:
    """ids: (N,) of landmarks; left, right: (N, 2) float32 pixels; lifetime: (N,) frames."""

    ids: npt.NDArray[np.int64]
    left: npt.NDArray[np.float32]
    right: npt.NDArray[np.float32]
    lifetime: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.ids)

    def kept(self, mask: Mask | npt.NDArray[np.signedinteger]) -> Features:
        """Those of the mask, or with these places, in their order."""
        return Features(self.ids[mask], self.left[mask], self.right[mask], self.lifetime[mask])


_NONE = Features(
    np.zeros(0, np.int64), np.zeros((0, 2), np.float32), np.zeros((0, 2), np.float32), np.zeros(0, np.int64)
)


@dataclass(frozen=True, slots=True)
class Seen:
    """What a pair shows, to be kept or not.

    found: features that are where those before must be by now. share: of those before, 1 without any. cells: how many
    have features.
    """

    left: GreyImage
    features: Features
    found: int
    share: float
    cells: int


class FrontEnd:
    """What is tracked at the moment."""

    def __init__(self, settings: MsckfSettings, pinhole: Pinhole) -> None:
        import cv2  # not a dependency of the core

        cv2.setNumThreads(1)
        self._settings, self._pinhole = settings, pinhole
        self._center = np.array([pinhole.cx, pinhole.cy], np.float32)
        self._fast = cv2.FastFeatureDetector.create(settings.fast_threshold)
        self._flow: dict[str, Any] = {
            "winSize": (settings.patch_size, settings.patch_size),
            "maxLevel": settings.pyramid_levels,
            "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
            "criteria": (
                cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT,
                settings.max_iteration,
                settings.track_precision,
            ),
        }
        self._find_flow: Any = cv2.calcOpticalFlowPyrLK
        self._pixels_of: Any = cv2.KeyPoint.convert
        self._dice = np.random.Generator(np.random.PCG64(_SEED))
        self._before: GreyImage | None = None
        self.features = _NONE
        self._next = 0

    def look(self, left: GreyImage, right: GreyImage, T_before_now: FloatArray) -> Seen:
        """What a pair shows of the features of the last one that was kept, and new ones.

        T_before_now: (4, 4) motion of the left camera since that pair, by the IMU.
        """
        before, tracked, guess = self.features, self.features, self.features.left
        if self._before is not None and len(before):
            tracked, guess = self._tracked(left, before, T_before_now[:3, :3])
        fresh = self._corners(left, guess)
        both = np.vstack([guess, fresh]).astype(np.float32)
        disparity = np.vstack([tracked.left - tracked.right, np.zeros_like(fresh)])
        at_right, good = self._matched(left, right, both, disparity)
        count = len(tracked)
        kept = tracked.kept(good[:count])
        old = Features(kept.ids, guess[good[:count]], at_right[:count][good[:count]], kept.lifetime + 1)
        found = int(np.count_nonzero(self._expected(kept, old.left, T_before_now)))
        share = found / len(before) if len(before) else 1.0
        features = self._filled(old, fresh[good[count:]], at_right[count:][good[count:]], left.shape)
        return Seen(left, features, found, share, len(np.unique(self._cells(features.left, left.shape))))

    def keep(self, seen: Seen) -> None:
        """This pair is what the next one is compared with."""
        self._before, self.features = seen.left, seen.features
        self._next = max(self._next, int(seen.features.ids.max(initial=-1)) + 1)

    def forget(self) -> None:
        """The next pair begins anew."""
        self._before, self.features = None, _NONE

    def normalised(self) -> FloatArray:
        """(N, 3) observations (`observation.py`) of the features that are tracked."""
        left, right = ((side - self._center) / self._pinhole.f for side in (self.features.left, self.features.right))
        return np.column_stack([left[:, 0], 0.5 * (left[:, 1] + right[:, 1]), right[:, 0]]).astype(np.float64)

    def _tracked(self, image: GreyImage, before: Features, R_before_now: FloatArray) -> tuple[Features, Pixels]:
        """Features found again in the left image, and where."""
        rays = np.column_stack([self._rays(before.left), np.ones(len(before))]) @ R_before_now
        turned = ((rays[:, :2] / rays[:, 2:]) * self._pinhole.f + self._center).astype(np.float32)
        now, found, _ = self._find_flow(self._before, image, before.left, turned.copy(), **self._flow)
        good = np.flatnonzero((found.ravel() == 1) & (rays[:, 2] > 0.0) & _inside(now, image.shape))
        good = good[self.agreeing(turned[good], now[good])]
        return before.kept(good), now[good]

    def _expected(self, before: Features, now: Pixels, T_before_now: FloatArray) -> Mask:
        """Which features are near where disparity and the camera's motion have them: carried off, it sees none."""
        pinhole, disparity = self._pinhole, np.maximum((before.left - before.right)[:, 0], 1e-3)
        depth = pinhole.f * pinhole.baseline / disparity[:, None]
        at = np.hstack([self._rays(before.left) * depth, depth])
        at = (at - T_before_now[:3, 3]) @ T_before_now[:3, :3]
        pixels = at[:, :2] / np.maximum(at[:, 2:], 1e-3) * pinhole.f + self._center
        near: Mask = np.hypot(*(now - pixels).T) < self._settings.farthest_found
        return near

    def agreeing(self, before: Pixels, now: Pixels) -> Mask:
        """Which (N, 2) pixels, before turned by the gyro, moved along the epipolar lines of one translation."""
        shifts = np.hypot(*(now - before).T)
        threshold = self._settings.ransac_threshold
        if len(before) < 3 or shifts.mean() < _STILL:
            near: Mask = shifts < threshold
            return near
        draws = self._dice.integers(0, len(before), (self._settings.ransac_draws, 2))
        agree: Mask = one_translation(self._rays(before), self._rays(now), draws, threshold / self._pinhole.f)
        return agree

    def _matched(self, left: GreyImage, right: GreyImage, pixels: Pixels, disparity: Pixels) -> tuple[Pixels, Mask]:
        """(N, 2) right pixels of left ones, begun at a disparity, and which of them hold."""
        if not len(pixels):
            return pixels, np.zeros(0, bool)
        matches, found, _ = self._find_flow(left, right, pixels, pixels - disparity, **self._flow)
        offset = pixels - matches
        good = (found.ravel() == 1) & _inside(matches, right.shape) & (offset[:, 0] > 0.0)
        good &= np.abs(offset[:, 1]) < self._settings.stereo_threshold
        alike = correlations(left, right, pixels.astype(np.float64), matches.astype(np.float64))
        return matches, good & (alike >= self._settings.least_correlation)

    def _rays(self, pixels: Pixels) -> FloatArray:
        """(N, 2) normalised coordinates."""
        rays: FloatArray = ((pixels - self._center) / self._pinhole.f).astype(np.float64)
        return rays

    def _corners(self, image: GreyImage, at: Pixels) -> Pixels:
        """Candidates for cells that have few: the strongest, twice as many as are wanting."""
        s = self._settings
        counts = np.bincount(self._cells(at, image.shape), minlength=s.grid_row * s.grid_col)
        mask = np.full(image.shape, 255, np.uint8)
        for x, y in np.floor(at).astype(np.int64).tolist():
            mask[max(0, y - _APART) : y + _APART + 1, max(0, x - _APART) : x + _APART + 1] = 0
        corners = self._fast.detect(image, mask)
        if not corners:
            return np.zeros((0, 2), np.float32)
        pixels: Pixels = self._pixels_of(corners)
        cells = self._cells(pixels, image.shape)
        wanting = np.flatnonzero(counts[cells] < s.grid_min_feature_num)
        strength = np.array([corners[n].response for n in wanting.tolist()])
        pixels, cells = pixels[wanting], cells[wanting]
        order = np.lexsort((pixels[:, 0], pixels[:, 1], -strength, cells))
        pixels, cells = pixels[order], cells[order]
        return pixels[_rank(cells) < 2 * (s.grid_min_feature_num - counts[cells])]

    def _filled(self, old: Features, left: Pixels, right: Pixels, shape: tuple[int, ...]) -> Features:
        """Cells that have few filled with matched corners, and those that have many thinned, the youngest first."""
        s = self._settings
        order = np.lexsort((old.ids, -old.lifetime, self._cells(old.left, shape)))
        old = old.kept(order)
        old = old.kept(_rank(self._cells(old.left, shape)) < s.grid_max_feature_num)
        counts = np.bincount(self._cells(old.left, shape), minlength=s.grid_row * s.grid_col)
        cells = self._cells(left, shape)
        chosen = _rank(cells) < s.grid_min_feature_num - counts[cells]
        ids = self._next + np.arange(np.count_nonzero(chosen))
        return Features(
            np.concatenate([old.ids, ids]),
            np.vstack([old.left, left[chosen]]).astype(np.float32),
            np.vstack([old.right, right[chosen]]).astype(np.float32),
            np.concatenate([old.lifetime, np.zeros(len(ids), np.int64)]),
        )

    def _cells(self, pixels: Pixels, shape: tuple[int, ...]) -> Numbers:
        s = self._settings
        row = np.clip((pixels[:, 1] * s.grid_row / shape[0]).astype(np.int64), 0, s.grid_row - 1)
        column = np.clip((pixels[:, 0] * s.grid_col / shape[1]).astype(np.int64), 0, s.grid_col - 1)
        cells: Numbers = row * s.grid_col + column
        return cells


def _inside(pixels: Pixels, shape: tuple[int, ...]) -> Mask:
    x, y = pixels.T
    inside: Mask = (x >= 0) & (y >= 0) & (x <= shape[1] - 1) & (y <= shape[0] - 1)
    return inside


def _rank(cells: Numbers) -> Numbers:
    """(N,) which of its cell each is, for cells in ascending order."""
    if not len(cells):
        return np.zeros(0, np.int64)
    starts = np.flatnonzero(np.diff(cells, prepend=-1))
    rank: Numbers = np.arange(len(cells)) - np.repeat(starts, np.diff(np.append(starts, len(cells))))
    return rank
