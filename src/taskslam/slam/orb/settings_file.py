"""The settings file that ORB-SLAM3 reads: the camera of the rig and the published settings of the paper's run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from taskslam.robot import Camera

_MOST_FEATURES = 10_000
_MOST_CONTRAST = 255
# The viewer is never opened, but without its settings the file is refused.
_VIEWER = ("KeyFrameSize", "KeyFrameLineWidth", "GraphLineWidth", "PointSize", "CameraSize", "CameraLineWidth",
           "ViewpointX", "ViewpointY", "ViewpointZ", "ViewpointF")  # fmt: skip


@dataclass(frozen=True)
class OrbSettings:
    """What a user may change; the defaults are those of the paper's stereo runs in simulation (protocol 1.3).

    features: kept per image; fast_threshold: contrast of a corner in grey levels of 0..255, lowest_fast_threshold:
    where a cell of the image has none so; close_depth: a point nearer than so many baselines is taken into the map from
    one pair alone.

    Raises:
        ValueError: a value out of range.
    """

    features: int = 800
    fast_threshold: int = 20
    lowest_fast_threshold: int = 7
    close_depth: float = 35.0

    def __post_init__(self) -> None:
        if not 100 <= self.features <= _MOST_FEATURES:
            raise ValueError(f"features is {self.features}; expected 100 to {_MOST_FEATURES}")
        if not 1 <= self.lowest_fast_threshold <= self.fast_threshold <= _MOST_CONTRAST:
            raise ValueError(
                f"fast_threshold is {self.fast_threshold} and lowest_fast_threshold {self.lowest_fast_threshold}; "
                f"expected the latter from 1 to the former, both up to {_MOST_CONTRAST}"
            )
        if not 1.0 <= self.close_depth <= 1e6:
            raise ValueError(f"close_depth is {self.close_depth}; expected at least 1 baseline")


def write_settings(path: Path, camera: Camera, settings: OrbSettings) -> None:
    """Write the file. ORB-SLAM3 wants a decimal point in every real number and none in a whole one."""
    focal, (cx, cy) = float(camera.focal_length), camera.center
    values: dict[str, float | int | str] = {
        "Camera.type": '"PinHole"',
        "Camera.fx": focal,
        "Camera.fy": focal,
        "Camera.cx": float(cx),
        "Camera.cy": float(cy),
        "Camera.k1": 0.0,
        "Camera.k2": 0.0,
        "Camera.p1": 0.0,
        "Camera.p2": 0.0,
        "Camera.width": camera.width,
        "Camera.height": camera.height,
        "Camera.fps": float(camera.rate),
        "Camera.bf": focal * camera.baseline,
        "Camera.RGB": 1,
        "DepthMapFactor": 1.0,  # depth comes in metres
        "ThDepth": float(settings.close_depth),
        "ORBextractor.nFeatures": settings.features,
        "ORBextractor.scaleFactor": 1.2,
        "ORBextractor.nLevels": 8,
        "ORBextractor.iniThFAST": settings.fast_threshold,
        "ORBextractor.minThFAST": settings.lowest_fast_threshold,
    }
    values |= {f"Viewer.{key}": 1.0 for key in _VIEWER}
    lines = ["%YAML:1.0", *(f"{key}: {value}" for key, value in values.items()), ""]
    path.write_text("\n".join(lines), encoding="ascii")
