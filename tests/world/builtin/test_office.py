import numpy as np
import pytest

from taskslam.world.builtin.office import HIGH, LOW, doorways


@pytest.fixture
def office(places):
    return places["office"]


def test_floor_is_as_large_as_the_published_one(office):
    assert (HIGH[0] - LOW[0]) * (HIGH[1] - LOW[1]) == pytest.approx(1500)
    assert 850 < office.free_area < 1100, "without closed rooms and what stands there"
    assert office.reachable_area > 700


def test_every_open_doorway_is_wide_enough(office):
    office.assert_doorways_are_clear(doorways(), width=1.0)


def test_a_stretch_of_corridor_looks_like_the_next_to_the_laser(office):
    """On purpose: between the links, many places of the north corridor see nearly the same two walls."""
    nearby = []
    for x in (-13.5, -11.5, 6.5, 10.5):
        _, distance = office.scan(x, 4.7)
        nearby.append(np.sort(distance[distance < 2.5]))
    count = min(len(ranges) for ranges in nearby)
    assert count > 360, "more than half of the rays end at the walls beside the robot"
    for i, a in enumerate(nearby):
        for b in nearby[:i]:
            assert np.abs(a[:count] - b[:count]).mean() < 0.15


def test_the_corridor_is_seen_to_its_end(office):
    _, distance = office.hits((-24.0, 4.7, 0.6), np.array([[1.0, 0.0, 0.0]], np.float32))
    assert distance[0] > 48
