"""Calibrations in files: ROS camera_info YAML in and out, Kalibr camchain in."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import yaml

from taskslam.errors import CameraError
from taskslam.realworld.cameras.camera_model import Camera, DistortionModel
from taskslam.user_files import read_mapping

FloatArray = npt.NDArray[np.float64]
ImageKind = Literal["raw", "rectified"]

_EXPECTED = "the keys of ROS camera_info or of a Kalibr camchain"
_KALIBR_NAME = re.compile(r"cam[0-9]+")
_KALIBR_MODELS = {"radtan": DistortionModel.PLUMB_BOB, "equidistant": DistortionModel.EQUIDISTANT}


def load_camera(path: Path, image_kind: ImageKind = "raw", name: str | None = None) -> Camera:
    """The camera that a calibration file describes; a Kalibr camchain's first camera, or that called `name`.

    image_kind: "raw" images are as the sensor gave them (K and the distortion apply); "rectified" ones went through
    ROS image_proc or the like (the left part of the projection matrix P applies, without distortion, and only a ROS
    file has it). Taking K for rectified images is a defect of the published evaluation (protocol 5.7).

    Raises:
        CameraError: unreadable, no calibration, singular, or without a projection matrix where one is needed.
    """
    content = read_mapping(path, "calibration", CameraError, _EXPECTED)
    if any(_KALIBR_NAME.fullmatch(str(key)) for key in content):
        chain = _kalibr_chain(path, content)
        if image_kind == "rectified":
            raise CameraError(f"{path}: a Kalibr camchain describes raw images; expected a ROS camera_info file")
        wanted = name or next(iter(chain))
        if wanted not in chain:
            raise CameraError(f"{path}: no camera '{wanted}'; expected one of {', '.join(chain)}")
        return chain[wanted][0]
    return _ros_camera(path, content, image_kind)


def load_camchain(path: Path) -> dict[str, tuple[Camera, FloatArray]]:
    """All cameras of a Kalibr camchain by name, each with T_camera_first (4, 4): from the first camera's optical frame.

    Raises:
        CameraError: unreadable, or not a camchain.
    """
    return _kalibr_chain(path, read_mapping(path, "calibration", CameraError, _EXPECTED))


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


def _ros_camera(path: Path, content: dict[str, Any], image_kind: ImageKind) -> Camera:
    width, height = (_size(path, content, key) for key in ("image_width", "image_height"))
    name = _word(path, content, "camera_name", path.stem)
    if image_kind == "rectified":
        P = _data(path, content, "projection_matrix", (3, 4))
        return Camera(name, width, height, P[:, :3], np.zeros(0))
    K = _data(path, content, "camera_matrix", (3, 3))
    distortion = _data(path, content, "distortion_coefficients", None)
    model = _word(path, content, "distortion_model", DistortionModel.PLUMB_BOB)
    return _camera(path, name, (width, height), K, distortion.ravel(), model)


def _camera(path: Path, name: str, size: tuple[int, int], K: FloatArray, distortion: FloatArray, model: str) -> Camera:
    try:
        return Camera(name, *size, K, distortion, model)  # type: ignore[arg-type]  # checked there
    except CameraError as error:
        raise CameraError(f"{path}: {error}") from error


def _size(path: Path, content: dict[str, Any], key: str) -> int:
    value = content.get(key)
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
        raise CameraError(f"{path}: {key} is missing or not made of {expected}; expected ROS camera_info") from None


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


def _kalibr_chain(path: Path, content: dict[str, Any]) -> dict[str, tuple[Camera, FloatArray]]:
    """Kalibr's yaml formats: cam0, cam1 ..., each after the first with T_cn_cnm1 from the camera before it."""
    chain: dict[str, tuple[Camera, FloatArray]] = {}
    T_camera_first = np.eye(4)
    for name in sorted((str(key) for key in content if _KALIBR_NAME.fullmatch(str(key))), key=lambda n: (len(n), n)):
        entry = content[name]
        if not isinstance(entry, dict):
            raise CameraError(f"{path}: {name} is not a camera of a Kalibr camchain")
        if entry.get("camera_model") != "pinhole" or entry.get("distortion_model") not in list(_KALIBR_MODELS):
            raise CameraError(
                f"{path}: {name} is {_shown(entry.get('camera_model'))} with {_shown(entry.get('distortion_model'))}; "
                f"expected pinhole with {' or '.join(_KALIBR_MODELS)}"
            )
        if chain:
            T_camera_first = _data(path, entry, "T_cn_cnm1", (4, 4)) @ T_camera_first
        fx, fy, cx, cy = _data(path, entry, "intrinsics", (1, 4))[0]
        resolution = _data(path, entry, "resolution", (1, 2))[0]
        size = int(resolution[0]), int(resolution[1])
        distortion = _data(path, entry, "distortion_coeffs", None).ravel()
        K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        chain[name] = (
            _camera(path, name, size, K, distortion, _KALIBR_MODELS[entry["distortion_model"]]),
            T_camera_first,
        )
    if not chain:
        raise CameraError(f"{path}: no cam0; expected a Kalibr camchain")
    return chain
