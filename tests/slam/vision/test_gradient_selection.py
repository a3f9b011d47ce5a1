import numpy as np
import pytest

from taskslam.slam.vision.gradient_selection import adapt_threshold, select_by_gradient


def test_every_cell_gives_its_largest_gradient_and_a_flat_one_none():
    image = np.full((40, 60), 100, np.uint8)
    image[12, 33] = 220  # one bright pixel: its neighbours have the gradient, the first of them in rows is above it
    points, cells = select_by_gradient(image, 20, 8.0)
    assert cells == 6
    assert points.tolist() == [[33.0, 11.0]]


def test_the_gradient_is_half_the_difference_of_the_neighbours():
    image = np.tile(np.arange(0, 240, 4, dtype=np.uint8), (40, 1))
    assert len(select_by_gradient(image, 20, 4.0)[0]) == 6
    assert len(select_by_gradient(image, 20, 4.001)[0]) == 0


def test_numpys_gradient_finds_the_same_points():
    image = np.random.default_rng(3).integers(0, 256, (50, 70), dtype=np.uint8)
    dy, dx = np.gradient(image.astype(float))
    size = np.hypot(dx, dy)
    points, _ = select_by_gradient(image, 10, 2.0)
    assert len(points) == 35
    for x, y in points.astype(int):
        i, j = y // 10 * 10, x // 10 * 10
        inside = size[max(i, 4) : min(i + 10, 46), max(j, 4) : min(j + 10, 66)]
        assert size[y, x] == inside.max()


@pytest.mark.parametrize(
    ("least", "share", "then"),
    [(8, 0.3, 4), (8, 0.5, 8), (8, 0.7, 16), (2, 0.0, 2), (32, 1.0, 32), (3, 0.1, 2), (20, 0.9, 32)],
)
def test_the_threshold_follows_the_share_of_cells_with_a_point(least, share, then):
    assert adapt_threshold(least, share) == then
