"""Why a picture shows no tag although one is in it: mirrored, swapped in colour, of another family, or cut off."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.tag_family import CELLS

_BORDER = 0.1  # of the longer side: white put around the picture


def what_is_there(image: npt.NDArray[np.uint8], family: str, maxhamming: int = 1) -> list[str]:
    """Sentences on tags that a picture (H, W) would show if it were otherwise; empty if none of that helps.

    Raises DetectorError, InputError as the detector does.
    """
    said = []
    for other in [family, *(name for name in CELLS if name != family)]:
        with Detector(other, maxhamming=maxhamming, refine_edges=False) as detector:
            for how, changed in _otherwise(image) if other == family else (("", image),):
                if ids := sorted({tag.id for tag in detector.detect(changed)}):
                    what = f"tag{'s' * (len(ids) > 1)} {', '.join(map(str, ids))} of {other}"
                    said.append(f"{what}: {how or f'another family, say --family {other}'}")
    return said


def _otherwise(image: npt.NDArray[np.uint8]) -> list[tuple[str, npt.NDArray[np.uint8]]]:
    width = max(8, round(_BORDER * max(image.shape)))
    return [
        ("mirrored; the picture was flipped, or the tag printed from behind", np.ascontiguousarray(image[:, ::-1])),
        ("its black and white are swapped", 255 - image),
        (
            "at the edge of the picture, where its white border is cut off",
            np.pad(image, width, constant_values=int(image.max())),
        ),
    ]
