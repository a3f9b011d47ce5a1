import numpy as np
import pytest
from synthetic import EVERYTHING, PINHOLE, host, see

from taskslam.geometry import invert_se3
from taskslam.slam.vision.direct_alignment import align, correlations, twist_jacobian
from taskslam.slam.vision.patches import INLIER, Weighting
from taskslam.slam.vision.pyramid import build_pyramid
from taskslam.slam.vision.se3 import exp_se3

PAPER = Weighting(c2=2.0, nu=4.0, outlier=1.5, most_outliers=1)


@pytest.fixture(scope="module")
def view():
    return host(np.eye(4))


def aligned(view, T_world_camera, weighting=PAPER, gain=1.0, expose=True, pair=None):
    left, right = pair or (build_pyramid(image, 3) for image in see(T_world_camera, gain))
    _, _, rays, inverse_depths, patches = view
    hosts = np.zeros(len(rays), np.int64)
    return align(
        left,
        right,
        PINHOLE,
        np.eye(4)[None],
        np.ones(1),
        1.0,
        hosts,
        rays,
        inverse_depths,
        patches,
        weighting,
        20,
        expose,
    )


@pytest.mark.parametrize(
    "twist",
    [(0.03, 0, 0, 0, 0, 0), (0, 0, 0.08, 0, 0, 0), (0, 0, 0, 0, 0.03, 0), (0.02, -0.01, 0.04, 0.01, -0.02, 0.02)],
)
def test_the_pose_of_a_rendered_view_is_found(view, twist):
    T_world_camera = exp_se3(np.array(twist))
    found = aligned(view, T_world_camera)
    off = found.T @ T_world_camera
    assert np.linalg.norm(off[:3, 3]) < 2e-3
    assert np.abs(off[:3, :3] - np.eye(3)).max() < 1e-3
    assert found.fitting > 0.9 * found.seen
    assert (found.states == INLIER).mean() > 0.8


@pytest.mark.parametrize("gain", [0.7, 1.2])
def test_the_exposure_is_found_with_it_and_spoils_the_pose_if_it_is_not_asked_for(view, gain):
    T_world_camera = exp_se3(np.array([0.02, -0.01, 0.04, 0.01, -0.02, 0.02]))
    found = aligned(view, T_world_camera, gain=gain)
    assert found.gain == pytest.approx(gain, rel=0.02)
    blind = aligned(view, T_world_camera, gain=gain, expose=False)
    off, off_blind = (np.linalg.norm((each.T @ T_world_camera)[:3, 3]) for each in (found, blind))
    assert off < 4e-3
    assert off_blind > 3 * off
    assert blind.gain == 1.0


def test_a_twist_moves_the_pixels_as_the_jacobian_says():
    """Numerical differences of the projection of a point into the left and the right image."""
    point = np.array([0.4, -0.3, 1.7])
    for aside in (0.0, PINHOLE.baseline):

        def project(eta, aside=aside):
            x, y, z = (exp_se3(eta) @ [*point, 1.0])[:3]
            return PINHOLE.f * np.array([(x - aside) / z, y / z])

        steps = 1e-6 * np.eye(6)
        numerical = np.stack([(project(step) - project(-step)) / 2e-6 for step in steps], axis=1)
        J0, J1 = np.zeros(6), np.zeros(6)
        x, y, z = point[0] / point[2], point[1] / point[2], 1.0 / point[2]
        twist_jacobian(J0, J1, PINHOLE.f, x, y, z, x - aside * z)
        np.testing.assert_allclose(np.stack([J0, J1]), numerical, atol=1e-6)


def test_black_pictures_fit_nothing(view):
    black = build_pyramid(np.zeros((120, 160), np.uint8), 3)
    found = aligned(view, np.eye(4), pair=(black, black))
    assert found.fitting < 0.1 * found.seen


def test_correlation_tells_the_right_place_from_another_and_from_noise(view):
    _, _, rays, inverse_depths, patches = view
    hosts = np.zeros(len(rays), np.int64)
    there = exp_se3(np.array([0.02, -0.01, 0.04, 0.01, -0.02, 0.02]))
    image = build_pyramid(see(there, gain=0.6)[0], 3)[1]

    def likeness(picture, T_camera_world):
        return correlations(picture, PINHOLE.at_level(1), T_camera_world[None], hosts, rays, inverse_depths, patches[1])

    assert np.nanmedian(likeness(image, invert_se3(there))) > 0.95
    elsewhere = exp_se3(np.array([0.4, 0.2, 0, 0, 0, 0.5]))
    assert (likeness(image, elsewhere) > 0.7).mean() < 0.35
    noise = np.random.default_rng(0).integers(0, 256, image.shape, dtype=np.uint8)
    assert abs(np.nanmean(likeness(noise, invert_se3(there)))) < 0.2
    away = exp_se3(np.array([0, 0, 0, 0, 3.0, 0]))
    assert np.isnan(likeness(image, away)).all()


def test_the_same_pictures_give_the_same_bytes(view):
    T_world_camera = exp_se3(np.array([0.02, -0.01, 0.04, 0.01, -0.02, 0.02]))
    one, two = (aligned(view, T_world_camera, EVERYTHING) for _ in range(2))
    assert one.T.tobytes() == two.T.tobytes()
