"""A scan before it meets the map: thinned, moved to where the LiDAR was when the turn ended, and thinned again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.fast_lio2.state import State, Track
from taskslam.slam.fast_lio2.voxel_map import FREE, key_of, slot_of
from taskslam.slam.inertial.rotations import exp_so3, rotate


def chosen(
    points: npt.NDArray[np.float32], offsets: npt.NDArray[np.int32], every: int, blind: float, range_max: float
) -> tuple[FloatArray, FloatArray]:
    """Every so-manieth point with a range between blind and range_max, (M, 3) float64, and its offset, (M,) seconds."""
    thinned = points[::every].astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.einsum("ij,ij->i", thinned, thinned)
    kept = (squares >= blind * blind) & (squares <= range_max * range_max)  # neither holds for what is not finite
    return thinned[kept], offsets[::every][kept] * 1e-9


@njit(cache=True)
def deskewed(points: FloatArray, offsets: FloatArray, track: Track, state: State) -> FloatArray:
    """(M, 3) points as the LiDAR would have seen them at the scan's end (the paper's Sec. IV-C, back-propagation).

    points: in the LiDAR frame of their own instants; offsets: (M,) seconds, not positive, from the scan's end. track:
    where the IMU was; state: where it is at the end.
    """
    out = np.empty_like(points)
    to_end = np.ascontiguousarray((state.R @ state.R_il).T)
    places = (track.p - state.p) @ to_end.T - state.R_il.T @ state.p_il
    speeds, accelerations = track.v @ to_end.T, track.accelerations @ to_end.T
    rotations = np.empty_like(track.R)
    for k in range(len(track.times)):
        rotations[k] = to_end @ track.R[k]
    for m in range(len(points)):
        k = len(track.times) - 1
        while k > 0 and track.times[k] > offsets[m]:
            k -= 1
        since = offsets[m] - track.times[k]
        x, y, z = rotate(state.R_il, points[m, 0], points[m, 1], points[m, 2])
        x, y, z = x + state.p_il[0], y + state.p_il[1], z + state.p_il[2]
        x, y, z = rotate(exp_so3(track.rates[k] * since), x, y, z)
        x, y, z = rotate(rotations[k], x, y, z)
        half = 0.5 * since * since
        out[m, 0] = x + places[k, 0] + speeds[k, 0] * since + accelerations[k, 0] * half
        out[m, 1] = y + places[k, 1] + speeds[k, 1] * since + accelerations[k, 1] * half
        out[m, 2] = z + places[k, 2] + speeds[k, 2] * since + accelerations[k, 2] * half
    return out


@njit(cache=True)
def centroids(points: FloatArray, size: float) -> FloatArray:
    """(K, 3) mean of the points in each voxel, in the order in which the voxels are first met."""
    room = 16
    while room < 4 * len(points):
        room *= 2
    keys = np.full(room, FREE)
    number = np.empty(room, np.int64)
    sums, counts = np.zeros((len(points), 3)), np.zeros(len(points))
    used = 0
    for m in range(len(points)):
        key = key_of(points[m, 0], points[m, 1], points[m, 2], size)
        if key < 0:
            continue
        slot = slot_of(keys, key)
        if keys[slot] == FREE:
            keys[slot] = key
            number[slot] = used
            used += 1
        for axis in range(3):
            sums[number[slot], axis] += points[m, axis]
        counts[number[slot]] += 1.0
    for u in range(used):
        sums[u] /= counts[u]
    return sums[:used]
