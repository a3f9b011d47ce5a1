"""The packages of the extra `apriltag`, imported only where they are used."""

from __future__ import annotations

import importlib
from typing import Any

from taskslam.errors import InputError


def load_opencv() -> Any:
    """The module `cv2`, with its own threads limited to one, so that sums repeat whatever the machine.

    Raises:
        InputError: OpenCV is not installed, or is older than 4.9.
    """
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError as error:
        raise missing("OpenCV") from error
    if tuple(int(part) for part in cv2.__version__.split(".")[:2]) < (4, 9):
        raise InputError(f"OpenCV {cv2.__version__} is installed; expected 4.9 or newer")
    cv2.setNumThreads(1)
    return cv2


def missing(package: str) -> InputError:
    """What to say where `package` of the extra is absent."""
    return InputError(f'{package} is not installed; measuring with AprilTags needs: pip install "taskslam[apriltag]"')
