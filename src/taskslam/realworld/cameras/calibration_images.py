"""Views of a board from pictures or from a video: which are of use, and why the others are not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import CameraError, DetectorError, InputError
from taskslam.geometry import FloatArray
from taskslam.reading import is_folder
from taskslam.realworld.cameras.boards import AprilGrid, BoardFinder, CharucoBoard, Found
from taskslam.realworld.cameras.calibration import Calibration, View, calibrate
from taskslam.realworld.cameras.camera_model import DistortionModel
from taskslam.realworld.cameras.images import SUFFIXES, GreyImage, list_images, read_grey
from taskslam.realworld.cameras.undistortion import Rectifier
from taskslam.realworld.extra import load_opencv

_RECTIFIED_TURNS = 2
_MOST_VIEWS = 60  # of a video: more add time, not knowledge
_LOOKS_PER_SECOND = 3.0
_MOST_LOOKS = 1200
_STILL_PX = 1.5  # between neighbouring frames; a rolling shutter bends what moves


@dataclass(frozen=True, eq=False)
class CollectedViews:
    """size: width and height of the images, px. refused: name and reason of each picture without a use."""

    size: tuple[int, int]
    views: tuple[View, ...]
    refused: tuple[tuple[str, str], ...]


def collect_views(sources: Sequence[Path], board: CharucoBoard | AprilGrid) -> CollectedViews:
    """Views from folders, picture files or videos.

    Pictures of another size than most, broken ones and those without the board are refused by name; of a video, frames
    in which the board stands still are taken, at most 60 that differ most.

    Raises:
        CameraError: nothing to look at, or the board is nowhere.
    """
    views: list[tuple[tuple[int, int], View]] = []
    refused: list[tuple[str, str]] = []
    with BoardFinder(board) as finder:
        for source in sources:
            if is_folder(source) or source.suffix.lower() in SUFFIXES:
                files = list_images(source) if is_folder(source) else [source]
                for file in files:
                    _look_at(file, finder, views, refused)
            else:
                views.extend(_from_video(source, finder, refused))
    if not views:
        looked = f"{len(refused)} pictures looked at" if refused else "no pictures found"
        first = f"; {refused[0][0]}: {refused[0][1]}" if refused else ""
        raise CameraError(f"no view of the board {board.spec}: {looked}{first}; expected pictures or a video of it")
    size = Counter(size for size, _ in views).most_common(1)[0][0]
    for other, view in views:
        if other != size:
            refused.append((view.name, f"{other[0]} x {other[1]} px, where most are {size[0]} x {size[1]}"))
    return CollectedViews(size, tuple(view for other, view in views if other == size), tuple(refused))


def calibrate_from(
    collected: CollectedViews, board: CharucoBoard | AprilGrid, name: str, model: DistortionModel
) -> Calibration:
    """The camera that took the pictures; for boards of tags their corners are found again in rectified pictures.

    Raises:
        CameraError: see `calibration.calibrate`.
    """
    result = calibrate(collected.views, collected.size, name, model)
    with BoardFinder(board) as finder:
        if not finder.wants_rectified:
            return result
        for _ in range(_RECTIFIED_TURNS):
            rectifier = Rectifier(result.camera)
            views = [_again(fitted.view, finder, rectifier) for fitted in result.used]
            again = calibrate([view for view in views if view is not None], collected.size, name, model)
            result = replace(again, views=(*again.views, *result.dropped))
    return result


def _again(view: View, finder: BoardFinder, rectifier: Rectifier) -> View | None:
    assert view.picture is not None
    try:
        found = finder.find(view.picture(), view.name, rectifier)
    except (InputError, DetectorError):
        return None
    return None if found is None else _view(view.name, found, view.picture)


def _look_at(
    file: Path, finder: BoardFinder, views: list[tuple[tuple[int, int], View]], refused: list[tuple[str, str]]
) -> None:
    try:
        image = read_grey(file)
        found = finder.find(image, file.name)
    except (InputError, DetectorError) as error:
        refused.append((file.name, str(error)))
        return
    if found is None:
        refused.append((file.name, "no board, or too little of it"))
    else:
        views.append((_size(image), _view(file.name, found, partial(read_grey, file))))


def _from_video(
    file: Path, finder: BoardFinder, refused: list[tuple[str, str]]
) -> Iterator[tuple[tuple[int, int], View]]:
    cv2 = load_opencv()
    video = cv2.VideoCapture(str(file))
    try:
        rate = video.get(cv2.CAP_PROP_FPS)
        step = max(2, round((rate if 0 < rate < 1000 else 30.0) / _LOOKS_PER_SECOND))
        found: list[tuple[int, GreyImage, Found]] = []
        number = looks = moving = 0
        last: Found | None = None
        while looks < _MOST_LOOKS:
            wanted = number % step < 2
            if not video.grab():
                break
            if wanted:
                good, frame = video.retrieve()
                image = _grey(cv2, frame) if good and frame is not None else None
                seen = finder.find(image, f"{file.name} frame {number}") if image is not None else None
                if number % step == 0:
                    last, looks = seen, looks + 1
                elif image is not None and last is not None and seen is not None:
                    if _motion(last, seen) < _STILL_PX:
                        found.append((number, image, seen))
                        found = _most_different(found, _MOST_VIEWS) if len(found) >= 2 * _MOST_VIEWS else found
                    else:
                        moving += 1
            number += 1
    finally:
        video.release()
    if number == 0:
        raise CameraError(f"{file}: not a picture, a folder of pictures or a video that can be read")
    if moving:
        refused.append((file.name, f"the board moved in {moving} of the frames looked at; hold it still for a second"))
    if not found:
        refused.append((file.name, f"no still view of the board in {looks} frames looked at"))
    for at, image, seen in _most_different(found, _MOST_VIEWS):
        yield _size(image), _view(f"{file.name} frame {at}", seen, partial(np.copy, image))


def _most_different(found: list[tuple[int, GreyImage, Found]], count: int) -> list[tuple[int, GreyImage, Found]]:
    """At most `count` views, each as unlike the ones before as can be (farthest first), in their own order."""
    if len(found) <= count:
        return found
    features = np.array([_feature(seen) for _, _, seen in found])
    features = (features - features.mean(0)) / (features.std(0) + 1e-9)
    chosen = [0]
    distance = np.full(len(found), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, np.linalg.norm(features - features[chosen[-1]], axis=1))
        chosen.append(int(distance.argmax()))
    return [found[index] for index in sorted(chosen)]


def _feature(found: Found) -> FloatArray:
    """Where the board is, how large, and how it leans: the affine map from board to image and its foreshortening."""
    board = np.column_stack([found.points[:, :2], np.ones(len(found.points))])
    affine, *_ = np.linalg.lstsq(board, found.pixels, rcond=None)
    bent = found.pixels - board @ affine
    return np.concatenate([affine.ravel() * [0.1, 0.1, 0.1, 0.1, 1, 1], bent.std(0)])


def _motion(before: Found, after: Found) -> float:
    """Median motion, px, of the corners seen in both frames."""
    places = {tuple(point): pixel for point, pixel in zip(before.points.tolist(), before.pixels, strict=True)}
    moved = [
        float(np.linalg.norm(pixel - places[tuple(point)]))
        for point, pixel in zip(after.points.tolist(), after.pixels, strict=True)
        if tuple(point) in places
    ]
    return float(np.median(moved)) if moved else np.inf


def _grey(cv2: Any, frame: npt.NDArray[np.uint8]) -> GreyImage:
    return frame if frame.ndim == 2 else np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY))


def _size(image: GreyImage) -> tuple[int, int]:
    return int(image.shape[1]), int(image.shape[0])


def _view(name: str, found: Found, picture: Callable[[], GreyImage]) -> View:
    return View(name, found.points, found.pixels, found.outward, picture)
