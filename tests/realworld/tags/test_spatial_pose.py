import numpy as np
import pytest

from taskslam.geometry import pose_from_xyz_rpy
from taskslam.realworld.tags.spatial_pose import both_poses, choose_pose
from taskslam.realworld.tags.tag_plane import tag_square

FOCAL = 800.0
POINTS = tag_square(0.19, from_above=False)


def rays_of(T: np.ndarray, points: np.ndarray = POINTS) -> np.ndarray:
    at = np.column_stack([points, np.zeros(len(points)), np.ones(len(points))]) @ T.T
    return at[:, :2] / at[:, 2:3]


def test_exact_frontal_corners_never_give_nan():
    """OpenCV's IPPE gives NaN for a quarter of them."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        T = pose_from_xyz_rpy((*rng.uniform(-0.5, 0.5, 2), 2.5), (0, 0, rng.uniform(-3.14, 3.14)))
        best = both_poses(rays_of(T), POINTS, FOCAL)[0]
        assert np.abs(best.T_camera_target - T).max() < 1e-6


def test_a_tilted_tag_has_two_poses_and_the_better_is_the_true_one():
    T = pose_from_xyz_rpy((0.3, 0.2, 2.0), (0.5, -0.2, 1.0))
    fits = both_poses(rays_of(T), POINTS, FOCAL)
    assert len(fits) == 2
    assert np.abs(fits[0].T_camera_target - T).max() < 1e-8
    assert fits[0].residual_px < 1e-6 < fits[1].residual_px


def test_where_both_poses_fit_alike_the_expected_one_is_chosen():
    rng = np.random.default_rng(5)
    small = tag_square(0.06, from_above=False)
    T = pose_from_xyz_rpy((0.1, 0.0, 2.4), (0.25, 0.0, 0.4))
    up = T[:3, 2]
    wrong_best, wrong_chosen = 0, 0
    for _ in range(200):
        fits = both_poses(rays_of(T, small) + rng.normal(0, 0.1 / FOCAL, (4, 2)), small, FOCAL)
        wrong_best += fits[0].T_camera_target[:3, 2] @ up < np.cos(0.3)
        wrong_chosen += choose_pose(fits, up).T_camera_target[:3, 2] @ up < np.cos(0.3)
    assert wrong_best > 20
    assert wrong_chosen < wrong_best / 2


def test_no_pose_is_invented_for_points_that_no_tag_can_give():
    crossed = np.array([[0.1, 0.1], [-0.1, -0.1], [0.1, -0.1], [-0.1, 0.1]])
    for rays in (np.zeros((4, 2)), crossed, np.full((4, 2), 1e6)):
        for fit in both_poses(rays, POINTS, FOCAL):
            assert np.isfinite(fit.T_camera_target).all()


def test_the_covariance_is_that_of_the_errors():
    rng = np.random.default_rng(2)
    square = np.concatenate([POINTS + off for off in ((0.3, 0.3), (0.3, -0.3), (-0.3, -0.3), (-0.3, 0.3))])
    T = pose_from_xyz_rpy((0.1, -0.1, 1.8), (0.02, 0.01, 0.7))
    moves, sds = [], []
    for _ in range(300):
        fit = both_poses(rays_of(T, square) + rng.normal(0, 0.2 / FOCAL, (16, 2)), square, FOCAL)[0]
        moves.append(fit.T_camera_target[:3, 3] - T[:3, 3])
        sds.append(np.diag(fit.covariance)[3:])
    # A small motion turns about the camera: the shift of the target's origin has a part of the rotation.
    assert np.std(moves, axis=0)[2] == pytest.approx(np.sqrt(np.mean(sds, axis=0)[2]), rel=0.5)
