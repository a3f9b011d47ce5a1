import math

import numpy as np
import pytest

from taskslam.world.builtin.hospital import HIGH, LOW, doorways


@pytest.fixture
def hospital(places):
    return places["hospital"]


def test_floor_is_as_large_as_the_published_hospital(hospital):
    """Protocol 6.2: 1137 m^2 connected free floor, 1007 m^2 of it with 0.2 m clearance; the paper says 1400 m^2."""
    assert (HIGH[0] - LOW[0]) * (HIGH[1] - LOW[1]) == pytest.approx(1400)
    assert 1100 < hospital.free_area < 1300
    assert hospital.reachable_area > 900


def test_every_doorway_lets_a_bed_through(hospital):
    hospital.assert_doorways_are_clear(doorways(), width=1.15)


def test_the_tour_ends_where_it_starts(hospital):
    assert np.array_equal(hospital.tour[0], hospital.tour[-1])


def contrast(place, x, y, heading):
    """Mean spread of texture brightness (grey levels) on what a camera at x, y sees ahead."""
    angles = np.linspace(heading - 0.6, heading + 0.6, 40)
    up = np.linspace(-0.25, 0.25, 20)
    a, z = (part.ravel() for part in np.meshgrid(angles, up))
    directions = np.stack([np.cos(a), np.sin(a), z], axis=1).astype(np.float32)
    triangle, _ = place.hits((x, y, 0.3), directions)
    materials = place.world.visual.material[triangle]
    spread = [0.0 if m.texture is None else m.texture.mean(axis=2).std() for m in place.world.materials]
    return np.array(spread)[materials].mean()


def test_corridors_give_a_camera_less_than_rooms(hospital):
    """As in the original: plain paint in the corridors."""
    corridor = np.mean([contrast(hospital, x, y, math.pi / 2) for x in (-3.9, 3.9) for y in (-24.0, -8.0, 2.0)])
    rooms = np.mean([contrast(hospital, x, y, 0.0) for x, y in ((-11.0, -19.0), (-0.8, -9.6), (-10.5, 21.5))])
    assert corridor < 0.75 * rooms
