"""The map's table of keyframes and points, through all that changes it."""

import numpy as np
import pytest

from taskslam.slam.gf_gg.frame import Features, Frame
from taskslam.slam.gf_gg.keyframe_map import KeyframeMap

FEATURES = 8


def frame(seed, x=0.0):
    random = np.random.default_rng(seed)
    seen = random.uniform(10.0, 90.0, (FEATURES, 3))
    descriptors = random.integers(0, 2**63, (FEATURES, 4)).astype(np.uint64)
    features = Features(seen, np.arange(FEATURES) % 3, descriptors, np.zeros(50, np.int64), np.empty(0, np.int64), 7)
    T = np.eye(4)
    T[0, 3] = -x
    return Frame(0, features, np.ones(FEATURES), T, np.full(FEATURES, -1, np.int64))


@pytest.fixture
def known():
    """Keyframe 0 brings points 0 to 5, keyframe 1 sees 2 to 5 of them and brings 6 and 7."""
    known = KeyframeMap(FEATURES, 1.2, 8)
    known.add_keyframe(frame(0), np.zeros(FEATURES, np.int64))
    known.add_points(0, np.arange(6), np.column_stack((np.arange(6.0), np.zeros(6), np.full(6, 5.0))))
    second = frame(1, x=1.0)
    second.points[:4] = [2, 3, 4, 5]
    known.add_keyframe(second, np.zeros(FEATURES, np.int64))
    known.add_points(1, np.array([4, 5]), np.array([[0.0, 1.0, 5.0], [1.0, 1.0, 5.0]]))
    return known


def check(known):
    """What must hold whatever was done."""
    table = known.point_of[: known.keyframe_rows]
    counts = np.bincount(table[table >= 0], minlength=known.point_rows)
    np.testing.assert_array_equal(known.observers[: known.point_rows], counts)
    assert known.point_alive[: known.point_rows][counts > 0].all()
    assert (table[~known.alive[: known.keyframe_rows]] == -1).all()


def test_who_sees_what(known):
    check(known)
    assert known.shared(np.array([2, 6, -1])).tolist() == [1, 2]
    assert known.points_of(np.array([1])).tolist() == [2, 3, 4, 5, 6, 7]
    sightings, keyframes, features = known.sightings(np.array([1, 3]))
    assert (sightings.start.tolist(), keyframes.tolist(), features.tolist()) == ([0, 1, 3], [0, 0, 1], [1, 3, 1])
    np.testing.assert_array_equal(sightings.seen[2], known.seen[1, 1])
    np.testing.assert_allclose(sightings.weights, 1.2 ** (-2.0 * known.octaves[keyframes, features]))


def test_centres_and_distances(known):
    np.testing.assert_allclose(known.centres(np.array([0, 1])), [[0, 0, 0], [1, 0, 0]])
    np.testing.assert_allclose(known.farthest[2], np.hypot(2.0, 5.0) * 1.2**2)


def test_removed_points_are_seen_by_nobody(known):
    known.remove_points(np.array([2, 6]))
    check(known)
    assert known.points_of(np.array([0, 1])).tolist() == [0, 1, 3, 4, 5, 7]


def test_merged_points_are_one(known):
    known.merge_points(np.array([0]), np.array([6]))
    check(known)
    assert not known.point_alive[0]
    assert known.observers[6] == 2
    assert known.point_of[0, 0] == 6


def test_a_keyframe_that_sees_both_keeps_one(known):
    known.merge_points(np.array([2]), np.array([3]))
    check(known)
    assert known.observers[3] == 2
    assert (known.point_of[0] == 3).sum() == (known.point_of[1] == 3).sum() == 1


def test_a_removed_keyframe_takes_along_what_only_it_saw_and_leaves_its_row(known):
    known.remove_keyframe(1)
    check(known)
    assert known.keyframes().tolist() == [0]
    assert known.points_of(np.array([0])).tolist() == [0, 1, 2, 3, 4, 5]
    assert not known.point_alive[[6, 7]].any()
    assert known.add_keyframe(frame(2), np.zeros(FEATURES, np.int64)) == 1
    assert known.born[1] == 2
    check(known)


def test_unsighted_features_show_nothing(known):
    known.unsight(np.array([0, 1]), np.array([5, 3]))
    check(known)
    assert known.observers[5] == 0


def test_the_descriptor_is_the_one_least_unlike_the_others(known):
    for seed in (2, 3):
        further = frame(seed, x=float(seed))
        further.points[0] = 4
        known.add_keyframe(further, np.zeros(FEATURES, np.int64))
    odd = ~known.descriptors[1, 2]
    known.descriptors[0, 4], known.descriptors[2, 0], known.descriptors[3, 0] = (known.descriptors[1, 2],) * 3
    known.descriptors[1, 2] = odd
    known.refresh(np.array([4]))
    np.testing.assert_array_equal(known.point_descriptors[4], ~odd)
    mean = np.mean(
        [(known.places[4] - c) / np.linalg.norm(known.places[4] - c) for c in known.centres(np.arange(4))], 0
    )
    np.testing.assert_allclose(known.normals[4], mean / np.linalg.norm(mean), atol=1e-12)
