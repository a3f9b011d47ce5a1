"""Camera calibration from views of a flat board (Zhang 2000, as in OpenCV), with views that disagree left out by name.

OpenCV finds the parameters. Their standard deviations are ours: the usual ones assume that corner errors are
independent, but a board that is bent, moved or blurred makes those of one view err together, so the deviation is the
larger of that and of the one that comes from leaving out each view in turn (`calibration_uncertainty`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from taskslam.errors import CameraError
from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.calibration_uncertainty import Uncertainty, parameter_names, uncertainty
from taskslam.realworld.cameras.camera_model import Camera, DistortionModel
from taskslam.realworld.cameras.images import GreyImage
from taskslam.realworld.extra import load_opencv

FEWEST_VIEWS = 4
GOOD_RMS_PX = 0.5

_MOST_LEFT_OUT = 1 / 3
_OUTLYING = 3.0  # times the spread of the other views' errors above their median
_NEVER_OUTLYING = 1.5  # times the median
_ALWAYS_GOOD_PX = 0.1
_SPREAD_TURNS, _SPREAD_FOUND_PX = 6, 0.002


@dataclass(frozen=True, eq=False)
class View:
    """The board in one picture.

    points: (N, 3) on the board, m; pixels: (N, 2); outward: (N, 2) how far a corner moves, px, where the edges that
    meet in it lie one pixel further out, zero for corners between squares; picture: gives the image again.
    """

    name: str
    points: FloatArray
    pixels: FloatArray
    outward: FloatArray
    picture: Callable[[], GreyImage] | None = None


@dataclass(frozen=True, eq=False)
class FittedView:
    """A view and how the calibration explains it.

    T_camera_board: (4, 4). errors: (N, 2) px, seen minus expected. used: whether the calibration rests on it.
    """

    view: View
    T_camera_board: FloatArray
    errors: FloatArray
    used: bool = True

    @property
    def rms(self) -> float:
        """Root mean squared distance of the corners, px."""
        return float(np.sqrt((self.errors**2).sum(1).mean()))

    @property
    def tilt(self) -> FloatArray:
        """(2,) how the board's normal leans to the image's right and down, rad."""
        normal = self.T_camera_board[:3, 2]
        return np.asarray(np.arcsin(np.clip(normal[:2] * np.sign(normal[2]), -1, 1)))


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera, how surely it is known, and from what.

    views: used ones and those that were left out, by name. spread: how far outside their places the edges of tags were
    seen, px; a camera's tone curve makes white spread into black (negative), ink the other way.
    """

    camera: Camera
    uncertainty: Uncertainty
    views: tuple[FittedView, ...]
    spread: float = 0.0

    @property
    def used(self) -> tuple[FittedView, ...]:
        """The views that the calibration rests on."""
        return tuple(fitted for fitted in self.views if fitted.used)

    @property
    def dropped(self) -> tuple[FittedView, ...]:
        """The views that disagree with the rest."""
        return tuple(fitted for fitted in self.views if not fitted.used)

    @property
    def rms(self) -> float:
        """Root mean squared reprojection error over all corners of the used views, px."""
        return float(np.sqrt(np.concatenate([(fitted.errors**2).sum(1) for fitted in self.used]).mean()))

    @property
    def parameters(self) -> list[tuple[str, float, float]]:
        """Name, value and standard deviation of each parameter that was estimated."""
        names = parameter_names(self.camera.model)
        K = self.camera.K
        values = [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *self.camera.distortion[: len(names) - 4]]
        return [(n, float(v), float(d)) for n, v, d in zip(names, values, self.uncertainty.deviations, strict=True)]


def calibrate(
    views: Sequence[View],
    size: tuple[int, int],
    name: str = "camera",
    model: DistortionModel = DistortionModel.PLUMB_BOB,
) -> Calibration:
    """The camera that took these views. size: width and height of the images, px.

    plumb_bob is fitted without its third radial coefficient, which ordinary lenses do not need and which makes the
    image's rim worse. Views whose error stands out are left out one after the other.

    Raises:
        CameraError: too few views, too many that disagree, or views that determine no camera.
    """
    if len(views) < FEWEST_VIEWS:
        raise CameraError(f"{len(views)} views with a board; expected at least {FEWEST_VIEWS}, better 20 to 40")
    used, spread = list(views), 0.0
    while True:
        camera, fitted, spread = _fit_with_spread(used, size, name, model, spread)
        worst = _outlier(fitted)
        if worst is None:
            break
        used = [view for view in used if view is not worst.view]
        if len(used) < max(FEWEST_VIEWS, (1 - _MOST_LEFT_OUT) * len(views)):
            raise CameraError(
                f"more than a third of the {len(views)} views disagree with the rest, last {worst.view.name} by "
                f"{worst.rms:.1f} px; expected one stiff board, a fixed focus and images of one camera"
            )
    doubt = uncertainty(camera, [(f.view.points, f.view.outward, f.T_camera_board, f.errors) for f in fitted])
    out = [view for view in views if all(view is not kept for kept in used)]
    every = {id(f.view): f for f in (*fitted, *(_locate(camera, view, spread) for view in out))}
    return Calibration(camera, doubt, tuple(every[id(view)] for view in views), spread)


def _fit_with_spread(
    views: Sequence[View], size: tuple[int, int], name: str, model: DistortionModel, spread: float
) -> tuple[Camera, list[FittedView], float]:
    """A fit, and how far the edges of tags lie outside, found in turns: neither can stand in for the other."""
    weight = sum(float((view.outward**2).sum()) for view in views)
    for _ in range(_SPREAD_TURNS):
        camera, fitted = _solve(views, size, name, model, spread)
        if weight == 0:
            break
        more = sum(float((f.errors * f.view.outward).sum()) for f in fitted) / weight
        spread += more
        if abs(more) < _SPREAD_FOUND_PX:
            break
    return camera, fitted, spread


def _solve(
    views: Sequence[View], size: tuple[int, int], name: str, model: DistortionModel, spread: float
) -> tuple[Camera, list[FittedView]]:
    cv2 = load_opencv()
    try:
        K, distortion, rotations, translations = _opencv_calibrate(cv2, views, size, model, spread)
        camera = Camera(name, *size, K, distortion, model)
    except cv2.error as error:
        raise CameraError(f"the {len(views)} views determine no {model} camera; expected tilted views") from error
    if not 0.05 * max(size) < K[0, 0] < 50 * max(size):
        raise CameraError(
            f"the {len(views)} views give a focal length of {K[0, 0]:.0f} px for images {size[0]} px wide; "
            "expected views of the board tilted by 20 to 40 degrees, in several directions"
        )
    fitted = []
    for view, rotation, translation in zip(views, rotations, translations, strict=True):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = cv2.Rodrigues(np.asarray(rotation))[0], np.asarray(translation).ravel()
        fitted.append(FittedView(view, T, _errors(camera, view, T, spread)))
    return camera, fitted


def _opencv_calibrate(
    cv2: Any, views: Sequence[View], size: tuple[int, int], model: DistortionModel, spread: float
) -> Any:
    points = [np.asarray(view.points, np.float32) for view in views]
    pixels = [np.asarray(view.pixels - spread * view.outward, np.float32) for view in views]
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-10)
    if model is DistortionModel.EQUIDISTANT:
        names = cv2.fisheye if hasattr(cv2.fisheye, "CALIB_FIX_SKEW") else cv2  # OpenCV 4, and 5
        flags = names.CALIB_RECOMPUTE_EXTRINSIC | names.CALIB_FIX_SKEW
        K, D = np.eye(3), np.zeros((4, 1))
        _, K, D, rotations, translations = cv2.fisheye.calibrate(
            [p.astype(np.float64)[None] for p in points],
            [p.astype(np.float64)[None] for p in pixels],
            size,
            K,
            D,
            flags=flags,
            criteria=criteria,
        )
        return K, D.ravel(), rotations, translations
    flags = cv2.CALIB_RATIONAL_MODEL if model is DistortionModel.RATIONAL_POLYNOMIAL else cv2.CALIB_FIX_K3
    _, K, D, rotations, translations = cv2.calibrateCamera(
        points, pixels, size, None, None, flags=flags, criteria=criteria
    )
    count = 8 if model is DistortionModel.RATIONAL_POLYNOMIAL else 5
    return K, D.ravel()[:count], rotations, translations


def _errors(camera: Camera, view: View, T_camera_board: FloatArray, spread: float) -> FloatArray:
    expected = camera.project(view.points @ T_camera_board[:3, :3].T + T_camera_board[:3, 3])
    # Where the model folds back there is no expectation: as wrong as an image is wide.
    return np.asarray(np.nan_to_num(view.pixels - spread * view.outward - expected, nan=float(camera.width)))


def _outlier(fitted: Sequence[FittedView]) -> FittedView | None:
    """The view that disagrees most, if any does: judged against the spread of the others' errors."""
    worst = max(fitted, key=lambda f: f.rms)
    rest = np.array([f.rms for f in fitted if f is not worst])
    middle = float(np.median(rest))
    spread = 1.4826 * float(np.median(np.abs(rest - middle)))
    if worst.rms > max(middle + _OUTLYING * spread, _NEVER_OUTLYING * middle, _ALWAYS_GOOD_PX):
        return worst
    return None


def _locate(camera: Camera, view: View, spread: float) -> FittedView:
    """Where the board is in a view that the calibration does not rest on."""
    from taskslam.realworld.tags.spatial_pose import both_poses

    rays = camera.undistort(view.pixels - spread * view.outward)
    seen = np.isfinite(rays).all(1)
    fits = both_poses(rays[seen], view.points[seen, :2], float(camera.K[0, 0])) if seen.sum() >= 4 else []
    T = fits[0].T_camera_target if fits else np.eye(4)
    return FittedView(view, T, _errors(camera, view, T, spread), used=False)
