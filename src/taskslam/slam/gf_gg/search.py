"""Points of the map, looked for in a picture where they should be (Mur-Artal et al. 2015, section V)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.gf_gg.frame import CELL, Features
from taskslam.slam.vision.binary_words import Words, hamming
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
_NEAREST = 0.05  # m
_STEEPEST = 0.5  # cosine between the direction from which a point was seen, and from which it is looked at
_HEAD_ON, _NARROW = 0.998, 2.5 / 4.0  # seen so straight, it is looked for in so much of the radius


class Views(NamedTuple):
    """Where points should be seen. places: (N, 3) u, v, u in the right picture; octaves: (N,), -1: not at all.

    reach: (N,) radius in pixels in which to look, in units of that of the search.
    """

    places: FloatArray
    octaves: Ints
    reach: FloatArray


@njit(cache=True)
def project(
    T: FloatArray,
    places: FloatArray,
    normals: FloatArray,
    farthest: FloatArray,
    pinhole: Pinhole,
    width: int,
    height: int,
    scale: float,
    levels: int,
) -> Views:
    """Where a camera at (4, 4) T, `T_camera_world`, should see (N, 3) points of the world.

    normals: (N, 3) mean directions from the cameras that saw them. farthest: (N,) m, the distance at which a feature of
    the finest octave is to be expected; with every octave it is nearer by `scale`.
    """
    n = len(places)
    seen, octaves, reach = np.empty((n, 3)), np.full(n, -1, np.int64), np.ones(n)
    centre = np.zeros(3)
    for i in range(3):
        for j in range(3):
            centre[i] -= T[j, i] * T[j, 3]
    for i in range(n):
        X = places[i]
        z = T[2, 0] * X[0] + T[2, 1] * X[1] + T[2, 2] * X[2] + T[2, 3]
        if z < _NEAREST:
            continue
        x = T[0, 0] * X[0] + T[0, 1] * X[1] + T[0, 2] * X[2] + T[0, 3]
        y = T[1, 0] * X[0] + T[1, 1] * X[1] + T[1, 2] * X[2] + T[1, 3]
        u, v = pinhole.f * x / z + pinhole.cx, pinhole.f * y / z + pinhole.cy
        if not (0.0 <= u <= width - 1.0 and 0.0 <= v <= height - 1.0):
            continue
        dx, dy, dz = X[0] - centre[0], X[1] - centre[1], X[2] - centre[2]
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        if distance > 1.2 * farthest[i] or distance < 0.8 * farthest[i] / scale ** (levels - 1):
            continue
        cosine = (dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]) / distance
        if cosine < _STEEPEST:
            continue
        octave = math.ceil(math.log(farthest[i] / distance) / math.log(scale))
        octaves[i] = min(max(octave, 0), levels - 1)
        seen[i, 0], seen[i, 1], seen[i, 2] = u, v, u - pinhole.f * pinhole.baseline / z
        if cosine > _HEAD_ON:
            reach[i] = _NARROW
    return Views(seen, octaves, reach)


@njit(cache=True)
def nearest_feature(
    features: Features,
    place: FloatArray,
    low: int,
    high: int,
    radius: float,
    descriptors: Words,
    row: int,
    taken: npt.NDArray[np.bool_],
    most: int,
    ratio: float,
) -> int:
    """The feature within `radius` of (3,) u, v, u right, of octaves low to high, that is most like a descriptor; or -1.

    most: bits by which it may differ. ratio: it must differ by less than so much of the second best of its octave.
    taken: (N,) features that are not asked.
    """
    seen, octaves = features.seen, features.octaves
    rows = (len(features.start) - 1) // features.columns
    left = max(int((place[0] - radius) // CELL), 0)
    right = min(int((place[0] + radius) // CELL), features.columns - 1)
    top, bottom = max(int((place[1] - radius) // CELL), 0), min(int((place[1] + radius) // CELL), rows - 1)
    best, second, found, second_octave = 257, 257, -1, -1
    for r in range(top, bottom + 1):
        for at in range(features.start[r * features.columns + left], features.start[r * features.columns + right + 1]):
            i = features.features[at]
            if taken[i] or octaves[i] < low or octaves[i] > high:
                continue
            if abs(seen[i, 0] - place[0]) > radius or abs(seen[i, 1] - place[1]) > radius:
                continue
            if abs(seen[i, 2] - place[2]) > radius:  # never so without a disparity
                continue
            distance = hamming(descriptors, row, features.descriptors, i)
            if distance < best:
                second, second_octave = best, octaves[found] if found >= 0 else -1
                best, found = distance, i
            elif distance < second:
                second, second_octave = distance, octaves[i]
    if best > most or (found >= 0 and octaves[found] == second_octave and best > ratio * second):
        return -1
    return found


@njit(cache=True)
def search(
    features: Features,
    views: Views,
    descriptors: Words,
    radius: float,
    scale: float,
    taken: npt.NDArray[np.bool_],
    most: int,
    ratio: float,
) -> Ints:
    """(N,) the feature in which each point is seen, or -1; fills `taken`. radius: pixels of the finest octave."""
    found = np.full(len(views.octaves), -1, np.int64)
    for i in range(len(found)):
        octave = views.octaves[i]
        if octave < 0:
            continue
        r = radius * views.reach[i] * scale**octave
        j = nearest_feature(features, views.places[i], octave - 1, octave + 1, r, descriptors, i, taken, most, ratio)
        if j >= 0:
            found[i] = j
            taken[j] = True
    return found
