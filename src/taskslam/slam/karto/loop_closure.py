"""Loop closure: is the robot back at a place that the graph does not yet know to be near?

OpenKarto's TryCloseLoop: chains of consecutive keyframes within loop_search_maximum_distance that cannot be reached
over edges inside that circle; a coarse match in a wide window, then a fine one; each accepted chain gives one edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.slam.karto.correlative_matcher import CorrelativeMatcher, Match
from taskslam.slam.karto.keyframes import Ids, Keyframes, runs
from taskslam.slam.karto.pose_graph import PoseGraph
from taskslam.slam.karto.scan_points import ScanPoints
from taskslam.slam.karto.settings import KartoSettings

_LONGEST_CHAIN = 20  # keyframes: the nearest ones of a chain, so that one match takes bounded time


@dataclass(frozen=True, slots=True)
class Closure:
    """An accepted loop: the nearest keyframe of the chain and the match of the scan against it."""

    keyframe: int
    match: Match


def nearest_of(chain: Ids, distances: FloatArray, count: int) -> list[int]:
    """The `count` members of a chain that lie nearest, ascending."""
    order = np.argsort(distances[chain], kind="stable")[:count]
    return sorted(int(k) for k in chain[order])


class LoopCloser:
    """Searches for loops; owns the wide, coarse matcher and shares the fine one."""

    def __init__(self, settings: KartoSettings, fine: CorrelativeMatcher) -> None:
        self._settings = settings
        self._fine = fine
        self._coarse = CorrelativeMatcher(
            settings.loop_search_space_dimension,
            settings.loop_search_space_resolution,
            settings.loop_search_space_smear_deviation,
            coarse_step=1,
            settings=settings,
        )

    def candidates(self, keyframes: Keyframes, graph: PoseGraph, last: int, place: FloatArray) -> list[Ids]:
        """Chains that may close a loop at (2+,) `place`, nearest first. last: the keyframe that the robot stands by."""
        limit = self._settings.loop_search_maximum_distance
        distances = keyframes.distances(place)
        near = distances <= limit
        near[graph.near_linked(last, distances, limit)] = False
        minimum = self._settings.loop_match_minimum_chain_size
        chains = [chain for chain in runs(np.flatnonzero(near)) if len(chain) >= minimum]
        return sorted(chains, key=lambda chain: (float(distances[chain].min()), int(chain[0])))

    def try_chain(self, keyframes: Keyframes, chain: Ids, scan: ScanPoints, pose: FloatArray) -> Closure | None:
        """Match a scan at `pose` (3,) against a chain; None if either match is too poor."""
        s = self._settings
        distances = keyframes.distances(pose)
        members = nearest_of(chain, distances, _LONGEST_CHAIN)
        reference = keyframes.reference(members, pose)
        self._coarse.show(reference.points, pose)
        coarse = self._coarse.match(scan, pose, penalize=False, fine=False)
        worst = max(coarse.covariance[0, 0], coarse.covariance[1, 1])
        if coarse.response < s.loop_match_minimum_response_coarse or worst > s.loop_match_maximum_variance_coarse:
            return None
        # Seen from where the coarse match puts the robot, other faces may be visible.
        reference = keyframes.reference(members, coarse.pose)
        self._fine.show(reference.points, coarse.pose)
        fine = self._fine.match(scan, coarse.pose, penalize=False)
        if fine.response < s.loop_match_minimum_response_fine:
            return None
        nearest = nearest_of(chain, keyframes.distances(fine.pose), 1)[0]
        return Closure(nearest, fine)
