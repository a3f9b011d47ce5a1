"""A camera that looks up, and tags whose corners are projected exactly: what must not leak into position."""

import math
from pathlib import Path

import numpy as np
import pytest

from taskslam.geometry import SE2, invert_se3, rotation_from_rpy, wrap_angle
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.inside_out import bundle_station
from taskslam.realworld.looks import Frame, Look
from taskslam.realworld.setup_file import Bundle, BundleGrid, BundleTag, CameraMount, UpwardCamera
from taskslam.realworld.sighting import Fault, NoSighting, Sighting
from taskslam.realworld.tags.detector import Tag

CAMERA = Camera("up", 1400, 1200, np.array([[560.0, 0, 700], [0, 562, 600], [0, 0, 1]]), np.array([-0.1, 0.02, 0, 0]))
FOUR = Bundle(waypoints=(1,), square=BundleGrid(ids=(1, 2, 3, 4), size=0.16, spacing=0.6))
ONE = Bundle(waypoints=(1,), tags=(BundleTag(id=1, size=0.19),))


def source(**mount: float) -> UpwardCamera:
    return UpwardCamera(name="up", images="up", calibration="up.yaml", image_kind="raw", mount=CameraMount(**mount))


def seen(bundle: Bundle, base: SE2, mount: CameraMount, see, *, tilt=(0.0, 0.0), height=1.6, noise=0.0, seed=0) -> Look:
    """What the camera sees with the base at a pose in the tags' frame, `height` (m) below them."""
    T_tags_base = base.matrix()
    T_tags_base[:3, :3] = T_tags_base[:3, :3] @ rotation_from_rpy(*tilt, 0)
    T_tags_base[2, 3] = -height
    T_camera_tags = invert_se3(T_tags_base @ mount.T_base_camera)
    rng = np.random.default_rng(seed)
    tags = []
    for tag in bundle.layout:
        corners = see(CAMERA, T_camera_tags, tag.corners) + rng.normal(0, noise or 1e-12, (4, 2))
        tags.append(Tag(tag.id, "tag36h11", 0, 60.0, corners))
    return Look(Frame(seed, Path(f"{seed}.jpg")), tuple(tags))


def measured(bundle: Bundle, looks: list[Look], mount: UpwardCamera, published: bool = False) -> list[SE2]:
    station = bundle_station(bundle, 0, mount, CAMERA, looks, published)
    found = [station.measure(row) for row in range(len(looks))]
    assert all(isinstance(one, Sighting) for one in found), found
    return [one.pose for one in found]


def precision(poses: list[SE2]) -> float:
    points = np.array([(at.x, at.y) for at in poses])
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean())


@pytest.mark.parametrize("bundle", [FOUR, ONE])
@pytest.mark.parametrize("mount", [{}, {"x": 0.1, "y": -0.05, "heading": 90.0, "z": 0.0}])
def test_exact_corners_give_the_pose_of_the_base_under_the_tags(see, bundle, mount):
    camera = source(**mount)
    for base in (SE2(0.1, -0.2, 0.3), SE2(-0.3, 0.1, -2.5), SE2(0, 0, 0)):
        (pose,) = measured(bundle, [seen(bundle, base, camera.mount, see)], camera)
        assert pose.distance_to(base) < 1e-7
        assert abs(wrap_angle(pose.theta - base.theta)) < 1e-7


def test_heading_does_not_leak_into_position_as_it_does_in_the_published_way(see):
    """Protocol 5.7: a tag 0.6 m off the axis and headings that scatter by 5 degrees: 3.8 cm of E out of none."""
    rng = np.random.default_rng(4)
    ours, published = [], []
    for _ in range(80):
        bases = [SE2(0.6, 0.0, math.radians(heading)) for heading in rng.normal(0, 5, 5)]
        looks = [seen(ONE, base, source().mount, see) for base in bases]
        ours.append(precision(measured(ONE, looks, source())))
        published.append(precision(measured(ONE, looks, source(), published=True)))
    assert max(ours) < 1e-6
    assert np.mean(published) == pytest.approx(0.038, abs=0.003)


def test_a_tilt_moves_a_single_tag_by_the_height_times_its_tangent_and_a_bundle_not_at_all(see):
    camera, base, tilt = source(), SE2(0.05, 0.1, 0.4), math.radians(0.5)
    bundle = seen(FOUR, base, camera.mount, see, tilt=(tilt, 0.0), height=1.5)
    single = seen(ONE, base, camera.mount, see, tilt=(tilt, 0.0), height=1.5)
    assert measured(FOUR, [bundle], camera)[0].distance_to(base) < 1e-6
    assert measured(ONE, [single], camera)[0].distance_to(base) == pytest.approx(1.5 * math.tan(tilt), rel=0.03)


def test_a_camera_high_on_a_tilting_robot_still_gives_the_base(see):
    camera, base = source(x=0.05, z=0.4), SE2(0.05, 0.1, 0.4)
    look = seen(FOUR, base, camera.mount, see, tilt=(0.01, -0.008), height=2.0)
    assert measured(FOUR, [look], camera)[0].distance_to(base) < 1e-6


def test_a_bundle_reaches_a_millimetre_with_real_corner_noise_and_its_covariance_says_so(see):
    camera, base = source(), SE2(0.1, 0.1, 0.2)
    looks = [seen(FOUR, base, camera.mount, see, noise=0.05, seed=seed) for seed in range(150)]
    station = bundle_station(FOUR, 0, camera, CAMERA, looks)
    found = [station.measure(row) for row in range(len(looks))]
    errors = np.array([one.pose.array() - base.array() for one in found])
    claimed = np.mean([one.covariance for one in found], axis=0)
    assert np.median(np.linalg.norm(errors[:, :2], axis=1)) < 1.5e-3
    for axis in range(3):
        assert errors[:, axis].std() == pytest.approx(math.sqrt(claimed[axis, axis]), rel=0.2)


def test_one_tag_of_four_in_view_is_too_few(see):
    look = seen(FOUR, SE2(0.1, 0.1, 0.2), source().mount, see)
    alone = Look(look.frame, look.tags[:1])
    found = bundle_station(FOUR, 0, source(), CAMERA, [alone]).measure(0)
    assert isinstance(found, NoSighting)
    assert found.fault is Fault.CUT
    assert "1 of the tags 1, 2, 3, 4" in found.reason


def test_a_sheet_hung_otherwise_than_the_setup_says_is_refused(see):
    look = seen(FOUR, SE2(0.1, 0.1, 0.2), source().mount, see)
    other = FOUR.model_copy(update={"square": BundleGrid(ids=(1, 2, 3, 4), size=0.16, spacing=0.58)})
    found = bundle_station(other, 0, source(), CAMERA, [look]).measure(0)
    assert isinstance(found, NoSighting)
    assert found.fault is Fault.RESIDUAL


def test_an_id_seen_twice_decides_nothing(see):
    look = seen(FOUR, SE2(0.1, 0.1, 0.2), source().mount, see)
    double = Look(look.frame, (*look.tags, look.tags[2]))
    found = bundle_station(FOUR, 0, source(), CAMERA, [double]).measure(0)
    assert isinstance(found, NoSighting)
    assert found.fault is Fault.TWICE
