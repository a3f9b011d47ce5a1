"""The detector's own process: `python -m taskslam.realworld.tags.detector_child OPTIONS`, OPTIONS being JSON.

It reads images (`taskslam.processes.messages`) from standard input, looks for tags with the AprilTag C library and
answers on standard output; what the library prints goes to standard error. It ends when its input does.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from taskslam.processes.messages import MessageReader, pack

_CHUNK = 1 << 20
# The C libraries report bottom-left, bottom-right, top-right, top-left, and put (0, 0) at the outer corner of the first
# pixel; OpenCV puts it at the centre of that pixel (AprilRobotics/apriltag issue 121).
_TO_ARTWORK_ORDER = [3, 2, 1, 0]
_TO_OPENCV_PIXELS = -0.5


def _apriltag_python(options: dict[str, Any]) -> Callable[[Any], list[tuple[int, int, float, Any]]]:
    from apriltag import apriltag

    detector = apriltag(
        options["family"],
        threads=options["threads"],
        maxhamming=options["maxhamming"],
        decimate=options["decimate"],
        blur=options["blur"],
        refine_edges=options["refine_edges"],
    )
    return lambda image: [(d["id"], d["hamming"], d["margin"], d["lb-rb-rt-lt"]) for d in detector.detect(image)]


def _pyapriltags(options: dict[str, Any]) -> Callable[[Any], list[tuple[int, int, float, Any]]]:
    from pyapriltags import Detector

    detector = Detector(
        families=options["family"],
        nthreads=options["threads"],
        quad_decimate=options["decimate"],
        quad_sigma=options["blur"],
        refine_edges=int(options["refine_edges"]),
    )
    most = options["maxhamming"]
    return lambda image: [
        (d.tag_id, d.hamming, d.decision_margin, d.corners) for d in detector.detect(image) if d.hamming <= most
    ]


def _finder(options: dict[str, Any]) -> Callable[[Any], list[tuple[int, int, float, Any]]]:
    try:
        return _apriltag_python(options)
    except ModuleNotFoundError:
        return _pyapriltags(options)


def main(options: dict[str, Any]) -> None:
    """Serve until standard input ends."""
    reply = os.dup(1)
    os.dup2(2, 1)
    try:
        find = _finder(options)
    except ModuleNotFoundError:
        _write(reply, pack({"missing": True}))
        return
    except Exception as error:  # whatever the library calls it: told in the parent, where someone reads it
        _write(reply, pack({"refused": f"{type(error).__name__}: {error}"[:500]}))
        return
    _write(reply, pack({"ready": True}))
    reader = MessageReader()
    while chunk := os.read(0, _CHUNK):
        for _, arrays in reader.messages(chunk):
            found = find(arrays["image"])
            corners = np.array([f[3] for f in found], "<f8").reshape(-1, 4, 2)[:, _TO_ARTWORK_ORDER]
            header = {
                "ids": [int(f[0]) for f in found],
                "hamming": [int(f[1]) for f in found],
                "margin": [float(f[2]) for f in found],
            }
            _write(reply, pack(header, {"corners": corners + _TO_OPENCV_PIXELS}))


def _write(descriptor: int, data: bytes) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
