import numpy as np
import pytest

from taskslam.geometry import compose, invert
from taskslam.slam.karto.keyframes import Keyframes, runs
from taskslam.slam.karto.pose_graph import PoseGraph
from taskslam.slam.karto.scan_points import ScanPoints

TIGHT = np.diag([1e-4, 1e-4, 1e-5])


def ring(count: int, turn_error: float) -> tuple[PoseGraph, np.ndarray, np.ndarray]:
    """A robot that drives a circle and reads every turn by `turn_error` too large; the graph, its poses, the truth."""
    angles = 2 * np.pi * np.arange(count) / count
    truth = np.stack([5 * np.sin(angles), 5 - 5 * np.cos(angles), angles], axis=1)
    graph, poses = PoseGraph(), np.zeros((count, 3))
    graph.add_vertex()
    for k in range(1, count):
        graph.add_vertex()
        step = compose(invert(truth[k - 1]), truth[k]) + np.array([0, 0, turn_error])
        poses[k] = compose(poses[k - 1], step)
        graph.link(k - 1, k, (poses[k - 1], poses[k]), TIGHT)
    return graph, poses, truth


def test_closing_a_loop_spreads_the_drift_over_it() -> None:
    graph, poses, truth = ring(60, turn_error=0.002)
    before = np.hypot(*(poses - truth)[:, :2].T).max()
    graph.link(0, 59, (truth[0], truth[59]), TIGHT)
    after = graph.optimise(poses)
    assert before > 0.5
    assert np.hypot(*(after - truth)[:, :2].T).max() < 0.1
    assert after[0] == pytest.approx(np.zeros(3), abs=1e-6)


def test_consistent_edges_leave_the_poses_where_they_are() -> None:
    graph, poses, _ = ring(30, turn_error=0.0)
    graph.link(0, 29, (poses[0], poses[29]), TIGHT)
    moved = graph.optimise(poses)
    assert np.abs(compose(invert(poses), moved)).max() < 1e-6


def test_an_uncertain_direction_gives_way_whatever_the_heading() -> None:
    """Two edges disagree about x in the map frame; the one sure of it wins although its source looks along y."""
    graph = PoseGraph()
    for _ in range(2):
        graph.add_vertex()
    source, target = np.array([0.0, 0.0, np.pi / 2]), np.array([1.0, 0.0, 0.3])
    graph.link(0, 1, (source, target), np.diag([1e-6, 1e-2, 1e-6]))
    graph.edges.append(
        graph.edges[0].__class__(0, 1, compose(invert(source), target + np.array([0.1, 0.1, 0])), np.eye(3) * 1e-4)
    )
    found = graph.optimise(np.stack([source, target]))[1]
    assert found[0] == pytest.approx(1.001, abs=1e-3)
    assert found[1] == pytest.approx(0.099, abs=1e-3)


def test_optimising_twice_gives_the_same_bytes() -> None:
    graph, poses, truth = ring(80, turn_error=0.003)
    graph.link(0, 79, (truth[0], truth[79]), TIGHT)
    assert graph.optimise(poses).tobytes() == graph.optimise(poses).tobytes()


def test_near_linked_stops_at_the_circle_and_at_weak_edges() -> None:
    graph = PoseGraph()
    poses = np.stack([np.arange(6) * 1.0, np.zeros(6), np.zeros(6)], axis=1)
    for k in range(6):
        graph.add_vertex()
        if k:
            graph.link(k - 1, k, (poses[k - 1], poses[k]), TIGHT, strong=k != 4)
    distances = np.abs(poses[:, 0] - 2.0)
    assert graph.near_linked(2, distances, 1.0).tolist() == [1, 2, 3]
    assert graph.near_linked(2, distances, 5.0).tolist() == [0, 1, 2, 3]


def test_a_pair_is_linked_once() -> None:
    graph = PoseGraph()
    graph.add_vertex()
    graph.add_vertex()
    for pair in ((0, 1), (1, 0), (0, 0)):
        graph.link(*pair, (np.zeros(3), np.ones(3)), TIGHT)
    assert len(graph.edges) == 1


def test_chains_are_consecutive_numbers() -> None:
    assert [chain.tolist() for chain in runs(np.array([1, 2, 3, 7, 9, 10]))] == [[1, 2, 3], [7], [9, 10]]
    assert runs(np.array([], np.int64)) == []


def test_the_far_face_of_a_wall_is_not_shown() -> None:
    points = np.array([[1.0, 0.0], [1.1, 0.0], [1.05, 0.5]])
    normals = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, 0.0]])  # near face, far face, unknown
    keyframes = Keyframes()
    keyframes.add(ScanPoints(points, normals, np.zeros(2)), np.array([0.0, 0.0, np.pi / 2]))
    shown = keyframes.reference([0], np.array([0.0, 0.0]))
    assert shown.points == pytest.approx(np.array([[0.0, 1.0], [-0.5, 1.05]]), abs=1e-6)
