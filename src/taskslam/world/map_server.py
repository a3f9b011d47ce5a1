"""Floor plans in the files of ROS's map_server: a YAML that names an image (pgm, png, bmp, tiff, jpeg and others).

Meaning of every key and of the three modes: wiki.ros.org/map_server. A pixel's occupancy is p = (255 - v) / 255, or
v / 255 with `negate`; trinary: occupied above `occupied_thresh`, free below `free_thresh`, unknown between.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image
from pydantic import BaseModel, BeforeValidator, Field, model_validator

from taskslam.errors import FloorPlanError
from taskslam.files import write_whole
from taskslam.geometry import SE2, FloatArray
from taskslam.reading import (
    LARGEST_PICTURE,
    LARGEST_WRITTEN_BY_HAND,
    MOST_CELLS,
    opened_picture,
    read_bytes,
    read_text,
)
from taskslam.user_files import check, keys_of, mapping_of
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan
from taskslam.world.pgm import read_pgm, write_pgm

_FORMATS = ("PNG", "BMP", "TIFF", "JPEG", "GIF", "WEBP", "PPM")
_PICTURES = (b"\x89PNG", b"BM", b"II*\0", b"MM\0*", b"\xff\xd8", b"GIF8", b"RIFF", b"P1", b"P3", b"P4", b"P6")
_HALF = 127.5
_GREY_OF = {OCCUPIED: 0, FREE: 254, UNKNOWN: 205}  # what map_saver writes


def _no_flag(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError("should be a number")
    return value


def _lower(value: object) -> object:
    return value.lower() if isinstance(value, str) else value


Number = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_no_flag)]
Probability = Annotated[Number, Field(ge=0, le=1)]
Coordinate = Annotated[Number, Field(ge=-1e7, le=1e7)]  # m, as far as a national grid reaches


class _MapFile(BaseModel):
    """The keys of map_server that are read; YAML 1.1 leaves numbers such as 5e-2 as text, so text may be a number."""

    image: str = Field(min_length=1)
    resolution: Annotated[Number, Field(ge=1e-6, le=100)]
    origin: tuple[Coordinate, Coordinate, Number]
    negate: bool = False
    occupied_thresh: Probability = 0.65
    free_thresh: Probability = 0.196
    mode: Annotated[Literal["trinary", "scale", "raw"], BeforeValidator(_lower)] = "trinary"

    @model_validator(mode="after")
    def _ordered(self) -> _MapFile:
        if self.occupied_thresh < self.free_thresh:
            raise ValueError(f"occupied_thresh {self.occupied_thresh} is below free_thresh {self.free_thresh}")
        return self


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
    text = read_text(yaml_path, "floor plan", FloorPlanError, LARGEST_WRITTEN_BY_HAND)
    # yaml-cpp, with which map_server reads, takes a tab for a blank
    keys = mapping_of(text.replace("\t", " "), str(yaml_path), FloorPlanError, keys_of(_MapFile))
    settings = check(_MapFile, keys, str(yaml_path), FloorPlanError)
    image = _read_image(yaml_path, settings.image, average_alpha=settings.mode == "trinary")
    cells = _classify(image.grey, settings)[image.levels]
    if settings.mode == "scale" and image.opaque is not None:
        cells[~image.opaque] = UNKNOWN
    if free_205:
        cells[(cells == UNKNOWN) & (image.grey == 205)[image.levels]] = FREE
    return FloorPlan(np.ascontiguousarray(cells[::-1]), settings.resolution, SE2(*settings.origin))


def plan_of_picture(picture: Path, scale: float | None = None, width: float = 0.0, cell: float = 0.05) -> FloorPlan:
    """A floor plan from a drawing: dark is wall, the rest is free. Its lower left corner is the origin of `map`.

    scale: m per pixel; without it, width: m from the left to the right edge. cell: m, at least; a cell is OCCUPIED
    where anything in it is dark.

    Raises FloorPlanError: the picture cannot be read, or would be more than a floor plan can be.
    """
    image = _read_image(picture, picture.name, average_alpha=False)
    dark = (image.grey < _HALF)[image.levels]
    if image.opaque is not None:
        dark &= image.opaque
    scale = scale or width / dark.shape[1]
    step = max(1, round(cell / scale))
    rows, columns = (-(-size // step) for size in dark.shape)
    padded = np.pad(dark[::-1], ((0, rows * step - dark.shape[0]), (0, columns * step - dark.shape[1])))
    occupied = padded.reshape(rows, step, columns, step).any(axis=(1, 3))
    return FloorPlan(np.where(occupied, np.uint8(OCCUPIED), np.uint8(FREE)), step * scale, SE2())


def save_floor_plan(plan: FloorPlan, yaml_path: Path, image: Literal["pgm", "png"] = "pgm") -> None:
    """Write `yaml_path` and, beside it under the same stem, the image; `load_floor_plan` gives the same plan back.

    Raises:
        DiskFullError: a file cannot be written. RecordError: there is no place for it.
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
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    write_whole(image_path, data)
    write_whole(yaml_path, yaml.safe_dump(settings, sort_keys=False))


@dataclass(frozen=True)
class _Image:
    """levels: (H, W) unsigned, row 0 at the top, what is stored; grey: 0..255 of each level; opaque: (H, W) or all."""

    levels: npt.NDArray[np.unsignedinteger]
    grey: FloatArray
    opaque: npt.NDArray[np.bool_] | None = None


def _read_image(yaml_path: Path, name: str, average_alpha: bool) -> _Image:
    path = yaml_path.parent / Path(name).expanduser()
    data = read_bytes(path, f"image of {yaml_path}", FloorPlanError, LARGEST_PICTURE)
    if not data.startswith((b"P2", b"P5")) and data.startswith(_PICTURES):
        return _read_picture(data, path, average_alpha)
    levels, maximum = read_pgm(data, str(path))
    return _Image(levels, np.arange(maximum + 1, dtype=np.float64) * (255.0 / maximum))


def _read_picture(data: bytes, path: Path, average_alpha: bool) -> _Image:
    with opened_picture(data, str(path), FloorPlanError, _FORMATS, MOST_CELLS) as image:
        if image.mode.startswith("I"):
            deep = np.asarray(image).clip(0, 65535).astype(np.uint16)
            return _Image(deep, np.arange(65536, dtype=np.float64) / 257.0)
        has_alpha = "A" in image.getbands() or "transparency" in image.info
        pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    # map_server averages alpha in with the colours in trinary mode, and reads it as "known" in the others
    bands = 4 if has_alpha and average_alpha else 3
    levels = pixels[:, :, :bands].sum(axis=2, dtype=np.uint16)
    return _Image(
        levels, np.arange(255 * bands + 1, dtype=np.float64) / bands, pixels[:, :, 3] == 255 if has_alpha else None
    )


def _classify(grey: FloatArray, settings: _MapFile) -> npt.NDArray[np.uint8]:
    """What each grey stands for."""
    occupied, free = settings.occupied_thresh, settings.free_thresh
    if settings.mode == "raw":
        percent = np.round(grey)
        return np.select([percent == 100, percent < 100], [OCCUPIED, FREE], UNKNOWN).astype(np.uint8)
    p = grey / 255.0 if settings.negate else (255.0 - grey) / 255.0
    if settings.mode == "trinary":
        return np.select([p > occupied, p < free], [OCCUPIED, FREE], UNKNOWN).astype(np.uint8)
    return np.select([p > occupied], [OCCUPIED], FREE).astype(np.uint8)
