import copy
from pathlib import Path

import numpy as np
import pytest
import yaml

from taskslam.errors import InputError
from taskslam.realworld.setup_file import BundleTag, CameraMount, InsideOutSetup, OutsideInSetup, load_setup

CAMERA = {"name": "east", "images": "east", "calibration": "east.yaml", "image_kind": "raw", "waypoints": [1, 2]}
GOOD = {"runs": [{"arrivals": "results/run"}], "tag": {"id": 5, "size": 0.19}, "cameras": [CAMERA]}


@pytest.fixture
def write(tmp_path):
    def make(content: object) -> Path:
        path = tmp_path / "setup.yaml"
        path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
        return path

    return make


def changed(**camera: object) -> dict:
    content = copy.deepcopy(GOOD)
    content["cameras"][0] |= camera
    return content


def test_a_small_setup_has_defaults_for_the_rest(write, tmp_path):
    setup = load_setup(write(GOOD), OutsideInSetup)
    assert setup.pause == 5.0
    assert setup.cameras[0].clock_offset == 0.0
    assert setup.path("east") == tmp_path / "east"


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("a: [", "not valid YAML"),
        ("- 1", "a list; expected the keys scenario, runs"),
        ("", "expected the keys"),
        ({**GOOD, "camera": 1}, r"unknown key 'camera'.*Did you mean 'cameras'"),
        (
            {**GOOD, "cameras": [CAMERA, {**CAMERA, "images": "x", "waypoints": [3]}]},
            "camera name east is given 2 times",
        ),
        (
            {**GOOD, "cameras": [CAMERA, {**CAMERA, "name": "b", "waypoints": [3]}]},
            "image folder east is given 2 times",
        ),
        ({**GOOD, "cameras": [CAMERA, {**CAMERA, "name": "b", "images": "b"}]}, "waypoint 1 is given 2 times"),
        ({**GOOD, "runs": []}, "runs"),
        ({**GOOD, "tag": {"id": -1, "size": 0.19}}, "tag.id"),
        ({**GOOD, "tag": {"id": 5, "size": 19}}, "tag.size"),
        (changed(waypoints=[0]), r"cameras.0.waypoints.0.*greater than or equal to 1"),
        (changed(waypoints=[]), r"cameras.0.waypoints"),
        (changed(image_kind="both"), "image_kind"),
        (changed(clock_offset="soon"), r"cameras\.0\.clock_offset: .*number.*, or should be 'estimate' \(got 'soon'\)"),
        (changed(clock_offset=float("nan")), "clock_offset"),
        (changed(name="../up"), "cameras.0.name"),
        (changed(gamma=0), "gamma"),
    ],
)
def test_what_is_wrong_is_named_with_its_key(write, content, complaint):
    with pytest.raises(InputError, match=complaint):
        load_setup(write(content), OutsideInSetup)


def test_the_image_kind_must_be_said_for_the_file_holds_two_cameras(write):
    content = copy.deepcopy(GOOD)
    del content["cameras"][0]["image_kind"]
    with pytest.raises(InputError, match=r"'cameras\.0\.image_kind' is missing.*rectified"):
        load_setup(write(content), OutsideInSetup)


def test_the_folder_is_the_files_own_and_not_to_be_written(write):
    with pytest.raises(InputError, match="unknown key 'folder'"):
        load_setup(write({**GOOD, "folder": "/elsewhere"}), OutsideInSetup)


def test_a_missing_file_and_a_huge_one_are_sentences(tmp_path):
    with pytest.raises(InputError, match="cannot read the setup"):
        load_setup(tmp_path / "none.yaml", OutsideInSetup)
    (tmp_path / "huge.yaml").write_bytes(b"a" * (2 << 20))
    with pytest.raises(InputError, match="larger than 1 MB"):
        load_setup(tmp_path / "huge.yaml", OutsideInSetup)


def test_a_square_of_four_tags_is_laid_out_as_one_faces_the_sheet(write):
    bundle = {"waypoints": [1], "square": {"ids": [10, 11, 12, 13], "size": 0.1, "spacing": 0.6}}
    content = {
        "runs": GOOD["runs"],
        "camera": {k: v for k, v in CAMERA.items() if k != "waypoints"},
        "bundles": [bundle],
    }
    setup = load_setup(write(content), InsideOutSetup)
    top_left, _, bottom_right, _ = setup.bundles[0].layout
    assert (top_left.id, top_left.x, top_left.y) == (10, -0.3, 0.3)
    assert (bottom_right.id, bottom_right.x, bottom_right.y) == (12, 0.3, -0.3)
    # In the frame of the robot below, x to the sheet's top and y to its right.
    assert np.allclose(top_left.corners.mean(axis=0), [0.3, -0.3])
    assert np.allclose(top_left.corners[0], [0.35, -0.35])


def test_a_tag_turned_left_on_its_sheet_turns_right_for_the_robot_below():
    corners = BundleTag(id=1, size=0.2, heading=90).corners
    assert np.allclose(corners[0], [-0.1, -0.1])  # its top left corner is at the sheet's lower left


@pytest.mark.parametrize(
    "bundle",
    [
        {"waypoints": [1]},
        {"waypoints": [1], "tags": [{"id": 1, "size": 0.1}, {"id": 1, "size": 0.1, "x": 1}]},
        {"waypoints": [1], "square": {"ids": [1, 1, 2, 3], "size": 0.1, "spacing": 0.6}},
        {"waypoints": [1], "square": {"ids": [1, 2, 3], "size": 0.1, "spacing": 0.6}},
    ],
)
def test_a_bundle_without_tags_or_with_one_id_twice_is_refused(write, bundle):
    content = {
        "runs": GOOD["runs"],
        "camera": {k: v for k, v in CAMERA.items() if k != "waypoints"},
        "bundles": [bundle],
    }
    with pytest.raises(InputError, match=r"bundles\.0"):
        load_setup(write(content), InsideOutSetup)


def test_a_camera_that_looks_up_sees_forward_at_the_top_of_its_image():
    T = CameraMount(x=0.1, z=0.4).T_base_camera
    assert np.allclose(T @ [0, -1, 0, 0], [1, 0, 0, 0])
    assert np.allclose(T @ [0, 0, 1, 0], [0, 0, 1, 0])
    assert np.allclose(T[:3, 3], [0.1, 0, 0.4])
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
