"""The pose graph: which keyframes were matched against which, and the poses that agree best with all matches.

Optimised by gtsam (Levenberg-Marquardt on Pose2 between-factors, first keyframe held). gtsam's wheels are built without
TBB and the factors are added in a fixed order, so the result is the same bytes on any number of cores.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, compose, invert
from taskslam.slam.karto.keyframes import Ids


@dataclass(frozen=True, slots=True)
class Edge:
    """A match of keyframe `target` against `source`: (3,) pose of target in source and its (3, 3) covariance.

    strong: whether it makes the two neighbours; an edge by odometry alone does not: loops are searched across it.
    """

    source: int
    target: int
    T_source_target: FloatArray
    covariance: FloatArray
    strong: bool = True


class PoseGraph:
    """Edges between keyframes."""

    def __init__(self) -> None:
        self.edges: list[Edge] = []
        self._neighbours: list[list[int]] = []

    def add_vertex(self) -> None:
        """One more keyframe."""
        self._neighbours.append([])

    def link(
        self,
        source: int,
        target: int,
        poses: tuple[FloatArray, FloatArray],
        covariance: FloatArray,
        *,
        strong: bool = True,
    ) -> None:
        """An edge from the poses (3,) of source and target in one frame; covariance: (3, 3) of target in that frame.

        A pair that is linked already stays as it is (as in OpenKarto).
        """
        if source == target or target in self._neighbours[source]:
            return
        relative = compose(invert(poses[0]), poses[1])
        c, s = np.cos(poses[0][2]), np.sin(poses[0][2])
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        self.add_edge(Edge(source, target, relative, turn @ covariance @ turn.T, strong))

    def add_edge(self, edge: Edge) -> None:
        """Take an edge as it is."""
        self.edges.append(edge)
        if edge.strong:
            self._neighbours[edge.source].append(edge.target)
            self._neighbours[edge.target].append(edge.source)

    def near_linked(self, start: int, distances: FloatArray, limit: float) -> Ids:
        """Keyframes within `limit` metres that can be reached from `start` over edges without leaving that circle.

        distances: (N,) of all keyframes to the place in question. `start` itself is among them; ascending.
        """
        seen = {start}
        front = [start]
        while front:
            following = []
            for k in front:
                for other in self._neighbours[k]:
                    if other not in seen and distances[other] <= limit:
                        seen.add(other)
                        following.append(other)
            front = following
        return np.array(sorted(seen), np.int64)

    def optimise(self, poses: FloatArray) -> FloatArray:
        """(N, 3) poses that minimise the edges' squared Mahalanobis errors, from (N, 3) poses to start with."""
        import gtsam  # here, not above: a tenth of a second that a run without loop closure need not pay

        graph = gtsam.NonlinearFactorGraph()
        start = gtsam.Values()
        for k, pose in enumerate(poses):
            start.insert(k, gtsam.Pose2(*pose))
        held = gtsam.noiseModel.Diagonal.Sigmas(np.array([1e-6, 1e-6, 1e-6]))
        graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*poses[0]), held))
        for edge in self.edges:
            # gtsam's Pose2 error is in the target's frame; the covariance is held in the source's.
            theta = edge.T_source_target[2]
            c, s = np.cos(theta), np.sin(theta)
            turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
            noise = gtsam.noiseModel.Gaussian.Covariance(turn @ edge.covariance @ turn.T)
            graph.add(gtsam.BetweenFactorPose2(edge.source, edge.target, gtsam.Pose2(*edge.T_source_target), noise))
        parameters = gtsam.LevenbergMarquardtParams()
        parameters.setMaxIterations(50)
        parameters.setRelativeErrorTol(1e-6)
        result = gtsam.LevenbergMarquardtOptimizer(graph, start, parameters).optimize()
        out = np.empty_like(poses)
        for k in range(len(poses)):
            pose = result.atPose2(k)
            out[k] = (pose.x(), pose.y(), pose.theta())
        return out
