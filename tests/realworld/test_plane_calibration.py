import math

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2, rotation_from_rpy, transform_points
from taskslam.realworld.plane_calibration import calibrate_plane
from taskslam.realworld.tags.tag_plane import TagPlane, tag_square

SIZE = 0.19
FOCAL = 791.0


@pytest.fixture
def sightings(webcam, see):
    """`sightings(plane, count, noise_px, region)`: rays (N, 4, 2) to a tag at random poses in the plane."""

    def make(plane: TagPlane, count: int, noise: float = 0.05, wobble: float = 0.0, seed: int = 0) -> np.ndarray:
        rng = np.random.default_rng(seed)
        square = tag_square(SIZE, plane.from_above)
        places = plane.meet(webcam.undistort(rng.uniform([160, 130], [1120, 590], (count, 2))))
        rows = []
        for place in places:
            corners = transform_points(SE2(*place, rng.uniform(-3, 3)), square)
            tilted = plane.T_camera_plane @ np.eye(4)
            if wobble:
                T = np.eye(4)
                T[:3, :3] = rotation_from_rpy(*rng.normal(0, wobble, 2), 0)
                T[:2, 3] = place - T[:2, :2] @ place
                tilted = tilted @ T
            rows.append(see(webcam, tilted, corners))
        noisy = np.array(rows) + rng.normal(0, noise, (count, 4, 2))
        return webcam.undistort(noisy.reshape(-1, 2)).reshape(-1, 4, 2)

    return make


def tilted(degrees: float, height: float = -2.5) -> TagPlane:
    up = rotation_from_rpy(math.radians(degrees), 0.05, 0) @ np.array([0, 0, math.copysign(1, height)])
    return TagPlane(up, height)


def angle(found: TagPlane, true: TagPlane) -> float:
    return math.degrees(math.acos(min(1.0, float(found.up @ true.up))))


@pytest.mark.parametrize(("degrees", "height"), [(0, -2.5), (30, -2.5), (45, -2.0), (0, 2.0), (5, 1.5)])
def test_eighty_sightings_give_the_plane_to_its_own_uncertainty(sightings, degrees, height):
    true = tilted(degrees, height)
    found = calibrate_plane(sightings(true, 80), SIZE, FOCAL, true.from_above)
    assert angle(found.plane, true) < 0.06
    assert abs(found.plane.height - height) < 4 * found.sd_height < 0.003
    assert found.well_spread


def test_a_wobbling_robot_still_gives_the_plane(sightings):
    true = tilted(30)
    found = calibrate_plane(sightings(true, 80, wobble=math.radians(0.3)), SIZE, FOCAL, from_above=True)
    assert angle(found.plane, true) < 0.15
    assert abs(found.plane.height - true.height) < 0.004


def test_one_sighting_is_enough_to_begin_with_and_says_how_unsure_it_is(sightings):
    true = tilted(30)
    found = calibrate_plane(sightings(true, 1), SIZE, FOCAL, from_above=True)
    assert found.places == 1
    assert not found.well_spread
    assert angle(found.plane, true) < 5 * math.degrees(found.sd_tilt) + 0.2


def test_wrong_detections_have_no_say(sightings):
    true = tilted(20)
    rays = sightings(true, 40)
    rays[::8, 1] += 12 / FOCAL
    found = calibrate_plane(rays, SIZE, FOCAL, from_above=True)
    assert angle(found.plane, true) < 0.1


def test_a_robot_at_rest_does_not_outvote_one_on_its_way(sightings):
    true = tilted(30)
    moving = sightings(true, 40)
    found = calibrate_plane(np.concatenate([np.repeat(moving[:1], 500, axis=0), moving]), SIZE, FOCAL, from_above=True)
    assert found.tags < 60
    assert angle(found.plane, true) < 0.1


def test_nothing_seen_is_said():
    with pytest.raises(InputError, match="no sighting"):
        calibrate_plane(np.empty((0, 4, 2)), SIZE, FOCAL, from_above=True)


def test_rubbish_is_refused_or_costs_only_its_residual():
    rng = np.random.default_rng(0)
    try:
        found = calibrate_plane(rng.uniform(-1, 1, (20, 4, 2)), SIZE, FOCAL, from_above=True)
    except InputError:
        return
    assert found.residual_px > 10
