"""`KeyframeMap`: keyframes and points as arrays, and which feature of a keyframe is which point.

A keyframe is a row of `point_of`; row k, column f names the point that feature f of keyframe k shows, or -1. That table
is all there is of the graph between keyframes and points: who sees a point, and which keyframes see the same, is asked
of it by one pass. Rows of keyframes that were culled are used again, those of points are not.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.stereo_adjustment import Sightings
from taskslam.slam.gf_gg.frame import Features, Frame
from taskslam.slam.vision.binary_words import Words, hamming

Ints = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
_FIRST_ROWS = 64


class KeyframeMap:
    """capacity: most features of a keyframe. scale, levels: of the pyramid of the features.

    Of K keyframes: T_camera_world (K, 4, 4); seen (K, F, 3), octaves, descriptors and count as in a frame; alive; born:
    (K,) how many came before; words: (K, F) node of the vocabulary. Of P points: places (P, 3); alive; observers: (P,)
    how many keyframes see it; normals, farthest, as in `search.project`; found, visible: (P,) in how many frames it was
    seen, and should have been; host: (P,) number of the keyframe that brought it.
    """

    def __init__(self, capacity: int, scale: float, levels: int) -> None:
        self.capacity, self.scale, self.levels = capacity, scale, levels
        self.made = 0
        self.keyframe_rows = 0
        self._grids: dict[int, tuple[Ints, Ints, int]] = {}
        self.T_camera_world = np.empty((0, 4, 4))
        self.seen = np.empty((0, capacity, 3))
        self.octaves = np.empty((0, capacity), np.int64)
        self.descriptors = np.empty((0, capacity, 4), np.uint64)
        self.words = np.empty((0, capacity), np.int64)
        self.point_of = np.empty((0, capacity), np.int64)
        self.count = np.empty(0, np.int64)
        self.alive = np.empty(0, np.bool_)
        self.born = np.empty(0, np.int64)
        self.point_rows = 0
        self.places = np.empty((0, 3))
        self.normals = np.empty((0, 3))
        self.farthest = np.empty(0)
        self.point_descriptors = np.empty((0, 4), np.uint64)
        self.point_alive = np.empty(0, np.bool_)
        self.observers = np.empty(0, np.int64)
        self.found = np.empty(0)
        self.visible = np.empty(0)
        self.host = np.empty(0, np.int64)

    def keyframes(self) -> Ints:
        """Rows of those that are there, ascending."""
        return np.flatnonzero(self.alive[: self.keyframe_rows])

    def features_of(self, k: int) -> Features:
        """Of a keyframe, as its frame had them."""
        n = self.count[k]
        return Features(self.seen[k, :n], self.octaves[k, :n], self.descriptors[k, :n], *self._grids[k])

    def centres(self, rows: Ints) -> FloatArray:
        """(M, 3) of their left cameras, in the world."""
        T = self.T_camera_world[rows]
        centres: FloatArray = -np.einsum("kji,kj->ki", T[:, :3, :3], T[:, :3, 3])
        return centres

    def add_keyframe(self, frame: Frame, words: Ints) -> int:
        """Row of a new keyframe with all points that the frame knows. words: (N,) of its features."""
        free = np.flatnonzero(~self.alive[: self.keyframe_rows])
        if len(free):
            k = int(free[0])
        else:
            k = self.keyframe_rows
            self.keyframe_rows += 1
            self._grow(
                ("T_camera_world", "seen", "octaves", "descriptors", "words", "point_of", "count", "alive", "born"), k
            )
        n, features = len(frame), frame.features
        self.T_camera_world[k] = frame.T_camera_world
        self.seen[k, :n], self.octaves[k, :n] = features.seen, features.octaves
        self.descriptors[k, :n], self.words[k, :n] = features.descriptors, words
        self.point_of[k] = -1
        self.point_of[k, :n] = frame.points
        self.count[k], self.alive[k], self.born[k] = n, True, self.made
        self._grids[k] = (features.start, features.features, features.columns)
        self.made += 1
        held = frame.points[frame.points >= 0]
        self.observers[held] += 1
        return k

    def add_points(self, k: int, features: Ints, places: FloatArray) -> Ints:
        """Rows of new (M, 3) points, seen by keyframe k in (M,) of its features."""
        first = self.point_rows
        rows = np.arange(first, first + len(features))
        self.point_rows += len(features)
        names = ("places", "normals", "farthest", "point_descriptors", "point_alive", "observers", "found", "visible")
        self._grow((*names, "host"), self.point_rows - 1)
        rays = places - self.centres(np.array([k]))
        distances = np.linalg.norm(rays, axis=1)
        self.places[rows] = places
        self.normals[rows] = rays / distances[:, None]
        self.farthest[rows] = distances * self.scale ** self.octaves[k, features]
        self.point_descriptors[rows] = self.descriptors[k, features]
        self.point_alive[rows], self.observers[rows], self.host[rows] = True, 1, self.born[k]
        self.found[rows], self.visible[rows] = 1.0, 1.0
        self.point_of[k, features] = rows
        return rows

    def sight(self, k: int, features: Ints, points: Ints) -> None:
        """Keyframe k sees (M,) different points in (M,) features that showed none."""
        self.point_of[k, features] = points
        self.observers[points] += 1

    def unsight(self, keyframes: Ints, features: Ints) -> None:
        """(M,) features of (M,) keyframes show no point any more."""
        points = self.point_of[keyframes, features]
        self.point_of[keyframes, features] = -1
        np.subtract.at(self.observers, points, 1)

    def remove_points(self, points: Ints) -> None:
        """Forget them."""
        if len(points):
            self.point_alive[points] = False
            self.observers[points] = 0
            _replace(self.point_of[: self.keyframe_rows], self._renaming(points, np.full(len(points), -1)))

    def merge_points(self, points: Ints, into: Ints) -> None:
        """Every (M,) point becomes the one of `into`.

        Where a keyframe sees both, in two features, the second of them shows none any more.
        """
        if not len(points):
            return
        table = self.point_of[: self.keyframe_rows]
        _replace(table, self._renaming(points, into))
        self.found[into] += self.found[points]
        self.visible[into] += self.visible[points]
        self.point_alive[points] = False
        touched = np.zeros(self.point_rows, np.bool_)
        touched[into] = True
        _drop_doubles(table, touched)
        self.observers[points] = 0
        self.observers[into] = np.bincount(table[table >= 0], minlength=self.point_rows)[into]

    def remove_keyframe(self, k: int) -> None:
        """Forget it, and the points that nobody else sees."""
        points = self.point_of[k][self.point_of[k] >= 0]
        self.observers[points] -= 1
        self.point_of[k] = -1
        self.alive[k] = False
        del self._grids[k]
        self.remove_points(points[self.observers[points] == 0])

    def shared(self, points: Ints) -> Ints:
        """(K,) how many of these points, -1 being none, each keyframe sees."""
        asked = np.zeros(self.point_rows + 1, np.bool_)
        asked[points] = True
        asked[-1] = False
        counts: Ints = _count_shared(self.point_of[: self.keyframe_rows], asked)
        return counts

    def points_of(self, keyframes: Ints) -> Ints:
        """Rows of all points that these see, ascending."""
        seen = np.zeros(self.point_rows + 1, np.bool_)
        seen[self.point_of[keyframes]] = True
        seen[-1] = False
        return np.flatnonzero(seen)

    def sightings(self, points: Ints) -> tuple[Sightings, Ints, Ints]:
        """Of these points by all keyframes, their rows (K' ,) and (O,) the features; keyframes are numbered by rows."""
        index = np.full(self.point_rows + 1, -1, np.int64)
        index[points] = np.arange(len(points))
        start, keyframes, features = _list_sightings(self.point_of[: self.keyframe_rows], index, len(points))
        octaves = self.octaves[keyframes, features]
        weights = self.scale ** (-2.0 * octaves)
        return Sightings(keyframes, self.seen[keyframes, features], weights, start), keyframes, features

    def refresh(self, points: Ints) -> None:
        """Normals, distances and descriptors of points from all that see them."""
        sightings, keyframes, features = self.sightings(points)
        centres = np.zeros((self.keyframe_rows, 3))
        rows = self.keyframes()
        centres[rows] = self.centres(rows)
        normals, farthest, chosen = _describe(
            sightings, features, self.places[points], centres, self.octaves, self.descriptors, self.born, self.scale
        )
        told = chosen >= 0
        self.normals[points[told]], self.farthest[points[told]] = normals[told], farthest[told]
        at = chosen[told]
        self.point_descriptors[points[told]] = self.descriptors[keyframes[at], features[at]]

    def _renaming(self, points: Ints, into: Ints) -> Ints:
        """(P + 1,) the new row of each point; the last is -1, for -1 itself."""
        renamed = np.arange(self.point_rows + 1)
        renamed[-1] = -1
        renamed[points] = into
        return renamed

    def _grow(self, names: tuple[str, ...], row: int) -> None:
        for name in names:
            array = getattr(self, name)
            if row >= len(array):
                larger = np.zeros((max(_FIRST_ROWS, 2 * len(array), row + 1), *array.shape[1:]), array.dtype)
                larger[: len(array)] = array
                setattr(self, name, larger)


@njit(cache=True)
def _replace(table: Ints, renamed: Ints) -> None:
    for k in range(table.shape[0]):
        for f in range(table.shape[1]):
            table[k, f] = renamed[table[k, f]]


@njit(cache=True)
def _drop_doubles(table: Ints, touched: Flags) -> None:
    last = np.full(len(touched), -1, np.int64)
    for k in range(table.shape[0]):
        for f in range(table.shape[1]):
            p = table[k, f]
            if p >= 0 and touched[p]:
                if last[p] == k:
                    table[k, f] = -1
                last[p] = k


@njit(cache=True)
def _count_shared(table: Ints, asked: Flags) -> Ints:
    counts = np.zeros(table.shape[0], np.int64)
    for k in range(table.shape[0]):
        for f in range(table.shape[1]):
            if asked[table[k, f]]:
                counts[k] += 1
    return counts


@njit(cache=True)
def _list_sightings(table: Ints, index: Ints, points: int) -> tuple[Ints, Ints, Ints]:
    """(points + 1,) start, and keyframe and feature of each sighting, by point and then by keyframe."""
    start = np.zeros(points + 1, np.int64)
    for k in range(table.shape[0]):
        for f in range(table.shape[1]):
            i = index[table[k, f]]
            if i >= 0:
                start[i + 1] += 1
    start = np.cumsum(start)
    filled = start.copy()
    keyframes, features = np.empty(start[-1], np.int64), np.empty(start[-1], np.int64)
    for k in range(table.shape[0]):
        for f in range(table.shape[1]):
            i = index[table[k, f]]
            if i >= 0:
                keyframes[filled[i]], features[filled[i]] = k, f
                filled[i] += 1
    return start, keyframes, features


@njit(cache=True)
def _describe(
    sightings: Sightings,
    features: Ints,
    places: FloatArray,
    centres: FloatArray,
    octaves: Ints,
    descriptors: Words,
    born: Ints,
    scale: float,
) -> tuple[FloatArray, FloatArray, Ints]:
    """Mean direction, distance for the finest octave, and the sighting least unlike the others, -1 where there is none.

    The octave is that of the oldest keyframe that sees the point; the descriptor has the least median distance from the
    others (Mur-Artal et al. 2015, section III.C).
    """
    n = len(places)
    normals, farthest, chosen = np.zeros((n, 3)), np.zeros(n), np.full(n, -1, np.int64)
    for i in range(n):
        first, last = sightings.start[i], sightings.start[i + 1]
        if first == last:
            continue
        oldest = first
        for o in range(first, last):
            k = sightings.keyframes[o]
            d = places[i] - centres[k]
            normals[i] += d / max(np.sqrt(np.sum(d * d)), 1e-9)
            if born[k] < born[sightings.keyframes[oldest]]:
                oldest = o
        normals[i] /= max(np.sqrt(np.sum(normals[i] * normals[i])), 1e-9)
        k = sightings.keyframes[oldest]
        d = places[i] - centres[k]
        farthest[i] = np.sqrt(np.sum(d * d)) * scale ** octaves[k, features[oldest]]
        best, middle = 257, (last - first - 1) // 2
        distances = np.empty(last - first, np.int64)
        for o in range(first, last):
            for other in range(first, last):
                distances[other - first] = hamming(
                    descriptors[sightings.keyframes[o]],
                    features[o],
                    descriptors[sightings.keyframes[other]],
                    features[other],
                )
            median = np.sort(distances)[middle]
            if median < best:
                best, chosen[i] = median, o
    return normals, farthest, chosen
