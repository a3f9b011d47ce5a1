"""What a keyframe brings: points, the adjustment of what is around it, and the end of what is not needed.

The steps are those of ORB-SLAM's local mapping (Mur-Artal et al. 2015, section VI; stereo: Mur-Artal and Tardos 2017),
one after another as the keyframe comes, so that the same pictures give the same map.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray, invert_se3
from taskslam.slam.bundle.stereo_adjustment import Sightings, adjust, reduced_equations, squared_errors
from taskslam.slam.gf_gg.frame import Frame
from taskslam.slam.gf_gg.good_graph import select_blocks
from taskslam.slam.gf_gg.keyframe_map import KeyframeMap
from taskslam.slam.gf_gg.search import Views, project, search
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.gf_gg.triangulation import match_between, triangulate
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
_LEAST_SHARED = 15  # points that make two keyframes neighbours
_LEAST_FOUND = 0.25  # of the frames in which a point should be seen
_PROBATION = 2  # keyframes within which a point must have been seen by a second one
_WITNESSES = 3  # other keyframes that make a keyframe's point redundant
_DAMPING = 1e-4  # of the system in which keyframes are selected
_VIRTUAL_SHARE = 4  # one in so many of the points is enough for the virtual frame


class LocalMapping:
    """Works on one map. width, height: of the pictures."""

    def __init__(
        self, settings: GfGgSettings, pinhole: Pinhole, width: int, height: int, slam_map: KeyframeMap
    ) -> None:
        self._settings, self._pinhole, self._size, self._map = settings, pinhole, (width, height), slam_map
        self.recent = np.empty(0, np.int64)  # points on probation

    def add_stereo_points(self, k: int, frame: Frame) -> None:
        """Give a point to all near features without one, and to the nearest of the others until there are enough."""
        s = self._settings
        depths = frame.depths(self._pinhole)
        order = np.argsort(depths, kind="stable")
        order = order[: np.count_nonzero(depths > 0.0)]
        near = depths[order] <= s.close_depth * self._pinhole.baseline
        kept = order[near | (np.arange(len(order)) < s.close_tracked)]
        new = np.sort(kept[frame.points[kept] < 0])
        frame.points[new] = self._map.add_points(k, new, unproject(frame, new, depths, self._pinhole))
        self.recent = np.concatenate((self.recent, frame.points[new]))

    def process(self, k: int, T_camera_ahead: FloatArray | None) -> None:
        """All steps for keyframe k.

        T_camera_ahead: (4, 4) where the camera is expected from k, as the virtual frame of the good graph, or None.
        """
        slam_map = self._map
        self._end_probation(k)
        neighbours = self.neighbours(k)
        self._triangulate(k, neighbours)
        self._fuse(k, neighbours)
        slam_map.refresh(slam_map.points_of(np.array([k])))
        self._adjust(k, T_camera_ahead)
        self._cull_keyframes(k)

    def neighbours(self, k: int) -> Ints:
        """Keyframes that share most points with k, the best first."""
        shared = self._map.shared(self._map.point_of[k])
        shared[k] = 0
        order = np.argsort(-shared, kind="stable")
        return order[shared[order] >= _LEAST_SHARED]

    def _end_probation(self, k: int) -> None:
        slam_map, recent = self._map, self.recent
        recent = recent[slam_map.point_alive[recent]]
        age = slam_map.born[k] - slam_map.host[recent]
        bad = slam_map.found[recent] < _LEAST_FOUND * slam_map.visible[recent]
        bad |= (age >= _PROBATION) & (slam_map.observers[recent] < 2)
        slam_map.remove_points(recent[bad])
        self.recent = recent[~bad & (age < _PROBATION + 1)]

    def _triangulate(self, k: int, neighbours: Ints) -> None:
        s, slam_map, pinhole = self._settings, self._map, self._pinhole
        n, T = slam_map.count[k], slam_map.T_camera_world[k]
        for other in neighbours[: s.neighbours]:
            m = slam_map.count[other]
            T_other_k = slam_map.T_camera_world[other] @ invert_se3(T)
            if np.linalg.norm(T_other_k[:3, 3]) < pinhole.baseline:
                continue
            seen = slam_map.seen[k, :n], slam_map.seen[other, :m]
            octaves = slam_map.octaves[k, :n], slam_map.octaves[other, :m]
            matches = match_between(
                T_other_k,
                seen,
                octaves,
                (slam_map.descriptors[k, :n], slam_map.descriptors[other, :m]),
                (slam_map.words[k, :n], slam_map.words[other, :m]),
                (slam_map.point_of[k, :n] < 0, slam_map.point_of[other, :m] < 0),
                pinhole,
                s.scale,
                s.strict_distance,
            )
            first = np.flatnonzero(matches >= 0)
            second = matches[first]
            places = triangulate(
                T,
                slam_map.T_camera_world[other],
                (seen[0][first], seen[1][second]),
                (octaves[0][first], octaves[1][second]),
                pinhole,
                s.scale,
            )
            good = np.isfinite(places[:, 0])
            rows = slam_map.add_points(k, first[good], places[good])
            slam_map.sight(int(other), second[good], rows)
            self.recent = np.concatenate((self.recent, rows))

    def _fuse(self, k: int, neighbours: Ints) -> None:
        """Look for the points of k in its neighbours and the other way round; points in one feature become one."""
        near = neighbours[: self._settings.neighbours]
        for other in near.tolist():
            self.look_in(other, self._map.points_of(np.array([k])))
        self.look_in(k, self._map.points_of(near))

    def look_in(self, k: int, points: Ints, radius: float | None = None) -> None:
        """Points found in features of keyframe k are seen by it; those of features with a point become one with it.

        radius: pixels of the finest octave; default: that of the search for the local map.
        """
        s, slam_map = self._settings, self._map
        asked = points[~np.isin(points, slam_map.point_of[k])]
        found = search(
            slam_map.features_of(k),
            self.views(slam_map.T_camera_world[k], asked),
            slam_map.point_descriptors[asked],
            s.local_map_radius if radius is None else radius,
            s.scale,
            np.zeros(slam_map.count[k], np.bool_),
            s.strict_distance,
            1.0,
        )
        points, features = asked[found >= 0], found[found >= 0]
        there = slam_map.point_of[k, features]
        slam_map.sight(k, features[there < 0], points[there < 0])
        points, there = points[there >= 0], there[there >= 0]
        fewer = slam_map.observers[points] < slam_map.observers[there]
        slam_map.merge_points(np.where(fewer, points, there), np.where(fewer, there, points))

    def views(self, T_camera_world: FloatArray, points: Ints) -> Views:
        """Where a camera should see points of the map."""
        s, slam_map = self._settings, self._map
        views: Views = project(
            T_camera_world,
            slam_map.places[points],
            slam_map.normals[points],
            slam_map.farthest[points],
            self._pinhole,
            *self._size,
            s.scale,
            s.levels,
        )
        return views

    def _adjust(self, k: int, T_camera_ahead: FloatArray | None) -> None:
        """Keyframe k, its neighbours and their points; other keyframes that see these hold the gauge."""
        s, slam_map = self._settings, self._map
        free = np.concatenate(([k], self.neighbours(k)))
        free = free[slam_map.born[free] > 0]
        if s.good_graph and len(free) > s.graph_threshold:
            free = self._good_graph(free[: s.graph_cap], T_camera_ahead)
        if not len(free):
            return
        points = slam_map.points_of(free)
        sightings, keyframes, features = slam_map.sightings(points)
        held = np.setdiff1d(keyframes, free)
        rows = np.concatenate((free, held))
        numbered = _numbered(sightings, rows, slam_map.keyframe_rows)
        poses, places = slam_map.T_camera_world[rows], slam_map.places[points]
        poses, places, _ = adjust(poses, len(free), places, numbered, self._pinhole, s.adjust_iterations, True)
        good = squared_errors(poses, places, numbered, self._pinhole) <= 1.0
        if s.polish_iterations:
            trusted = numbered._replace(weights=numbered.weights * good)
            poses, places, _ = adjust(poses, len(free), places, trusted, self._pinhole, s.polish_iterations, False)
            good = squared_errors(poses, places, numbered, self._pinhole) <= 1.0
        slam_map.T_camera_world[free] = poses[: len(free)]
        slam_map.places[points] = places
        slam_map.unsight(keyframes[~good], features[~good])
        slam_map.remove_points(points[slam_map.observers[points] < 1])
        slam_map.refresh(points[slam_map.observers[points] >= 1])

    def _good_graph(self, candidates: Ints, T_camera_ahead: FloatArray | None) -> Ints:
        """The budget's worth of keyframes, the first of the candidates among them, that determine the most."""
        s, slam_map = self._settings, self._map
        points = slam_map.points_of(candidates)
        sightings, keyframes, _ = slam_map.sightings(points)
        rows = np.concatenate((candidates, np.setdiff1d(keyframes, candidates)))
        numbered = _numbered(sightings, rows, slam_map.keyframe_rows)
        poses = slam_map.T_camera_world[rows]
        free, first = len(candidates), [0]
        if T_camera_ahead is not None:
            ahead = T_camera_ahead @ slam_map.T_camera_world[candidates[0]]
            views = self.views(ahead, points)
            numbered = _with_virtual(numbered, views, free, s.scale)
            poses = np.concatenate((poses[:free], ahead[None], poses[free:]))
            free, first = free + 1, [0, free]
        places = slam_map.places[points]
        system = reduced_equations(poses, free, places, numbered, self._pinhole, True, _DAMPING)
        chosen = select_blocks(system.S, np.array(first), s.graph_threshold + len(first) - 1)
        kept: Ints = candidates[chosen[chosen < len(candidates)]]
        return kept

    def _cull_keyframes(self, k: int) -> None:
        """Remove neighbours that show nothing but what at least three others show as well, and as finely."""
        slam_map = self._map
        close = self._settings.close_depth * self._pinhole.baseline
        for other in self.neighbours(k):
            if slam_map.born[other] == 0 or slam_map.made - slam_map.born[other] <= _WITNESSES:
                continue
            points = slam_map.points_of(np.array([other]))
            depths = slam_map.places[points] @ slam_map.T_camera_world[other, 2, :3]
            points = points[depths + slam_map.T_camera_world[other, 2, 3] <= close]
            sightings, keyframes, features = slam_map.sightings(points)
            octaves = slam_map.octaves[keyframes, features]
            redundant = _count_redundant(sightings.start, keyframes, octaves, int(other))
            if len(points) and redundant > self._settings.redundant_share * len(points):
                slam_map.remove_keyframe(int(other))


def unproject(frame: Frame, features: Ints, depths: FloatArray, pinhole: Pinhole) -> FloatArray:
    """(M, 3) places in the world of a frame's features with a depth."""
    z = depths[features]
    seen = frame.features.seen[features]
    in_camera = np.column_stack(
        ((seen[:, 0] - pinhole.cx) / pinhole.f * z, (seen[:, 1] - pinhole.cy) / pinhole.f * z, z)
    )
    T_world_camera = invert_se3(frame.T_camera_world)
    places: FloatArray = in_camera @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]
    return places


def _numbered(sightings: Sightings, rows: Ints, count: int) -> Sightings:
    """With keyframes numbered by their position in `rows`."""
    numbers = np.empty(count, np.int64)
    numbers[rows] = np.arange(len(rows))
    return sightings._replace(keyframes=numbers[sightings.keyframes])


def _with_virtual(sightings: Sightings, views: Views, number: int, scale: float) -> Sightings:
    """With what a keyframe that is not there yet, and gets number `number`, would see."""
    seen = np.flatnonzero(views.octaves >= 0)[::_VIRTUAL_SHARE]
    counts = np.diff(sightings.start)
    of_point = np.concatenate((np.repeat(np.arange(len(counts)), counts), seen))
    order = np.argsort(of_point, kind="stable")
    keyframes = np.concatenate(
        (sightings.keyframes + (sightings.keyframes >= number), np.full(len(seen), number, np.int64))
    )
    places = np.concatenate((sightings.seen, views.places[seen]))
    weights = np.concatenate((sightings.weights, scale ** (-2.0 * views.octaves[seen])))
    start = np.searchsorted(of_point[order], np.arange(len(counts) + 1))
    return Sightings(keyframes[order], places[order], weights[order], start)


@njit(cache=True)
def _count_redundant(start: Ints, keyframes: Ints, octaves: Ints, own: int) -> int:
    """Points of keyframe `own` that enough others see at its octave, one coarser, or finer."""
    redundant = 0
    for i in range(len(start) - 1):
        octave = -1
        for o in range(start[i], start[i + 1]):
            if keyframes[o] == own:
                octave = octaves[o]
        others = 0
        for o in range(start[i], start[i + 1]):
            if keyframes[o] != own and octaves[o] <= octave + 1:
                others += 1
        if others >= _WITNESSES:
            redundant += 1
    return redundant
