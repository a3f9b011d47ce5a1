from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from taskslam.errors import CameraError
from taskslam.realworld.cameras.camera_files import load_camchain, load_camera, save_camera
from taskslam.realworld.cameras.camera_model import Camera

PUBLISHED = """
image_width: 648
image_height: 488
camera_name: 0
camera_matrix: {rows: 3, cols: 3, data: [638.5, 0, 323.9, 0, 636.9, 229.7, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.4222, 0.2251, 0.0008, 0.0025, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [564.5, 0, 324.9, 0, 0, 594.2, 229.9, 0, 0, 0, 1, 0]}
"""
CAMCHAIN = """
cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.6, 457.3, 367.2, 248.4]
  resolution: [752, 480]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.01, -0.02, 0.003, -0.001]
  distortion_model: equidistant
  intrinsics: [457.6, 456.1, 379.9, 255.2]
  resolution: [752, 480]
"""


def file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    return path


def test_the_published_layout_is_read_for_raw_images(tmp_path: Path) -> None:
    camera = load_camera(file(tmp_path, PUBLISHED), "raw")
    assert (camera.name, camera.width, camera.height) == ("0", 648, 488)
    assert camera.K[0, 0] == 638.5
    np.testing.assert_array_equal(camera.distortion, [-0.4222, 0.2251, 0.0008, 0.0025, 0])


def test_rectified_images_take_the_projection_matrix_and_no_distortion(tmp_path: Path) -> None:
    camera = load_camera(file(tmp_path, PUBLISHED), "rectified")
    assert (camera.K[0, 0], camera.K[1, 1]) == (564.5, 594.2)
    assert not camera.distortion.any()


def test_what_is_written_is_read_back_to_the_last_digit(tmp_path: Path) -> None:
    K = np.array([[790.123456789, 0, 607.1], [0, 792.2, 369.3], [0, 0, 1]])
    for model, distortion in (("plumb_bob", [0.1, -0.2, 1e-3, -1e-3, 0]), ("equidistant", [0.1, 0.2, 0.3, 1 / 3])):
        camera = Camera("é: [east]", 1280, 720, K, np.array(distortion), model)  # type: ignore[arg-type]
        save_camera(tmp_path / "c.yaml", camera)
        again = load_camera(tmp_path / "c.yaml")
        assert (again.name, again.width, again.height, again.model) == (camera.name, 1280, 720, camera.model)
        np.testing.assert_array_equal(again.K, camera.K)
        np.testing.assert_array_equal(again.distortion, camera.distortion)
        rectified = load_camera(tmp_path / "c.yaml", "rectified")
        np.testing.assert_array_equal(rectified.K, camera.K)


def test_a_kalibr_camchain_gives_its_cameras_and_where_they_are(tmp_path: Path) -> None:
    chain = load_camchain(file(tmp_path, CAMCHAIN))
    assert list(chain) == ["cam0", "cam1"]
    assert [camera.model for camera, _ in chain.values()] == ["plumb_bob", "equidistant"]
    np.testing.assert_array_equal(chain["cam1"][1][:3, 3], [-0.11, 0, 0])
    assert load_camera(file(tmp_path, CAMCHAIN), name="cam1").K[0, 0] == 457.6
    with pytest.raises(CameraError, match="no camera 'cam7'; expected one of cam0, cam1"):
        load_camera(file(tmp_path, CAMCHAIN), name="cam7")


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("camera_matrix:", "camera_matricks:", "camera_matrix is missing"),
        ("638.5", "0", "singular"),
        ("638.5", ".nan", "camera_matrix"),
        ("638.5, ", "", "3 x 3 numbers"),
        ("image_width: 648", "image_width: wide", "image_width is 'wide'"),
        ("image_width: 648\n", "", "image_width is missing"),
        ("plumb_bob", "omni", "expected one of brown, equi"),
        ("[-0.4222, ", "[", "4 distortion|plumb_bob"),
        ("\nimage_height", "\n\timage_height", "not valid YAML: line 3"),
    ],
)
def test_a_calibration_with_a_fault_is_named(tmp_path: Path, before: str, after: str, told: str) -> None:
    assert before in PUBLISHED
    broken = PUBLISHED.replace(before, after, 1)
    if "4 distortion" in told:  # four coefficients are allowed: the fifth is then zero
        assert load_camera(file(tmp_path, broken)).distortion[4] == 0
        return
    with pytest.raises(CameraError, match=told):
        load_camera(file(tmp_path, broken))


def test_an_absent_file_and_a_rectified_camchain_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match="No such file"):
        load_camera(tmp_path / "none.yaml")
    with pytest.raises(CameraError, match="describes raw images"):
        load_camera(file(tmp_path, CAMCHAIN), "rectified")


def test_nested_references_do_not_eat_memory(tmp_path: Path) -> None:
    levels = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    levels += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
    for key in ("camera_matrix: {data: *a11}", "image_width: *a11", "distortion_model: *a11", "camera_name: *a11"):
        name = key.partition(":")[0]
        text = "\n".join(line for line in PUBLISHED.strip().splitlines() if not line.startswith(name))
        with pytest.raises(CameraError):
            load_camera(file(tmp_path, "\n".join([*levels, text, key])))


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(st.sampled_from([PUBLISHED, CAMCHAIN]), st.data())
def test_any_value_in_any_place_is_read_or_refused(text: str, data: st.DataObject) -> None:
    content = yaml.safe_load(text)
    inside = content.get("cam1", content)
    inside[data.draw(st.sampled_from(sorted(inside)))] = data.draw(_VALUES)
    path = Path(data.draw(st.just("/dev/shm"))) / "taskslam_fuzzed_camera.yaml"
    path.write_text(yaml.safe_dump(content))
    try:
        load_camera(path, name="cam1" if "cam1" in content else None)
    except CameraError:
        pass
    finally:
        path.unlink()


def test_one_camera_of_a_chain_can_be_read_whatever_the_others_are(tmp_path: Path) -> None:
    without_place = re.sub(r"  T_cn_cnm1:\n(?:  - .*\n)*", "", CAMCHAIN)
    for other in (without_place, CAMCHAIN.replace("equidistant", "fov")):
        assert load_camera(file(tmp_path, other)).K[0, 0] == 458.6
    omni = CAMCHAIN.replace("camera_model: pinhole", "camera_model: omni", 1)
    assert load_camera(file(tmp_path, omni), name="cam1").K[0, 0] == 457.6
    with pytest.raises(CameraError, match="cam0 is 'omni'; expected a pinhole camera"):
        load_camera(file(tmp_path, omni))
    with pytest.raises(CameraError, match="T_cn_cnm1 is missing"):
        load_camchain(file(tmp_path, without_place))


def test_a_chain_of_openvins_places_its_cameras_by_the_imu(tmp_path: Path) -> None:
    chain = yaml.safe_load(CAMCHAIN)
    T_0_1 = np.array(chain["cam1"].pop("T_cn_cnm1"))
    T_imu_0 = np.eye(4)
    T_imu_0[:3, 3] = 1, 2, 3
    T_imu_1 = T_imu_0 @ np.linalg.inv(T_0_1)
    chain["cam0"]["T_imu_cam"], chain["cam1"]["T_imu_cam"] = T_imu_0.tolist(), T_imu_1.tolist()
    read = load_camchain(file(tmp_path, "%YAML:1.0 # need to specify the file type\n" + yaml.safe_dump(chain)))
    np.testing.assert_allclose(read["cam1"][1], T_0_1, atol=1e-12)


OPENCV = """%YAML:1.0
---
image_width: 648
image_height: 488
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 638.5, 0., 323.9, 0., 636.9, 229.7, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.4222, 0.2251, 0.0008, 0.0025, 0. ]
"""
ECHOED = """header:
  stamp: {sec: 1, nanosec: 2}
  frame_id: east
height: 488
width: 648
distortion_model: plumb_bob
d: [-0.4222, 0.2251, 0.0008, 0.0025, 0.0]
k: [638.5, 0.0, 323.9, 0.0, 636.9, 229.7, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [564.5, 0.0, 324.9, 0.0, 0.0, 594.2, 229.9, 0.0, 0.0, 0.0, 1.0, 0.0]
---
"""


@pytest.mark.parametrize("text", [OPENCV, ECHOED, ECHOED * 3, ECHOED.replace("d:", "D:").replace("k:", "K:")])
def test_what_other_tools_write_is_the_same_camera(tmp_path: Path, text: str) -> None:
    camera, published = load_camera(file(tmp_path, text)), load_camera(file(tmp_path, PUBLISHED))
    assert (camera.width, camera.height, camera.model) == (648, 488, published.model)
    np.testing.assert_array_equal(camera.K, published.K)
    np.testing.assert_array_equal(camera.distortion, published.distortion)
    if "p:" in text:
        rectified = load_camera(file(tmp_path, text), "rectified")
        np.testing.assert_array_equal(rectified.K, load_camera(file(tmp_path, PUBLISHED), "rectified").K)


@pytest.mark.parametrize("coefficients", ["{rows: 1, cols: 0, data: []}", "[]", "", None])
def test_no_coefficients_are_no_distortion(tmp_path: Path, coefficients: str | None) -> None:
    lines = [line for line in PUBLISHED.splitlines() if not line.startswith("distortion_coefficients")]
    if coefficients is not None:
        lines.append(f"distortion_coefficients: {coefficients}")
    assert not load_camera(file(tmp_path, "\n".join(lines))).distortion.any()
