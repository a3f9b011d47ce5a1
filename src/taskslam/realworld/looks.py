"""Looking through the images of a camera once: which wanted tags are in which image, in the order of time.

Where the tags were found in one image, the next is first searched around those places alone, which is several times
faster; every so often, and whenever one is missing there, the whole image is searched, so that nothing stays hidden.

Corners are taken from linear light. A lens blurs light, but a camera writes its square root or so (gamma), which moves
the middle of a blurred edge into the black: a tag of 60 px looks 0.8 % too small, and that far too distant.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taskslam.errors import DetectorError, InputError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.cameras.images import GreyImage, list_images, read_grey
from taskslam.realworld.tags.detector import Detector, Tag

_STAMP = re.compile(r"(?<!\d)(?:(\d{1,11})([._])(\d{1,9})|(\d{1,19}))\Z")
_UNITS = ((17, 1), (14, 1000), (12, 1_000_000), (0, NANOSECONDS))  # digits of a whole number, and ns of its unit
_WHOLE_EVERY = 10  # images: a second tag of the same id is seen at the latest then
_AROUND = 0.75  # tag sides searched on each side of the last place
_AROUND_PX = 40
_TILE = 8  # px: the crop starts on the detector's own grid


@dataclass(frozen=True, slots=True)
class Frame:
    """An image file and its stamp, ns since 1970 by the camera's clock."""

    stamp: int
    path: Path


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """What one image showed. tags: those of the wanted ids, two of one id included.

    problem: why it could not be looked at. others: ids of other tags, where the whole image was searched.
    """

    frame: Frame
    tags: tuple[Tag, ...]
    problem: str | None = None
    others: tuple[int, ...] = ()

    def corners(self) -> dict[int, FloatArray]:
        """Corners (4, 2) by id of the tags that are there once."""
        ids = [tag.id for tag in self.tags]
        return {tag.id: tag.corners for tag in self.tags if ids.count(tag.id) == 1}


def image_frames(folder: Path) -> list[Frame]:
    """Images of a folder by time, whatever the order of their names.

    A name ends in its time since 1970: seconds with a decimal point (`1716393934.25.jpg`), seconds and nanoseconds
    (`1716393934_250000000`, also without zeros in front), or one whole number of ns, us or ms by its size. Where points
    stand before fractions of different lengths that end in zeros, these are nanoseconds, too.

    Raises:
        InputError: no such folder, no image in it, or a name without a stamp.
    """
    paths = list_images(folder)
    if not paths:
        raise InputError(f"{folder}: holds no image; expected those of one camera, named by their time")
    times = {}
    for path in paths:
        found = _STAMP.search(path.stem)
        if found is None:
            raise InputError(
                f"{path}: the name ends in no time; expected Unix seconds such as 1716393934.25{path.suffix}"
            )
        times[path] = (found[1] or found[4], found[2] or "", found[3] or "")
    fractions = [fraction for _, separator, fraction in times.values() if separator == "."]
    unpadded = len({len(fraction) for fraction in fractions}) > 1 and any(
        fraction.endswith("0") for fraction in fractions
    )
    frames = [Frame(_stamp(*time, unpadded), path) for path, time in times.items()]
    return sorted(frames, key=lambda frame: (frame.stamp, frame.path.name))


def _stamp(whole: str, separator: str, fraction: str, unpadded: bool) -> int:
    """Ns since 1970 of the parts of a name."""
    if not separator:
        size = len(whole)
        return int(whole) * next(scale for digits, scale in _UNITS if size >= digits)
    if separator == "_" or unpadded:
        return int(whole) * NANOSECONDS + int(fraction)
    return int(whole) * NANOSECONDS + int(f"{fraction:0<9}")


def look_through(
    frames: Sequence[Frame],
    camera: Camera,
    detector: Detector,
    ids: Iterable[int],
    gamma: float,
    progress: Callable[[int], None] | None = None,
) -> list[Look]:
    """Look for tags of some ids in images of one camera, one image in memory at a time.

    gamma: of the images, 1 if their grey values are linear in light.
    An image that is broken, or over which the detector dies, is a `Look` with a problem.

    Raises:
        CameraError: an image of another size than was calibrated.
        InputError: every image is broken.
    """
    wanted = frozenset(ids)
    looks: list[Look] = []
    for number, frame in enumerate(frames):
        last = looks[-1] if looks and number % _WHOLE_EVERY else None
        looks.append(_look(frame, camera, detector, wanted, gamma, last))
        if progress is not None:
            progress(number + 1)
    if all(look.problem for look in looks):
        raise InputError(f"{frames[0].path.parent}: no image could be read; the first: {looks[0].problem}")
    return looks


def _look(
    frame: Frame, camera: Camera, detector: Detector, wanted: frozenset[int], gamma: float, last: Look | None
) -> Look:
    try:
        image = read_grey(frame.path)
    except InputError as error:
        return Look(frame, (), str(error))
    camera.check_size(image, str(frame.path))
    try:
        if last is not None and last.tags:
            near = _search_near(image, detector, last.tags, gamma, frame.path.name)
            if near is not None:
                return Look(frame, near)
        found = detector.detect(image, frame.path.name)
        others = tuple(tag.id for tag in found if tag.id not in wanted)
        tags = tuple(tag for tag in found if tag.id in wanted)
        near = _search_near(image, detector, tags, gamma, frame.path.name) if tags else None
        return Look(frame, tags if near is None else near, others=others)
    except DetectorError as error:
        return Look(frame, (), str(error))


def _search_near(
    image: GreyImage, detector: Detector, tags: Sequence[Tag], gamma: float, name: str
) -> tuple[Tag, ...] | None:
    """The same tags in linear light in the part of the image around them; None unless all are there."""
    corners = np.concatenate([tag.corners for tag in tags])
    side = max(float(np.ptp(tag.corners, axis=0).max()) for tag in tags)
    around = max(_AROUND * side, _AROUND_PX)
    left, top = np.maximum(corners.min(axis=0) - around, 0).astype(int) // _TILE * _TILE
    right, bottom = np.ceil(corners.max(axis=0) + around).astype(int)
    ids = {tag.id for tag in tags}
    found = [tag for tag in detector.detect(linear_light(image[top:bottom, left:right], gamma), name) if tag.id in ids]
    if [tag.id for tag in found] != [tag.id for tag in tags]:
        return None
    shift = np.array([left, top], np.float64)
    return tuple(Tag(tag.id, tag.family, tag.hamming, tag.margin, tag.corners + shift) for tag in found)


def linear_light(image: GreyImage, gamma: float) -> GreyImage:
    """Grey values proportional to light, the brightest 255."""
    brightest = max(int(image.max(initial=0)), 1)
    table = np.rint(255 * np.minimum(np.arange(256) / brightest, 1.0) ** gamma).astype(np.uint8)
    return np.ascontiguousarray(table[image])
