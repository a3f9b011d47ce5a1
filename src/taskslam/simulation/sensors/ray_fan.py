"""A fixed bundle of rays on a sensor that rides on the base, turned into the world for one pose or one pose per ray."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray


class RayFan:
    """directions: (N, 3) unit vectors in the sensor frame; T_base_sensor: (4, 4) mount. The base stays level."""

    def __init__(self, directions: FloatArray, T_base_sensor: FloatArray) -> None:
        self._directions = np.ascontiguousarray(directions @ T_base_sensor[:3, :3].T)
        self._origin = np.ascontiguousarray(T_base_sensor[:3, 3])

    def at(self, poses: FloatArray) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """(N, 3) float32 origins and directions in `map`, for poses (1, 3) or (N, 3) of the base."""
        origins, directions = _turn(self._directions, self._origin, poses)
        return origins, directions


@njit(cache=True)
def _turn(directions, origin, poses):  # type: ignore[no-untyped-def]
    origins, turned = np.empty(directions.shape, np.float32), np.empty(directions.shape, np.float32)
    if len(poses) == 1:  # one sine for all: LLVM vectorises a loop without any
        _turn_by(poses[0], directions, origin, origins, turned)
    else:
        for i in range(len(directions)):
            _turn_by(poses[i], directions[i : i + 1], origin, origins[i : i + 1], turned[i : i + 1])
    return origins, turned


@njit(cache=True)
def _turn_by(pose, directions, origin, origins, turned):  # type: ignore[no-untyped-def]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x, y = pose[0] + c * origin[0] - s * origin[1], pose[1] + s * origin[0] + c * origin[1]
    for i in range(len(directions)):
        turned[i, 0] = c * directions[i, 0] - s * directions[i, 1]
        turned[i, 1] = s * directions[i, 0] + c * directions[i, 1]
        turned[i, 2] = directions[i, 2]
        origins[i, 0], origins[i, 1], origins[i, 2] = x, y, origin[2]
