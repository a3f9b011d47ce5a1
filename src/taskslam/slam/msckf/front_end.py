"""Features of a rectified pair: tracked from frame to frame and from left to right, renewed where a cell has few.

Sun et al., Sec. III-D: FAST corners in a grid, pyramidal Lucas-Kanade begun where the gyro says, the epipolar
constraint of the pair, and two-point RANSAC with the gyro's rotation between frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.slam.msckf.settings import MsckfSettings

Image = npt.NDArray[np.uint8]
Pixels = npt.NDArray[np.float32]
Numbers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
_RANSAC_TRIALS = 20


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


class FrontEnd:
    """What is tracked at the moment. focal, center: pixels."""

    def __init__(self, settings: MsckfSettings, focal: float, center: tuple[float, float], seed: int = 0) -> None:
        cv2.setNumThreads(1)
        self._settings, self._focal = settings, focal
        self._center = np.array(center, np.float32)
        self._fast = cv2.FastFeatureDetector.create(settings.fast_threshold)
        self._flow: dict[str, Any] = {
            "winSize": (settings.patch_size, settings.patch_size),
            "maxLevel": settings.pyramid_levels,
            "criteria": (
                cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT,
                settings.max_iteration,
                settings.track_precision,
            ),
        }
        self._before: Image | None = None
        self.features = _NONE
        self._next = 0
        self._dice = np.random.Generator(np.random.PCG64(seed))

    def observe(self, left: Image, right: Image, R_before_now: FloatArray) -> float:
        """Take a pair; returns the share of features that were found again (1 for the first).

        R_before_now: (3, 3) rotation of the left camera since the pair before, by the gyro.
        """
        before, share = self.features, 1.0
        tracked, guess = before, before.left
        if self._before is not None and len(before):
            tracked, guess = self._tracked(left, before, R_before_now)
        fresh = self._corners(left, tracked)
        self._before = left
        both = np.vstack([guess, fresh]).astype(np.float32)
        disparity = np.vstack([tracked.left - tracked.right, np.zeros_like(fresh)])
        at_right, good = self._matched(left, right, both, disparity)
        count = len(tracked)
        kept = tracked.kept(good[:count])
        self.features = Features(kept.ids, guess[good[:count]], at_right[:count][good[:count]], kept.lifetime + 1)
        if len(before):
            share = len(self.features) / len(before)
        self._add(fresh[good[count:]], at_right[count:][good[count:]], left.shape)
        return share

    def normalised(self) -> FloatArray:
        """(N, 3) observations (`observation.py`)."""
        left, right = (
            (self.features.left - self._center) / self._focal,
            (self.features.right - self._center) / self._focal,
        )
        return np.column_stack([left[:, 0], 0.5 * (left[:, 1] + right[:, 1]), right[:, 0]]).astype(np.float64)

    def _tracked(self, image: Image, before: Features, R_before_now: FloatArray) -> tuple[Features, Pixels]:
        """Features found again in the left image, and where."""
        turned = self._turned(before.left, R_before_now)
        now, found, _ = cv2.calcOpticalFlowPyrLK(
            self._before, image, before.left, turned.copy(), flags=cv2.OPTFLOW_USE_INITIAL_FLOW, **self._flow
        )
        good = np.flatnonzero((found.ravel() == 1) & _inside(now, image.shape))
        good = good[self._ransac(turned[good], now[good])]
        return before.kept(good), now[good]

    def _matched(self, left_image: Image, right_image: Image, left: Pixels, disparity: Pixels) -> tuple[Pixels, Mask]:
        """(N, 2) right pixels of left ones, begun at a disparity, and which of them hold."""
        if not len(left):
            return left, np.zeros(0, bool)
        right, found, _ = cv2.calcOpticalFlowPyrLK(
            left_image, right_image, left, left - disparity, flags=cv2.OPTFLOW_USE_INITIAL_FLOW, **self._flow
        )
        offset = left - right
        good = (found.ravel() == 1) & _inside(right, right_image.shape)
        good &= (np.abs(offset[:, 1]) < self._settings.stereo_threshold) & (offset[:, 0] > 0.0)
        return right, good

    def _turned(self, pixels: Pixels, R_before_now: FloatArray) -> Pixels:
        """Where pixels go by the camera's rotation alone."""
        rays = np.column_stack([(pixels - self._center) / self._focal, np.ones(len(pixels))]) @ R_before_now
        turned: Pixels = ((rays[:, :2] / rays[:, 2:]) * self._focal + self._center).astype(np.float32)
        return turned

    def _ransac(self, before: Pixels, now: Pixels) -> Mask:
        """Which (N, 2) pixels, before turned by the gyro, moved along epipolar lines of one translation.

        Two of them give its direction; all within the threshold of it agree (Troiani et al., ICRA 2014).
        """
        count = len(before)
        if count < 3:
            return np.ones(count, bool)
        threshold = self._settings.ransac_threshold
        shift = now - before
        if np.mean(np.hypot(*shift.T)) < 1.0:
            still: Mask = np.hypot(*shift.T) < threshold
            return still
        a = np.column_stack([(before - self._center) / self._focal, np.ones(count)])
        b = np.column_stack([(now - self._center) / self._focal, np.ones(count)])
        lines = np.cross(a, b)  # t . (a x b) = 0
        best = np.zeros(count, bool)
        for _ in range(_RANSAC_TRIALS):
            i, j = self._dice.choice(count, 2, replace=False)
            t = np.cross(lines[i], lines[j])
            length = np.linalg.norm(t)
            if length < 1e-12:
                continue
            normal = np.cross(t / length, a)
            off = np.abs(np.sum(normal * b, axis=1)) / np.maximum(np.hypot(normal[:, 0], normal[:, 1]), 1e-9)
            agree = off * self._focal < threshold
            if agree.sum() > best.sum():
                best = agree
        return best

    def _corners(self, image: Image, tracked: Features) -> Pixels:
        """Candidates for cells that have few: the strongest, twice as many as are wanting."""
        s = self._settings
        counts = np.bincount(self._cells(tracked.left, image.shape), minlength=s.grid_row * s.grid_col)
        mask = np.full(image.shape, 255, np.uint8)
        for x, y in tracked.left.astype(np.int64):
            mask[max(0, y - 3) : y + 4, max(0, x - 3) : x + 4] = 0
        corners = self._fast.detect(image, mask)
        if not corners:
            return np.zeros((0, 2), np.float32)
        pixels: Pixels = cv2.KeyPoint_convert(corners)  # type: ignore[attr-defined]
        cells = self._cells(pixels, image.shape)
        wanting = np.flatnonzero(counts[cells] < s.grid_min_feature_num)
        strength = np.array([corners[n].response for n in wanting.tolist()])
        pixels, cells = pixels[wanting], cells[wanting]
        order = np.lexsort((pixels[:, 0], pixels[:, 1], -strength, cells))
        pixels, cells = pixels[order], cells[order]
        return pixels[_rank(cells) < 2 * (s.grid_min_feature_num - counts[cells])]

    def _add(self, left: Pixels, right: Pixels, shape: tuple[int, ...]) -> None:
        """Fill cells that have few with matched corners, and thin those that have many, the youngest first."""
        s = self._settings
        old = self.features
        order = np.lexsort((old.ids, -old.lifetime, self._cells(old.left, shape)))
        old = old.kept(order)
        old = old.kept(_rank(self._cells(old.left, shape)) < s.grid_max_feature_num)
        counts = np.bincount(self._cells(old.left, shape), minlength=s.grid_row * s.grid_col)
        cells = self._cells(left, shape)
        chosen = _rank(cells) < s.grid_min_feature_num - counts[cells]
        ids = self._next + np.arange(np.count_nonzero(chosen))
        self._next += len(ids)
        self.features = Features(
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
