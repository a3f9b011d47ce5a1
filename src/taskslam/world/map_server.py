"""Floor plans in the files of ROS's map_server: a YAML that names an image (pgm or png).

Meaning of every key and of the three modes: wiki.ros.org/map_server. A pixel's occupancy is p = (255 - v) / 255, or
v / 255 with `negate`; trinary: occupied above `occupied_thresh`, free below `free_thresh`, unknown between.
"""

from __future__ import annotations

import io
import math
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image

from taskslam.errors import FloorPlanError
from taskslam.geometry import SE2, FloatArray
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan
from taskslam.world.pgm import read_pgm, write_pgm

_GREY_OF = {OCCUPIED: 0, FREE: 254, UNKNOWN: 205}  # what map_saver writes
_DEFAULTS = {"occupied_thresh": 0.65, "free_thresh": 0.196}


def load_floor_plan(yaml_path: Path, free_205: bool = False) -> FloorPlan:
    """Read a floor plan from a map_server YAML file; its image stands relative to it or at an absolute path.

    free_205: count grey 205 as free where the thresholds leave it unknown. Some maps draw free space so (the
    published TSRB plan: protocol 6.1), although 205 means unknown to map_server.

    `mode: scale` and `raw` grade occupancy in percent; as a FloorPlan holds three values, they are read the way
    costmap_2d's static layer reads them by default: 100 is occupied, -1 unknown, anything between free.

    Raises:
        FloorPlanError: a file is missing or broken, a key is missing or out of range; one sentence that says which.
    """
    yaml_path = Path(yaml_path)
    settings = _read_yaml(yaml_path)
    where = str(yaml_path)
    resolution = _number(settings, "resolution", where)
    if resolution <= 0:
        raise FloorPlanError(f"{where}: resolution is {resolution}, expected metres per cell above 0")
    origin = _origin(settings, where)
    occupied, free = (_threshold(settings, key, where) for key in ("occupied_thresh", "free_thresh"))
    if occupied < free:
        raise FloorPlanError(f"{where}: occupied_thresh {occupied} is below free_thresh {free}")
    mode = settings.get("mode", "trinary")
    if mode not in ("trinary", "scale", "raw"):
        raise FloorPlanError(f"{where}: mode is {mode!r}, expected trinary, scale or raw")
    grey, opaque = _read_image(yaml_path, settings.get("image"), average_alpha=mode == "trinary")
    cells = _classify(grey, opaque, mode, _flag(settings, "negate", where), occupied, free)
    if free_205:
        cells[(cells == UNKNOWN) & (grey == 205)] = FREE
    return FloorPlan(np.ascontiguousarray(cells[::-1]), resolution, origin)


def save_floor_plan(plan: FloorPlan, yaml_path: Path, image: Literal["pgm", "png"] = "pgm") -> None:
    """Write `yaml_path` and, beside it under the same stem, the image; `load_floor_plan` gives the same plan back.

    Raises:
        FloorPlanError: a file cannot be written.
    """
    yaml_path = Path(yaml_path)
    grey = np.full(plan.cells.shape, _GREY_OF[UNKNOWN], np.uint8)
    for value in (FREE, OCCUPIED):
        grey[plan.cells == value] = _GREY_OF[value]
    grey = np.ascontiguousarray(grey[::-1])
    if image == "pgm":
        data = write_pgm(grey)
    else:
        buffer = io.BytesIO()
        Image.fromarray(grey).save(buffer, format="PNG")
        data = buffer.getvalue()
    image_path = yaml_path.with_suffix(f".{image}")
    settings = {
        "image": image_path.name,
        "mode": "trinary",
        "resolution": float(plan.resolution),
        "origin": [float(plan.origin.x), float(plan.origin.y), float(plan.origin.theta)],
        "negate": 0,
        **_DEFAULTS,
    }
    try:
        image_path.write_bytes(data)
        yaml_path.write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
    except OSError as error:
        raise FloorPlanError(f"{yaml_path}: cannot write the floor plan: {error.strerror}") from error


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        settings = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FloorPlanError(f"{path}: cannot read the floor plan: {error.strerror}") from error
    except (UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise FloorPlanError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(settings, dict):
        raise FloorPlanError(f"{path}: not a map_server file: expected keys such as image, resolution and origin")
    return settings


def _as_number(value: object) -> float:
    """Return a finite float, or NaN for anything else; YAML 1.1 leaves numbers such as 5e-2 as strings."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return math.nan
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return math.nan
    return number if math.isfinite(number) else math.nan


def _number(settings: dict[str, Any], key: str, where: str) -> float:
    if key not in settings:
        raise FloorPlanError(f"{where}: the key '{key}' is missing")
    number = _as_number(settings[key])
    if math.isnan(number):
        raise FloorPlanError(f"{where}: {key} is {settings[key]!r}, expected a finite number")
    return number


def _threshold(settings: dict[str, Any], key: str, where: str) -> float:
    number = _number({**_DEFAULTS, **settings}, key, where)
    if not 0 <= number <= 1:
        raise FloorPlanError(f"{where}: {key} is {number}, expected a probability in 0..1")
    return number


def _origin(settings: dict[str, Any], where: str) -> SE2:
    if "origin" not in settings:
        raise FloorPlanError(f"{where}: the key 'origin' is missing")
    value = settings["origin"]
    numbers = [_as_number(part) for part in value] if isinstance(value, list) else []
    if len(numbers) != 3 or any(math.isnan(number) for number in numbers):
        raise FloorPlanError(f"{where}: origin is {value!r}, expected three finite numbers x, y, yaw")
    return SE2(*numbers)


def _flag(settings: dict[str, Any], key: str, where: str) -> bool:
    value = settings.get(key, 0)
    if value not in (0, 1):
        raise FloorPlanError(f"{where}: {key} is {value!r}, expected 0 or 1")
    return bool(value)


def _read_image(yaml_path: Path, name: object, average_alpha: bool) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """(H, W) grey in 0..255 and (H, W) whether a pixel is opaque, row 0 at the top."""
    if not isinstance(name, str) or not name:
        raise FloorPlanError(f"{yaml_path}: image is {name!r}, expected the name of a pgm or png file")
    path = yaml_path.parent / name
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FloorPlanError(f"{yaml_path}: cannot read its image {path}: {reason}") from error
    if not data.startswith(b"\x89PNG"):
        grey = read_pgm(data, str(path))
        return grey, np.ones(grey.shape, np.bool_)
    return _grey_of_png(data, path, average_alpha)


def _grey_of_png(data: bytes, path: Path, average_alpha: bool) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                has_alpha = "A" in image.getbands() or "transparency" in image.info
                deep = image.mode.startswith("I")
                pixels = np.asarray(image if deep else image.convert("RGBA" if has_alpha else "RGB"), dtype=np.float64)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise FloorPlanError(f"{path}: not a readable png: {error}") from error
    if deep:
        return pixels / 257.0, np.ones(pixels.shape, np.bool_)
    if not has_alpha:
        return pixels.mean(axis=2), np.ones(pixels.shape[:2], np.bool_)
    # map_server averages alpha in with the colours in trinary mode, and reads it as "known" in the others
    grey = pixels.mean(axis=2) if average_alpha else pixels[:, :, :3].mean(axis=2)
    return grey, pixels[:, :, 3] == 255


def _classify(
    grey: FloatArray, opaque: npt.NDArray[np.bool_], mode: str, negate: bool, occupied: float, free: float
) -> npt.NDArray[np.uint8]:
    if mode == "raw":
        percent = np.round(grey)
        return np.select([percent == 100, percent < 100], [OCCUPIED, FREE], UNKNOWN).astype(np.uint8)
    p = grey / 255.0 if negate else (255.0 - grey) / 255.0
    if mode == "trinary":
        return np.select([p > occupied, p < free], [OCCUPIED, FREE], UNKNOWN).astype(np.uint8)
    return np.select([~opaque, p > occupied], [UNKNOWN, OCCUPIED], FREE).astype(np.uint8)
