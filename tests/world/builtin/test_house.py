import numpy as np
import pytest

from taskslam.world.builtin.house import doorways
from taskslam.world.floor_plan import FREE
from taskslam.world.slicing import slice_floor_plan


@pytest.fixture
def house(places):
    return places["house"]


def test_floor_and_reach_match_the_published_small_house(house):
    """Protocol 6.2: 152 m^2 connected free floor, 135 m^2 of it with 0.2 m clearance."""
    assert 140 < house.free_area < 160
    assert house.reachable_area > 110


def test_every_doorway_is_wide_enough(house):
    """The planner keeps 0.21 m plus the robot's radius of 0.178 m from both jambs."""
    house.assert_doorways_are_clear(doorways(), width=0.95)


def test_the_laser_sees_much_furniture(house):
    world = house.world
    shell = np.array([name.endswith(("shell", "facade")) or name.startswith("doorway") for name in world.models])
    for x, y, _ in house.tour:
        triangle, distance = house.scan(x, y)
        assert distance.max() < 18
        assert np.mean(~shell[world.visual.owner[triangle]]) > 0.15


def test_rugs_and_sills_are_driven_over(house):
    low = slice_floor_plan(house.world, 0.009, 0.42, seed_point=(0.0, 0.0))
    for door in doorways():
        middle = (door.start + door.end) / 2
        assert low.at(*((door.at, middle) if door.wall == "x" else (middle, door.at))) == FREE
    assert low.at(3.62, -0.07) == FREE, "the runner in the corridor"
