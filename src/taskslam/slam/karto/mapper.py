"""`Mapper`: one scan in, one pose out. `process` is the method as a list of steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, compose, invert, wrap
from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.slam.base import Status
from taskslam.slam.karto.correlative_matcher import CorrelativeMatcher, Match
from taskslam.slam.karto.keyframes import Ids, Keyframes, runs
from taskslam.slam.karto.loop_closure import LoopCloser, nearest_of
from taskslam.slam.karto.pose_graph import PoseGraph
from taskslam.slam.karto.scan_points import ScanPoints, scan_to_points
from taskslam.slam.karto.settings import KartoSettings
from taskslam.slam.karto.surface_refinement import SurfaceMap

MINIMUM_HITS = 20  # fewer hits say nothing about a pose
_TRACKING_RESPONSE = 0.5  # below this a scan does not show what the map shows
_FAMILIAR_RESPONSE = 0.7  # above this the map already shows what the scan shows
_PATIENCE = 10  # scans without a match after which the map is continued by odometry alone
_TRACKING_SHARE = 0.3  # of the hits must find a surface between keyframes
_RELATIVE_RESPONSE = 0.7  # of the buffer's response: what any other chain must reach to be believed
_MOST_CHAINS = 2  # near chains matched per keyframe
_ODOMETRY_EDGE = np.diag([0.1, 0.1, 0.05])  # m^2, rad^2: the weak link where no match was found
_STANDING_EDGE = np.diag([1e-6, 1e-6, 1e-6])
_STILL = (0.002, 0.002)  # metres, radians by odometry: the robot has not moved (a gyro drifts by some 1e-4 in a second)


@dataclass(frozen=True, slots=True)
class Outcome:
    """pose: (3,) `T_start_base`; covariance: (3, 3) in the start frame."""

    pose: FloatArray
    status: Status
    covariance: FloatArray


class Mapper:
    """Keyframes, their graph, and where the robot is. The map frame is the start frame."""

    def __init__(self, settings: KartoSettings) -> None:
        self._settings = settings
        self.keyframes = Keyframes()
        self.graph = PoseGraph()
        self.buffer: list[int] = []  # the keyframes passed last, newest at the end
        self.pose = np.zeros(3)
        self.loops_closed = 0
        self.gates_passed = 0
        self._odometry: FloatArray | None = None
        self._start_odometry: FloatArray | None = None
        self._gate_odometry = np.zeros(3)
        self._gate_stamp = 0
        self._unmatched = 0
        self._stale = True  # the surfaces no longer show the buffer
        self._covariance = np.diag([1e-4, 1e-4, 1e-4])
        self._matcher = CorrelativeMatcher(
            settings.correlation_search_space_dimension,
            settings.correlation_search_space_resolution,
            settings.correlation_search_space_smear_deviation,
            coarse_step=4,
            settings=settings,
        )
        self._surface = SurfaceMap(settings.max_laser_range + 1.0)
        self._closer = LoopCloser(settings, self._matcher)

    def process(self, scan: ScanPoints, odometry: FloatArray, stamp: int, whole_turn: bool) -> Outcome:
        """Live pose of the base at the scan's stamp (ns). odometry: (3,) `T_odom_base` at that stamp."""
        predicted = self._predict(odometry)
        if len(scan) < MINIMUM_HITS:
            self.pose = predicted
            return Outcome(predicted, Status.LOST if len(self.keyframes) else Status.STARTING, self._widened())
        if not len(self.keyframes):
            return self._first(scan, predicted, odometry, stamp)
        if self._standing_start(scan, odometry):
            return Outcome(self.pose.copy(), Status.TRACKING, self._covariance.copy())
        if not self._gate(odometry, stamp):
            tracked = self._track(scan, predicted)
            if tracked is not None:
                return tracked
        match = self._match_buffer(scan, predicted)
        if match is None:
            return self._ride(scan, predicted, odometry, stamp)
        self._unmatched = 0
        self._pass_gate(odometry, stamp)
        self._settle(scan, match, whole_turn)
        return Outcome(self.pose.copy(), Status.TRACKING, self._covariance.copy())

    def place(self, pose: FloatArray) -> None:
        """Say that the robot now stands at (3,) `pose`; matching starts with the keyframes nearest to it."""
        self.pose = pose.copy()
        self._odometry = None
        self._unmatched = 0
        distances = self.keyframes.distances(pose)
        order = np.argsort(distances, kind="stable")[: self._settings.scan_buffer_size]
        self.buffer = [int(k) for k in order[::-1]]  # the nearest counts as passed last
        self._stale = True

    def _predict(self, odometry: FloatArray) -> FloatArray:
        if self._odometry is None:
            self._odometry = odometry
            self._gate_odometry = odometry
        predicted = compose(self.pose, compose(invert(self._odometry), odometry))
        self._odometry = odometry
        return predicted

    def _first(self, scan: ScanPoints, pose: FloatArray, odometry: FloatArray, stamp: int) -> Outcome:
        self.pose = pose
        self._add_keyframe(scan, pose)
        self._pass_gate(odometry, stamp)
        self._start_odometry = odometry
        return Outcome(pose.copy(), Status.TRACKING, self._covariance.copy())

    def _standing_start(self, scan: ScanPoints, odometry: FloatArray) -> bool:
        """While the robot has not moved yet, its scans all join the map, at one pose, until they fill the buffer.

        The first keyframes are what all later ones are matched on: the noise of a single first scan would turn the
        whole map by some hundredths of a degree, another way in each round.
        """
        if self._start_odometry is None:
            return False
        step = compose(invert(self._start_odometry), odometry)
        still = np.hypot(step[0], step[1]) < _STILL[0] and abs(step[2]) < _STILL[1]
        if not still or len(self.keyframes) >= self._settings.scan_buffer_size:
            self._start_odometry = None
            return False
        self.pose = self.keyframes.poses[0].copy()
        new = self._add_keyframe(scan, self.pose)
        self.graph.link(0, new, (self.pose, self.pose), _STANDING_EDGE)
        return True

    def _gate(self, odometry: FloatArray, stamp: int) -> bool:
        """Whether the robot has moved or turned far enough since the last gate (OpenKarto's HasMovedEnough)."""
        s = self._settings
        if stamp - self._gate_stamp < s.minimum_time_interval * NANOSECONDS:
            return False
        step = compose(invert(self._gate_odometry), odometry)
        moved = float(np.hypot(step[0], step[1])) >= s.minimum_travel_distance
        return moved or abs(float(step[2])) >= s.minimum_travel_heading

    def _pass_gate(self, odometry: FloatArray, stamp: int) -> None:
        self._gate_odometry, self._gate_stamp = odometry, stamp
        self.gates_passed += 1

    def _track(self, scan: ScanPoints, predicted: FloatArray) -> Outcome | None:
        """A pose between keyframes: the predicted one moved onto the surfaces; None if they do not fit the scan."""
        if not self._settings.refine_match:
            self.pose = predicted
            return Outcome(predicted.copy(), Status.TRACKING, self._covariance.copy())
        if self._stale:
            self._show_surfaces(self.buffer, predicted)
            self._stale = False
        refined = self._refine(scan, predicted, predicted)
        if refined is None:
            return None
        self.pose = refined
        return Outcome(refined.copy(), Status.TRACKING, self._covariance.copy())

    def _match_buffer(self, scan: ScanPoints, predicted: FloatArray) -> Match | None:
        """Match against the running-scan buffer, refined below a cell; None if the scan does not fit."""
        match = self._match_keyframes(self.buffer, scan, predicted, penalize=True)
        self._stale = False
        return match if match.response >= _TRACKING_RESPONSE else None

    def _match_keyframes(self, numbers: list[int], scan: ScanPoints, predicted: FloatArray, *, penalize: bool) -> Match:
        reference = self.keyframes.reference(numbers, predicted)
        self._matcher.show(reference.points, predicted)
        match = self._matcher.match(scan, predicted, penalize=penalize)
        if not self._settings.refine_match:
            return match
        self._surface.fill(reference.points, reference.normals, predicted)
        refined = self._refine(scan, match.pose, predicted)
        return match if refined is None else Match(refined, match.response, match.covariance)

    def _show_surfaces(self, numbers: list[int], viewpoint: FloatArray) -> None:
        reference = self.keyframes.reference(numbers, viewpoint)
        self._surface.fill(reference.points, reference.normals, viewpoint)

    def _refine(self, scan: ScanPoints, start: FloatArray, predicted: FloatArray) -> FloatArray | None:
        """`start` moved onto the surfaces; None if few hits find one or it would move further than a cell or two."""
        found = self._surface.refine(scan, start, predicted)
        step = found.pose - start
        if found.share < _TRACKING_SHARE or np.hypot(step[0], step[1]) > 0.1 or abs(wrap(step[2])) > 0.05:
            return None
        self._covariance = found.covariance
        return found.pose

    def _ride(self, scan: ScanPoints, predicted: FloatArray, odometry: FloatArray, stamp: int) -> Outcome:
        """No match: go by odometry, and after a while continue the map from here with a weak edge."""
        self.pose = predicted
        self._unmatched += 1
        if self._unmatched >= _PATIENCE:
            last = self.buffer[-1]
            new = self._add_keyframe(scan, predicted)
            self.graph.link(last, new, (self.keyframes.poses[last], predicted), _ODOMETRY_EDGE, strong=False)
            self.buffer = [new]
            self._unmatched = 0
            self._stale = True
            self._pass_gate(odometry, stamp)
        return Outcome(predicted.copy(), Status.LOST, self._widened())

    def _widened(self) -> FloatArray:
        self._covariance = self._covariance + np.diag([1e-4, 1e-4, 1e-5])
        return self._covariance.copy()

    def _settle(self, scan: ScanPoints, match: Match, whole_turn: bool) -> None:
        """At a gate: agree with near chains, pass the keyframe that is there or add one, close loops."""
        s = self._settings
        last = self.buffer[-1]
        distances = self.keyframes.distances(match.pose)
        linked = self.graph.near_linked(last, distances, s.link_scan_maximum_distance)
        chains = self._match_near_chains(scan, match, linked, distances)
        self.pose = _weighted_mean([match, *(m for _, m in chains)])
        passed = self._familiar(linked, match.response, whole_turn)
        if passed is not None:
            if passed != last:
                self._pass_keyframe(passed)
                self._close_loops(scan, None, match, chains)
            return
        self._close_loops(scan, self._insert(scan, match, chains), match, chains)

    def _familiar(self, linked: Ids, response: float, whole_turn: bool) -> int | None:
        """The keyframe that already shows this place, or None."""
        s = self._settings
        if not s.reuse_keyframes or response < _FAMILIAR_RESPONSE:
            return None
        poses = self.keyframes.poses[linked]
        distances = np.hypot(poses[:, 0] - self.pose[0], poses[:, 1] - self.pose[1])
        if not whole_turn:
            distances[np.abs(wrap(poses[:, 2] - self.pose[2])) >= s.minimum_travel_heading] = np.inf
        nearest = int(np.argmin(distances))
        return int(linked[nearest]) if distances[nearest] < s.minimum_travel_distance else None

    def _match_near_chains(
        self, scan: ScanPoints, match: Match, linked: Ids, distances: FloatArray
    ) -> list[tuple[int, Match]]:
        """(nearest keyframe, match) for each near chain that the buffer does not show (OpenKarto's LinkNearChains)."""
        s = self._settings
        shown = set(self.buffer)
        chains = [c for c in runs(linked) if not shown.intersection(int(k) for k in c)]
        chains.sort(key=lambda c: (float(distances[c].min()), int(c[0])))
        found = []
        for chain in chains[:_MOST_CHAINS]:
            members = nearest_of(chain, distances, s.scan_buffer_size)
            other = self._match_keyframes(members, scan, match.pose, penalize=False)
            self._stale = True
            # OpenKarto's threshold (0.1) lets in chains that show another room; these would pull the mean.
            if other.response >= max(s.link_match_minimum_response_fine, _RELATIVE_RESPONSE * match.response):
                found.append((nearest_of(chain, distances, 1)[0], other))
        return found

    def _insert(self, scan: ScanPoints, match: Match, chains: list[tuple[int, Match]]) -> int:
        """A new keyframe at the live pose, linked to the last one, the nearest of the buffer, and near chains."""
        s = self._settings
        last = self.buffer[-1]
        distances = self.keyframes.distances(self.pose)
        closest = min(self.buffer, key=lambda k: (float(distances[k]), k))
        new = self._add_keyframe(scan, self.pose)
        poses = self.keyframes.poses
        self.graph.link(last, new, (poses[last], match.pose), match.covariance)
        if distances[closest] <= s.link_scan_maximum_distance:
            self.graph.link(closest, new, (poses[closest], match.pose), match.covariance)
        for source, other in chains:
            self.graph.link(source, new, (poses[source], other.pose), other.covariance)
        return new

    def _add_keyframe(self, scan: ScanPoints, pose: FloatArray) -> int:
        new = self.keyframes.add(scan, pose)
        self.graph.add_vertex()
        self._pass_keyframe(new)
        return new

    def _pass_keyframe(self, number: int) -> None:
        """The buffer holds the keyframes passed last, new or old, within its size and distance."""
        s = self._settings
        self.buffer = [k for k in self.buffer if k != number] + [number]
        distances = self.keyframes.distances(self.keyframes.poses[number])
        recent = self.buffer[-s.scan_buffer_size :]
        self.buffer = [k for k in recent if distances[k] <= s.scan_buffer_maximum_scan_distance]
        self._stale = True

    def _close_loops(self, scan: ScanPoints, new: int | None, match: Match, chains: list[tuple[int, Match]]) -> None:
        """Try every chain that may close a loop here; one that does becomes an edge and moves all keyframes."""
        if not self._settings.do_loop_closing:
            return
        for chain in self._closer.candidates(self.keyframes, self.graph, self.buffer[-1], self.pose):
            closure = self._closer.try_chain(self.keyframes, chain, scan, self.pose)
            self._stale = True
            # OpenKarto's threshold (0.45) is passed by other rooms of the same size, and one wrong loop ruins the map.
            if closure is None or closure.match.response < _RELATIVE_RESPONSE * match.response:
                continue
            if new is None:
                new = self._insert(scan, match, chains)
            poses = self.keyframes.poses
            source = closure.keyframe
            closing = self._refined_closure(closure.match, chain, scan)
            self.graph.link(source, new, (poses[source], closing), closure.match.covariance)
            self.keyframes.move(self.graph.optimise(self.keyframes.poses))
            self.pose = self.keyframes.poses[new].copy()
            self.loops_closed += 1
            return  # what remains is near-linked now, or found again at the next keyframe

    def _refined_closure(self, match: Match, chain: Ids, scan: ScanPoints) -> FloatArray:
        if not self._settings.refine_match:
            return match.pose
        members = nearest_of(chain, self.keyframes.distances(match.pose), self._settings.scan_buffer_size)
        self._show_surfaces(members, match.pose)
        refined = self._refine(scan, match.pose, match.pose)
        return match.pose if refined is None else refined


def warm_up(settings: KartoSettings) -> None:
    """Map a few made-up scans and forget them, so that no real scan waits for compilation or an import."""
    angles = np.linspace(-np.pi, np.pi, 400, endpoint=False)
    ranges = 2.0 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    laser = LaserScan(0, ranges.astype(np.float32), -np.pi, np.pi / 200, 0.1, settings.max_laser_range)
    scan = scan_to_points(laser, np.eye(4), settings.max_laser_range)
    mapper = Mapper(settings)
    for k in range(3):
        mapper.process(scan, np.array([0.0, 0.0, 0.0 if k < 2 else 1.0]), k * NANOSECONDS, whole_turn=False)
    mapper.graph.optimise(mapper.keyframes.poses)


def _weighted_mean(matches: list[Match]) -> FloatArray:
    """Mean of poses (3,) weighted by their inverse covariances (OpenKarto's ComputeWeightedMean)."""
    if len(matches) == 1:
        return matches[0].pose.copy()
    first = matches[0].pose
    total, weighted = np.zeros((3, 3)), np.zeros(3)
    for match in matches:
        information = np.linalg.inv(match.covariance)
        offset = match.pose - first
        offset[2] = wrap(offset[2])
        total += information
        weighted += information @ offset
    mean = first + np.linalg.solve(total, weighted)
    mean[2] = wrap(mean[2])
    return mean
