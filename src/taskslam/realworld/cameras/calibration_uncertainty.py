"""How surely a calibration is known: of each parameter, and in pixels over the image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.camera_model import Camera, DistortionModel

MAP_COLUMNS, MAP_ROWS = 16, 9

_STEP = 1e-6
_NAMES = {
    DistortionModel.PLUMB_BOB: ("k1", "k2", "p1", "p2"),
    DistortionModel.RATIONAL_POLYNOMIAL: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    DistortionModel.EQUIDISTANT: ("k1", "k2", "k3", "k4"),
}

BoardSeen = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """deviations: (P,) standard deviation of each parameter. image: (9, 16) px, of where a known ray meets the image.

    The image's are what remains after the best rotation of the camera, since a turned camera is no wrong lens.
    """

    deviations: FloatArray
    image: FloatArray


def parameter_names(model: DistortionModel) -> tuple[str, ...]:
    """Names of the estimated parameters in their order."""
    return ("fx", "fy", "cx", "cy", *_NAMES[model])


def uncertainty(camera: Camera, views: Sequence[BoardSeen]) -> Uncertainty:
    """From the residuals of a fit. views: points (N, 3), outward (N, 2), T_camera_board (4, 4) and errors (N, 2) px.

    The larger of two covariances: of independent corner errors (inverse normal matrix times the residual variance), and
    of errors that go together within a view (jackknife over views in closed form: Bell and McCaffrey 2002, "CR3").
    """
    slopes, errors = [], []
    count = len(parameter_names(camera.model))
    for points, outward, T, error in views:
        by_camera, by_pose = _slopes(camera, points, T)
        by_camera = np.column_stack([by_camera, outward.ravel()])  # the spread of edges is estimated, too
        basis = np.linalg.qr(by_pose)[0]
        slopes.append(by_camera - basis @ (basis.T @ by_camera))  # what no motion of the board can undo
        errors.append(error.ravel())
    inverse = np.linalg.pinv(sum((M.T @ M for M in slopes), np.zeros((count + 1, count + 1))), hermitian=True)
    spare = max(1, sum(e.size for e in errors) - count - 6 * len(views))
    independent = inverse * sum(float(e @ e) for e in errors) / spare
    shifts = []
    for M, e in zip(slopes, errors, strict=True):
        leverage = np.eye(len(e)) - M @ inverse @ M.T
        shifts.append(inverse @ M.T @ np.linalg.lstsq(leverage, e, rcond=None)[0])
    jackknife = np.array(shifts).T @ np.array(shifts) * (len(views) - 1) / len(views)
    independent, jackknife = independent[:count, :count], jackknife[:count, :count]

    deviations = np.sqrt(np.maximum(np.diag(independent), np.diag(jackknife)))
    spread = _over_the_image(camera)
    image = np.sqrt(
        np.maximum(*(np.einsum("nip,pq,niq->n", spread, C, spread) for C in (independent, jackknife)))
    ).reshape(MAP_ROWS, MAP_COLUMNS)
    return Uncertainty(deviations, image)


def _slopes(camera: Camera, points: FloatArray, T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the pixels (2N,) by the camera's parameters (2N, P) and by a small motion of the board (2N, 6)."""
    at = points @ T[:3, :3].T + T[:3, 3]

    def moved(step: FloatArray) -> FloatArray:
        return camera.project(at @ Rotation.from_rotvec(step[:3]).as_matrix().T + step[3:])

    by_pose = _differences(moved, 6, np.full(6, _STEP))
    return _by_parameters(camera, at[:, :2] / at[:, 2:]), by_pose


def _by_parameters(camera: Camera, rays: FloatArray) -> FloatArray:
    count = len(parameter_names(camera.model))

    def changed(step: FloatArray) -> FloatArray:
        K = camera.K + np.array([[step[0], 0, step[2]], [0, step[1], step[3]], [0, 0, 0]])
        distortion = camera.distortion.copy()
        distortion[: count - 4] += step[4:]
        return Camera(camera.name, camera.width, camera.height, K, distortion, camera.model).distort(rays)

    return _differences(changed, count, np.array([1e-3] * 4 + [_STEP] * (count - 4)))


def _differences(function, count: int, steps: FloatArray) -> FloatArray:  # type: ignore[no-untyped-def]
    columns = [
        (function(e * h) - function(-e * h)).ravel() / (2 * h) for e, h in zip(np.eye(count), steps, strict=True)
    ]
    return np.asarray(np.nan_to_num(np.column_stack(columns)))


def _over_the_image(camera: Camera) -> FloatArray:
    """(N, 2, P) derivatives of the pixels of rays all over the image, less what a rotation of the camera explains."""
    u = (np.arange(MAP_COLUMNS) + 0.5) / MAP_COLUMNS * camera.width - 0.5
    v = (np.arange(MAP_ROWS) + 0.5) / MAP_ROWS * camera.height - 0.5
    rays = camera.undistort(np.stack(np.meshgrid(u, v), -1).reshape(-1, 2))
    directions = np.column_stack([rays, np.ones(len(rays))])
    by_camera = _by_parameters(camera, rays)

    def turned(step: FloatArray) -> FloatArray:
        return camera.project(directions @ Rotation.from_rotvec(step).as_matrix().T)

    basis = np.linalg.qr(_differences(turned, 3, np.full(3, _STEP)))[0]
    return np.asarray((by_camera - basis @ (basis.T @ by_camera)).reshape(len(rays), 2, -1))
