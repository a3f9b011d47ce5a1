import numpy as np

from taskslam.slam.dsol.points import cells_of, fill_from_cells


def test_cells_have_their_corner_at_the_corner_of_a_pixel():
    pixels = np.array([[-0.4, 3.0], [19.4, 3.0], [19.6, 3.0], [3.0, 19.6]])
    first, same, right, below = cells_of(pixels, 20)
    assert first == same
    assert len({first, right, below}) == 3


def test_a_depth_is_taken_from_the_same_cell_alone():
    points = np.array([[5.0, 5.0], [25.0, 5.0], [45.0, 5.0], [6.0, 6.0]])
    inverse_depths = np.array([np.nan, np.nan, np.nan, 0.9])
    known = np.array([[12.0, 12.0], [13.0, 13.0], [41.0, 1.0]])
    filled = fill_from_cells(points, inverse_depths, known, np.array([0.5, 0.6, 0.7]), 20)
    np.testing.assert_array_equal(filled, [0.5, np.nan, 0.7, 0.9])


def test_where_nothing_is_known_nothing_is_filled():
    filled = fill_from_cells(np.ones((3, 2)), np.full(3, np.nan), np.zeros((0, 2)), np.zeros(0), 20)
    assert np.isnan(filled).all()
