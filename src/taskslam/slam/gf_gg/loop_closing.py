"""Places seen again after a way round: recognised by their words, measured by their points, and the map put right.

Mur-Artal et al. 2015, section VII, with the rigid motion of a stereo camera for the similarity (Mur-Artal and Tardos
2017, section III.D): a keyframe that looks like old ones it shares no points with, three times running, is located
among their points; the pose graph spreads the difference over all keyframes between, and points seen twice become one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, invert_se3
from taskslam.slam.bundle.stereo_pose import solve_stereo_pose
from taskslam.slam.bundle.three_point_pose import draw_pose
from taskslam.slam.gf_gg.keyframe_map import KeyframeMap
from taskslam.slam.gf_gg.local_mapping import LocalMapping
from taskslam.slam.gf_gg.places import Places, match_by_words
from taskslam.slam.gf_gg.search import search
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.vision.pinhole import Pinhole

Ints = npt.NDArray[np.int64]
_LEAST_BY_WORDS, _LEAST_FITTING = 20, 15
_ALIKE = 0.75  # of the second best, by which a match of words must be better
_RADIUS, _FUSED_RADIUS = 10.0, 4.0
_STRONG = 100  # points that two keyframes share, whose motion then is an edge of the graph
_NO_DRIFT_M, _NO_DRIFT_RAD = 0.01, 0.003  # less is left to the adjustment


class LoopClosing:
    """Watches the keyframes of one map."""

    def __init__(
        self, settings: GfGgSettings, pinhole: Pinhole, slam_map: KeyframeMap, mapping: LocalMapping, places: Places
    ) -> None:
        self._settings, self._pinhole = settings, pinhole
        self._map, self._mapping, self._places = slam_map, mapping, places
        self._groups: list[tuple[frozenset[int], int]] = []
        self.closed = 0

    def process(self, k: int) -> bool:
        """Whether keyframe k closed a loop; poses and points have then moved."""
        for candidate in self._recognised(k):
            located = self._locate(k, candidate)
            if located is not None:
                self._close(k, candidate, *located)
                self._groups = []
                self.closed += 1
                return True
        return False

    def _recognised(self, k: int) -> list[int]:
        """Keyframes that look like k as its neighbours do, as did some near them for the last keyframes."""
        slam_map = self._map
        neighbours = self._mapping.neighbours(k)
        others = np.setdiff1d(slam_map.keyframes(), np.append(np.flatnonzero(slam_map.shared(slam_map.point_of[k])), k))
        if not len(neighbours) or not len(others):
            self._groups = []
            return []
        bag = self._places.bag(k)
        least = self._places.scores(bag, neighbours).min()
        scores = self._places.scores(bag, others)
        alike = others[np.argsort(-scores, kind="stable")][: self._settings.candidates]
        alike = alike[np.sort(scores)[::-1][: len(alike)] >= least]
        groups, accepted = [], []
        for candidate in alike.tolist():
            group = frozenset([candidate, *self._mapping.neighbours(candidate).tolist()])
            before = max((count for other, count in self._groups if group & other), default=0)
            groups.append((group, before + 1))
            if before + 1 >= self._settings.loop_consistency:
                accepted.append(candidate)
        self._groups = groups
        return accepted

    def _locate(self, k: int, candidate: int) -> tuple[FloatArray, Ints, Ints] | None:
        """(4, 4) `T_camera_world` of k among the candidate's points; points and features of k that fit it; or None."""
        s, slam_map = self._settings, self._map
        n = slam_map.count[k]
        rows = np.flatnonzero(slam_map.point_of[candidate] >= 0)
        matches = match_by_words(
            slam_map.descriptors[candidate, rows],
            slam_map.words[candidate, rows],
            slam_map.descriptors[k, :n],
            slam_map.words[k, :n],
            s.strict_distance,
            _ALIKE,
        )
        points, features = slam_map.point_of[candidate, rows[matches >= 0]], matches[matches >= 0]
        if len(points) < _LEAST_BY_WORDS:
            return None
        weights = slam_map.scale ** (-2.0 * slam_map.octaves[k, :n])
        seen = slam_map.seen[k, :n]
        T, fits = draw_pose(
            slam_map.places[points], seen[features], weights[features], self._pinhole, s.ransac_draws, s.seed
        )
        if np.count_nonzero(fits) < _LEAST_FITTING:
            return None
        points = slam_map.points_of(np.append(self._mapping.neighbours(candidate)[: s.neighbours], candidate))
        for _ in range(2):
            found = search(
                slam_map.features_of(k),
                self._mapping.views(T, points),
                slam_map.point_descriptors[points],
                _RADIUS,
                s.scale,
                np.zeros(n, np.bool_),
                s.match_distance,
                s.ratio,
            )
            matched = np.flatnonzero(found >= 0)
            features = found[matched]
            T, fits, _ = solve_stereo_pose(
                T, slam_map.places[points[matched]], seen[features], weights[features], self._pinhole
            )
        if np.count_nonzero(fits) < s.loop_matches:
            return None
        return T, points[matched[fits]], features[fits]

    def _close(self, k: int, candidate: int, T_camera_world: FloatArray, points: Ints, features: Ints) -> None:
        slam_map = self._map
        change = T_camera_world @ invert_se3(slam_map.T_camera_world[k])
        angle = np.arccos(np.clip(0.5 * (np.trace(change[:3, :3]) - 1.0), -1.0, 1.0))
        if np.linalg.norm(change[:3, 3]) > _NO_DRIFT_M or angle > _NO_DRIFT_RAD:
            self._spread(k, candidate, T_camera_world)
        unseen = ~np.isin(points, slam_map.point_of[k])
        points, features = points[unseen], features[unseen]
        there = slam_map.point_of[k, features]
        new = there < 0
        slam_map.sight(k, features[new], points[new])
        slam_map.merge_points(there[~new], points[~new])
        around = np.append(self._mapping.neighbours(candidate)[: self._settings.neighbours], candidate)
        for other in [k, *self._mapping.neighbours(k)[: self._settings.neighbours].tolist()]:
            if other not in around:
                self._mapping.look_in(other, slam_map.points_of(around), _FUSED_RADIUS)
        slam_map.refresh(slam_map.points_of(np.array([k])))

    def _spread(self, k: int, candidate: int, T_camera_world: FloatArray) -> None:
        """Move all keyframes as the pose graph says, and every point with the oldest keyframe that sees it."""
        slam_map = self._map
        rows = slam_map.keyframes()
        rows = rows[np.argsort(slam_map.born[rows], kind="stable")]
        before = slam_map.T_camera_world.copy()
        edges = [(i, j, before[i] @ invert_se3(before[j])) for i, j in self._edges(rows)]
        edges.append((k, candidate, T_camera_world @ invert_se3(before[candidate])))
        slam_map.T_camera_world[rows] = optimise_poses(before[rows], rows, edges)
        moved = np.zeros(slam_map.point_rows, np.bool_)
        for row in rows.tolist():
            points = slam_map.points_of(np.array([row]))
            points = points[~moved[points]]
            T = invert_se3(slam_map.T_camera_world[row]) @ before[row]
            slam_map.places[points] = slam_map.places[points] @ T[:3, :3].T + T[:3, 3]
            slam_map.normals[points] = slam_map.normals[points] @ T[:3, :3].T
            moved[points] = True

    def _edges(self, rows: Ints) -> list[tuple[int, int]]:
        """Pairs of keyframes, the younger first, that share many points, and of each its best elder."""
        slam_map, edges = self._map, []
        for row in rows[1:]:
            shared = slam_map.shared(slam_map.point_of[row])
            shared[slam_map.born[: len(shared)] >= slam_map.born[row]] = 0
            strong = np.union1d(np.flatnonzero(shared >= _STRONG), [np.argmax(shared)])
            edges += [(int(row), int(other)) for other in strong]
        return edges


def optimise_poses(poses: FloatArray, rows: Ints, edges: list[tuple[int, int, FloatArray]]) -> FloatArray:
    """(K, 4, 4) `T_camera_world` that agree best with the edges; the first is held.

    poses: (K, 4, 4) to start from, of keyframes `rows`. edges: i, j, (4, 4) `T_i_j`, all of equal weight. By gtsam
    (Levenberg-Marquardt on Pose3), whose wheels run one thread: the same input gives the same bytes.
    """
    import gtsam  # here, not above: a tenth of a second that a drive without loops need not pay

    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for row, pose in zip(rows.tolist(), poses, strict=True):
        start.insert(row, gtsam.Pose3(invert_se3(pose)))
    held, unit = gtsam.noiseModel.Isotropic.Sigma(6, 1e-6), gtsam.noiseModel.Unit.Create(6)
    graph.add(gtsam.PriorFactorPose3(int(rows[0]), gtsam.Pose3(invert_se3(poses[0])), held))
    for i, j, T_i_j in edges:
        graph.add(gtsam.BetweenFactorPose3(i, j, gtsam.Pose3(T_i_j), unit))
    result = gtsam.LevenbergMarquardtOptimizer(graph, start, gtsam.LevenbergMarquardtParams()).optimize()
    return np.stack([invert_se3(result.atPose3(row).matrix()) for row in rows.tolist()])
