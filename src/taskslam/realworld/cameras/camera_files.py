"""Calibrations in files: ROS camera_info YAML in and out; Kalibr camchains, OpenCV's and echoed CameraInfo in.

camera_info, OpenCV   image_width, image_height, camera_matrix, distortion_coefficients, [distortion_model]
echoed CameraInfo     width, height, K or k, D or d, P or p, distortion_model (`rostopic echo`, `ros2 topic echo`)
camchain              cam0, cam1 ... each with intrinsics, distortion_coeffs, resolution, and its place
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import yaml

from taskslam.datasets.distortion import EQUIDISTANT, NONE, RADIAL, lens
from taskslam.errors import CameraError, DatasetError
from taskslam.geometry import invert_se3
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text
from taskslam.realworld.cameras.camera_model import Camera, DistortionModel
from taskslam.user_files import mapping_of

FloatArray = npt.NDArray[np.float64]
ImageKind = Literal["raw", "rectified"]

_EXPECTED = "the keys of ROS camera_info, of an echoed CameraInfo, of OpenCV or of a Kalibr camchain"
_KALIBR_NAME = re.compile(r"cam[0-9]+")
_MODELS = {NONE: DistortionModel.PLUMB_BOB, RADIAL: DistortionModel.PLUMB_BOB, EQUIDISTANT: DistortionModel.EQUIDISTANT}
_RATIONAL_COEFFICIENTS = 8
_KEYS = {
    "image_width": ("width",),
    "image_height": ("height",),
    "camera_matrix": ("K", "k", "Camera_Matrix"),
    "distortion_coefficients": ("D", "d", "Distortion_Coefficients", "distortion_coeffs"),
    "projection_matrix": ("P", "p"),
}
"""What other tools call the keys of camera_info."""


def load_camera(path: Path, image_kind: ImageKind = "raw", name: str | None = None) -> Camera:
    """The camera that a calibration file describes; a Kalibr camchain's first camera, or that called `name`.

    image_kind: "raw" images are as the sensor gave them (K and the distortion apply); "rectified" ones went through
    ROS image_proc or the like (the left part of the projection matrix P applies, without distortion, and only a ROS
    file has it). Taking K for rectified images is a defect of the published evaluation (protocol 5.7).

    Raises:
        CameraError: unreadable, no calibration, singular, or without a projection matrix where one is needed.
    """
    content = _content(path)
    if names := _kalibr_names(content):
        if image_kind == "rectified":
            raise CameraError(f"{path}: a Kalibr camchain describes raw images; expected a ROS camera_info file")
        wanted = name or names[0]
        if wanted not in names:
            raise CameraError(f"{path}: no camera '{wanted}'; expected one of {', '.join(names)}")
        return _kalibr_camera(path, wanted, content[wanted])
    return _ros_camera(path, content, image_kind)


def load_camchain(path: Path) -> dict[str, tuple[Camera, FloatArray]]:
    """All cameras of a Kalibr camchain by name, each with T_camera_first (4, 4): from the first camera's optical frame.

    Raises:
        CameraError: unreadable, or not a camchain.
    """
    return _kalibr_chain(path, _content(path))


def save_camera(path: Path, camera: Camera) -> None:
    """Write ROS camera_info YAML as `camera_calibration` does, with the identity as rectification and [K|0] as P.

    Raises:
        CameraError: the file cannot be written.
    """
    text = io.StringIO()
    P = np.column_stack([camera.K, np.zeros(3)])
    text.write(f"image_width: {camera.width}\nimage_height: {camera.height}\n")
    text.write(yaml.safe_dump({"camera_name": camera.name}, allow_unicode=True))
    text.write(_matrix("camera_matrix", camera.K))
    text.write(f"distortion_model: {camera.model.value}\n")
    text.write(_matrix("distortion_coefficients", camera.distortion[None]))
    text.write(_matrix("rectification_matrix", np.eye(3)))
    text.write(_matrix("projection_matrix", P))
    try:
        path.write_text(text.getvalue(), encoding="utf-8")
    except OSError as error:
        raise CameraError(f"{path}: cannot write the calibration: {error.strerror}") from error


def _matrix(key: str, values: FloatArray) -> str:
    data = ", ".join(repr(float(value)) for value in values.ravel())
    return f"{key}:\n  rows: {values.shape[0]}\n  cols: {values.shape[1]}\n  data: [{data}]\n"


def _content(path: Path) -> dict[str, Any]:
    """The keys of a calibration, also of OpenCV's FileStorage and of the first message that was echoed."""
    text = read_text(path, "calibration", CameraError, LARGEST_WRITTEN_BY_HAND).replace("!!opencv-matrix", "")
    if text.startswith("%YAML"):  # OpenCV writes a directive that is not YAML 1.1
        text = text.partition("\n")[2]
    first = re.split(r"^---[ \t]*$", text.removeprefix("---\n"), maxsplit=1, flags=re.MULTILINE)[0]
    content = mapping_of(first, str(path), CameraError, _EXPECTED)
    for key, others in _KEYS.items():
        found = next((other for other in others if other in content), None)
        if key not in content and found is not None:
            content[key] = content[found]
    return content


def _ros_camera(path: Path, content: dict[str, Any], image_kind: ImageKind) -> Camera:
    width, height = (_size(path, content, key) for key in ("image_width", "image_height"))
    name = _word(path, content, "camera_name", path.stem)
    if image_kind == "rectified":
        P = _data(path, content, "projection_matrix", (3, 4))
        return Camera(name, width, height, P[:, :3], np.zeros(0))
    K = _data(path, content, "camera_matrix", (3, 3))
    model = _word(path, content, "distortion_model", "fisheye" if content.get("fisheye_model") == 1 else "plumb_bob")
    return _camera(path, name, (width, height), K, model, _distortion(path, content, "distortion_coefficients"))


def _distortion(path: Path, content: dict[str, Any], key: str) -> FloatArray:
    """The coefficients; none where the key is absent or its list is empty."""
    entry = content.get(key)
    entry = entry.get("data") if isinstance(entry, dict) else entry
    return np.zeros(0) if entry is None or entry == [] else _data(path, content, key, None).ravel()


def _camera(path: Path, name: str, size: tuple[int, int], K: FloatArray, model: str, distortion: FloatArray) -> Camera:
    try:
        kind, coefficients = lens(model, distortion.tolist(), f"camera '{name}'")
        rational = len(coefficients) == _RATIONAL_COEFFICIENTS
        known = DistortionModel.RATIONAL_POLYNOMIAL if rational else _MODELS[kind]
        return Camera(name, *size, K, np.array(coefficients), known)
    except (CameraError, DatasetError) as error:
        raise CameraError(f"{path}: {error}") from error


def _size(path: Path, content: dict[str, Any], key: str) -> int:
    value = content.get(key)
    if value is None:
        raise CameraError(f"{path}: {key} is missing; expected {_EXPECTED}")
    if not isinstance(value, int) or not 1 <= value <= 100_000:
        raise CameraError(f"{path}: {key} is {_shown(value)}; expected a number of pixels")
    return value


def _data(path: Path, content: dict[str, Any], key: str, shape: tuple[int, int] | None) -> FloatArray:
    entry = content.get(key)
    entry = entry.get("data") if isinstance(entry, dict) else entry
    try:
        rows = [row if isinstance(row, list) else [row] for row in entry] if isinstance(entry, list) else []
        if not rows or len(rows) > 20 or any(len(row) > 20 for row in rows):
            raise ValueError("not a short list")
        # Each number by itself: a list nested by references could be larger than all memory.
        values = np.array([[_number(number) for number in row] for row in rows])
        if not np.isfinite(values).all():
            raise ValueError("not finite")
        return values if shape is None else values.reshape(shape)
    except (TypeError, ValueError, OverflowError):
        expected = "numbers" if shape is None else f"{shape[0]} x {shape[1]} numbers"
        raise CameraError(f"{path}: {key} is missing or not made of {expected}; expected {_EXPECTED}") from None


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("not a number")
    return float(value)


def _word(path: Path, content: dict[str, Any], key: str, default: str) -> str:
    value = content.get(key, default)
    if isinstance(value, (list, dict)) or value is None:
        raise CameraError(f"{path}: {key} is {_shown(value)}; expected a word")
    return str(value)


def _shown(value: object) -> str:
    return f"a {type(value).__name__}" if isinstance(value, (list, dict)) else f"{value!r:.40}"


def _kalibr_names(content: dict[str, Any]) -> list[str]:
    """The cameras of a camchain in their order."""
    return sorted((str(key) for key in content if _KALIBR_NAME.fullmatch(str(key))), key=lambda name: (len(name), name))


def _kalibr_camera(path: Path, name: str, entry: Any) -> Camera:
    """One camera of Kalibr's yaml formats, whatever the others are."""
    if not isinstance(entry, dict):
        raise CameraError(f"{path}: {name} is not a camera of a Kalibr camchain")
    if entry.get("camera_model", "pinhole") != "pinhole":
        raise CameraError(f"{path}: {name} is {_shown(entry['camera_model'])}; expected a pinhole camera")
    fx, fy, cx, cy = _data(path, entry, "intrinsics", (1, 4))[0]
    width, height = _data(path, entry, "resolution", (1, 2))[0]
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    model = _word(path, entry, "distortion_model", "none")
    return _camera(path, name, (int(width), int(height)), K, model, _distortion(path, entry, "distortion_coeffs"))


def _kalibr_chain(path: Path, content: dict[str, Any]) -> dict[str, tuple[Camera, FloatArray]]:
    """All cameras; each after the first with T_cn_cnm1 from the one before it, or all with T_imu_cam (OpenVINS)."""
    chain: dict[str, tuple[Camera, FloatArray]] = {}
    T_camera_first = np.eye(4)
    names = _kalibr_names(content)
    for name in names:
        camera = _kalibr_camera(path, name, content[name])
        entry = content[name]
        if chain and "T_cn_cnm1" not in entry and "T_imu_cam" in entry and "T_imu_cam" in content[names[0]]:
            T_imu_first = _data(path, content[names[0]], "T_imu_cam", (4, 4))
            T_camera_first = invert_se3(_data(path, entry, "T_imu_cam", (4, 4))) @ T_imu_first
        elif chain:
            T_camera_first = _data(path, entry, "T_cn_cnm1", (4, 4)) @ T_camera_first
        chain[name] = (camera, T_camera_first)
    if not chain:
        raise CameraError(f"{path}: no cam0; expected a Kalibr camchain")
    return chain
