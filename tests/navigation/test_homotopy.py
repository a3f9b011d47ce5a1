import math

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.navigation.costmap import LocalCostmap
from taskslam.navigation.homotopy import ObstacleMap, distinct_paths, same_class, signature
from taskslam.navigation.settings import CostmapSettings, TebSettings

POST = np.array([[1.0, 0.0]])


def winding(*points, inside=POST):
    path = np.array(points, float)
    return signature(path, len(path), inside)


def test_paths_on_two_sides_of_an_obstacle_differ_by_a_turn():
    left, right = winding((0, 0), (1, 0.5), (2, 0)), winding((0, 0), (1, -0.5), (2, 0))
    assert not same_class(left, right)
    assert abs(left - right)[0] == pytest.approx(2 * math.pi)


def test_the_shape_of_a_path_does_not_change_its_class():
    assert same_class(winding((0, 0), (1, 0.5), (2, 0)), winding((0, 0), (0, 3), (3, 3), (2, 0.1), (2, 0)))


def test_going_round_once_more_is_another_class():
    once = winding((0, 0), (1, 0.5), (2, 0))
    again = winding((0, 0), (1, 0.5), (2, 0), (1, -0.5), (0, 0), (1, 0.5), (2, 0))
    assert not same_class(once, again)


def obstacle_map(make_plan, boxes, pose):
    local = LocalCostmap(make_plan(8, 6, boxes), CostmapSettings())
    local.update(None, SE2(), pose)
    return ObstacleMap.of(local)


def found(obstacles, start, goal, rounds=1):
    """Signatures of the classes that the first rounds find together."""
    classes = []
    for k in range(rounds):
        for path in distinct_paths(obstacles, start, goal, TebSettings(), k):
            assert tuple(path[0]) == start
            assert tuple(path[-1]) == goal
            new = signature(path, len(path), obstacles.inside)
            if not any(same_class(new, other) for other in classes):
                classes.append(new)
    return classes


def test_both_ways_past_a_pillar_are_found(make_plan):
    obstacles = obstacle_map(make_plan, [(3.9, 2.9, 4.1, 3.1)], SE2(3, 3))
    assert len(found(obstacles, (3.0, 3.0), (5.0, 3.0))) == 2


def test_four_ways_past_two_pillars_are_found_over_a_second(make_plan):
    boxes = [(3.6, 2.9, 3.8, 3.1), (4.7, 2.9, 4.9, 3.1)]
    obstacles = obstacle_map(make_plan, boxes, SE2(3, 3))
    assert len(found(obstacles, (3.0, 3.0), (5.3, 3.0), rounds=5)) == 4


def test_pillars_too_close_to_pass_between_are_one_obstacle(make_plan):
    boxes = [(3.9, 2.8, 4.1, 2.9), (3.9, 3.1, 4.1, 3.2)]
    obstacles = obstacle_map(make_plan, boxes, SE2(3, 3))
    assert len(found(obstacles, (3.0, 3.0), (5.0, 3.0), rounds=3)) == 2


def test_a_wall_on_one_side_leaves_one_way(make_plan):
    obstacles = obstacle_map(make_plan, [(3.9, 0.0, 4.1, 3.2)], SE2(3, 3))
    assert len(found(obstacles, (3.0, 3.0), (5.0, 3.6), rounds=3)) == 1
