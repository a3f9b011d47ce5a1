"""The lens and the pixels of a camera: from a point in front of it to a pixel and back."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
import numpy.typing as npt

from taskslam.errors import CameraError

FloatArray = npt.NDArray[np.float64]

_LENGTHS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8,), "equidistant": (0, 4)}
_FARTHEST = 8.0  # tangent of 83 degrees: beyond it a pinhole image has no use
_STEPS = 100
_TOLERANCE = 1e-13


class DistortionModel(StrEnum):
    """Lens models by their names in ROS camera_info (`radtan` in Kalibr is plumb_bob)."""

    PLUMB_BOB = "plumb_bob"
    RATIONAL_POLYNOMIAL = "rational_polynomial"
    EQUIDISTANT = "equidistant"


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera. Optical frame: x right, y down, z forward; pixel (0, 0) is the centre of the first pixel.

    width, height: px. K: (3, 3) camera matrix, px. distortion: k1 k2 p1 p2 [k3] for plumb_bob, and k4 k5 k6 after them
    for rational_polynomial, k1 k2 k3 k4 for equidistant; empty or zeros for none.

    Raises:
        CameraError: no positive size, a singular matrix, or a distortion of the wrong length.
    """

    name: str
    width: int
    height: int
    K: FloatArray
    distortion: FloatArray
    model: DistortionModel = DistortionModel.PLUMB_BOB

    def __post_init__(self) -> None:
        try:
            model = DistortionModel(self.model)
        except ValueError:
            known = ", ".join(DistortionModel)
            raise CameraError(f"camera '{self.name}': distortion model '{self.model}'; expected {known}") from None
        K, distortion = np.array(self.K, float), np.array(self.distortion, float).ravel()
        where = f"camera '{self.name}'"
        if self.width < 1 or self.height < 1:
            raise CameraError(f"{where}: image of {self.width} x {self.height} px; expected a positive size")
        if K.shape != (3, 3) or not np.isfinite(K).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
            raise CameraError(f"{where}: the camera matrix is singular or not 3 x 3; expected positive focal lengths")
        if not np.allclose(K[[1, 2, 2, 2], [0, 0, 1, 2]], (0, 0, 0, 1)):
            raise CameraError(f"{where}: the camera matrix is not upper triangular with 1 in its last corner")
        if distortion.size not in _LENGTHS[model] or not np.isfinite(distortion).all():
            expected = " or ".join(str(n) for n in _LENGTHS[model])
            raise CameraError(f"{where}: {distortion.size} distortion coefficients for {model}; expected {expected}")
        full = np.zeros(max(_LENGTHS[model]))
        full[: distortion.size] = distortion
        for field, value in (("model", model), ("K", K), ("distortion", full)):
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, field, value)

    @classmethod
    def pinhole(cls, name: str, width: int, height: int, focal: float) -> Camera:
        """A camera without distortion whose axis meets the middle of the image. focal: px."""
        K = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
        return cls(name, width, height, K, np.zeros(0))

    def check_size(self, image: npt.NDArray[np.uint8], name: str = "image") -> None:
        """Raise CameraError unless the image (H, W, ...) has the size that was calibrated."""
        height, width = image.shape[:2]
        if (width, height) != (self.width, self.height):
            raise CameraError(
                f"{name}: {width} x {height} px, but camera '{self.name}' was calibrated at "
                f"{self.width} x {self.height}; expected images of the calibrated resolution"
            )

    def project(self, points: npt.ArrayLike) -> FloatArray:
        """Pixels (N, 2) of points (N, 3) in the optical frame, m.

        NaN for points that are not in front of the camera, and for those so far aside that the lens model folds back.
        """
        points = np.asarray(points, float).reshape(-1, 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            normalised = points[:, :2] / points[:, 2:]
        normalised[points[:, 2] <= 0] = np.nan
        return self.distort(normalised)

    def distort(self, normalised: npt.ArrayLike) -> FloatArray:
        """Pixels (N, 2) of normalised rays (N, 2), the x/z and y/z of points in the optical frame."""
        normalised = np.asarray(normalised, float).reshape(-1, 2)
        distorted = self._bend(normalised)
        distorted[~(np.hypot(*normalised.T) <= self._valid_radius)] = np.nan
        return distorted @ self.K[:2, :2].T + self.K[:2, 2]

    def undistort(self, points: npt.ArrayLike) -> FloatArray:
        """Normalised rays (N, 2), the x/z and y/z of the direction, of pixels (N, 2): the inverse of `distort`.

        Newton's method on the lens model, to 1e-13; NaN for pixels that no ray reaches.
        """
        pixels = np.asarray(points, float).reshape(-1, 2)
        target = np.asarray(np.linalg.solve(self.K[:2, :2], (pixels - self.K[:2, 2]).T).T, np.float64)
        if self.model is DistortionModel.EQUIDISTANT:
            return self._undistort_equidistant(target)
        rays = target.copy()
        if not self.distortion.any():
            return rays
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            # Rings of the lens first: along the radius the model is monotone, so interpolation starts near the root.
            radii = self._radii[self._radii <= self._valid_radius]
            reached = np.hypot(*target.T)
            start = np.interp(reached, self._radial(radii), radii)
            rays *= np.where(reached > 0, start / np.where(reached > 0, reached, 1), 1.0)[:, None]
            for _ in range(_STEPS):
                error = self._bend(rays) - target
                step = _solve_2x2(self._slope(rays), error)
                rays -= step
                if not np.nanmax(np.abs(step), initial=0.0) > _TOLERANCE:
                    break
            missed = np.abs(self._bend(rays) - target).max(1, initial=0.0)
            rays[~(missed < 1e-9) | ~(np.hypot(*rays.T) <= self._valid_radius)] = np.nan
        return rays

    def _undistort_equidistant(self, target: FloatArray) -> FloatArray:
        reached = np.hypot(*target.T)
        angles = np.arctan(self._radii[self._radii <= self._valid_radius])
        theta = np.asarray(np.interp(reached, self._fisheye(angles), angles, right=np.nan))
        k1, k2, k3, k4 = self.distortion.tolist()
        for _ in range(20):
            s = theta * theta
            slope = 1 + s * (3 * k1 + s * (5 * k2 + s * (7 * k3 + s * 9 * k4)))
            theta = theta - (self._fisheye(theta) - reached) / slope
        scale = np.where(reached > 1e-12, np.tan(theta) / np.where(reached > 1e-12, reached, 1), 1.0)
        return target * scale[:, None]

    @cached_property
    def _radii(self) -> FloatArray:
        return np.linspace(0.0, _FARTHEST, 4001)

    @cached_property
    def _valid_radius(self) -> float:
        """Up to where the image of a ray moves outwards as the ray does."""
        if not self.distortion.any() and self.model is not DistortionModel.EQUIDISTANT:
            return np.inf
        radial = self._radial(self._radii)
        falling = np.flatnonzero(~(np.diff(radial) > 0))
        return float(self._radii[falling[0]]) if falling.size else _FARTHEST

    def _radial(self, r: FloatArray) -> FloatArray:
        """Distorted radius of an undistorted one, without tangential terms."""
        if self.model is DistortionModel.EQUIDISTANT:
            return self._fisheye(np.arctan(r))
        return r * self._radial_factor(r * r)

    def _fisheye(self, theta: FloatArray) -> FloatArray:
        k1, k2, k3, k4 = self.distortion.tolist()
        s = theta * theta
        radius: FloatArray = theta * (1 + s * (k1 + s * (k2 + s * (k3 + s * k4))))
        return radius

    def _radial_factor(self, s: FloatArray) -> FloatArray:
        k1, k2, _, _, k3, *rest = self.distortion.tolist()
        factor = 1 + s * (k1 + s * (k2 + s * k3))
        if rest:
            k4, k5, k6 = rest
            factor = factor / (1 + s * (k4 + s * (k5 + s * k6)))
        return np.asarray(factor)

    def _bend(self, rays: FloatArray) -> FloatArray:
        """Distorted normalised coordinates (OpenCV's documentation of calib3d; for fisheye Kannala and Brandt 2006)."""
        if not self.distortion.any() and self.model is not DistortionModel.EQUIDISTANT:
            return rays.copy()
        x, y = rays.T
        s = x * x + y * y
        if self.model is DistortionModel.EQUIDISTANT:
            r = np.sqrt(s)
            scale = np.where(r > 1e-12, self._fisheye(np.arctan(r)) / np.where(r > 1e-12, r, 1), 1.0)
            return rays * scale[:, None]
        p1, p2 = self.distortion[2:4].tolist()
        factor = self._radial_factor(s)
        return np.column_stack(
            [x * factor + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * factor + p1 * (s + 2 * y * y) + 2 * p2 * x * y]
        )

    def _slope(self, rays: FloatArray) -> FloatArray:
        """Jacobian (N, 2, 2) of `_bend` for the polynomial models."""
        x, y = rays.T
        s = x * x + y * y
        k1, k2, p1, p2, k3, *rest = self.distortion.tolist()
        over = 1 + s * (k1 + s * (k2 + s * k3))
        d_over = k1 + s * (2 * k2 + s * 3 * k3)
        k4, k5, k6 = rest or (0.0, 0.0, 0.0)
        under = 1 + s * (k4 + s * (k5 + s * k6))
        factor = over / under
        d_factor = (d_over - factor * (k4 + s * (2 * k5 + s * 3 * k6))) / under
        cross = 2 * x * y * d_factor + 2 * p1 * x + 2 * p2 * y
        slope = np.empty((len(x), 2, 2))
        slope[:, 0, 0] = factor + 2 * x * x * d_factor + 2 * p1 * y + 6 * p2 * x
        slope[:, 0, 1] = slope[:, 1, 0] = cross
        slope[:, 1, 1] = factor + 2 * y * y * d_factor + 6 * p1 * y + 2 * p2 * x
        return slope


def _solve_2x2(A: FloatArray, b: FloatArray) -> FloatArray:
    determinant = A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0]
    return np.column_stack(
        [
            (A[:, 1, 1] * b[:, 0] - A[:, 0, 1] * b[:, 1]) / determinant,
            (A[:, 0, 0] * b[:, 1] - A[:, 1, 0] * b[:, 0]) / determinant,
        ]
    )
