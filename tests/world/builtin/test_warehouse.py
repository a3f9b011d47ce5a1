import numpy as np
import pytest

from taskslam.world.builtin.warehouse import HIGH, LOW


@pytest.fixture
def warehouse(places):
    return places["warehouse"]


def test_floor_is_as_large_as_the_published_warehouse(warehouse):
    assert (HIGH[0] - LOW[0]) * (HIGH[1] - LOW[1]) == pytest.approx(260)
    assert 180 < warehouse.free_area < 231, "what stands there takes its share"
    assert warehouse.reachable_area > 150


def test_stored_goods_show_another_profile_in_every_bay(warehouse):
    """Depths behind the front of rack E, by laser along aisle B-E, vary within bays and between them."""
    y = np.linspace(-7.5, 8.3, 400)
    origins = np.stack([np.full_like(y, 4.45), y, np.full_like(y, 0.41)], axis=1).astype(np.float32)
    directions = np.tile(np.array([1.0, 0.0, 0.0], np.float32), (len(y), 1))
    depth = np.array([warehouse.hits(o, d[None])[1][0] for o, d in zip(origins, directions, strict=True)])
    assert depth.std() > 0.1
    bays = depth[:396].reshape(6, 66)
    for k in range(1, 6):
        assert np.abs(bays[k] - bays[k - 1]).mean() > 0.03
