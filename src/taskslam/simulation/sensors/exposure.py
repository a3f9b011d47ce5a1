"""How bright a camera's pictures come out: a fixed gain, or one that follows the scene without haste."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.robot import Camera

_BRIGHT, _BRIGHT_SHARE = 0.9, 99.0  # this percentage of the pixels stays below this share of full scale
_MIDDLE = 0.5  # and half of them below this one
_LARGEST = 8.0  # of the root gain; a lens in a dark corner does not turn noise into light
TIME_CONSTANT = 0.25  # seconds
_STRIDE = 4


def metered_gain(radiance_root: npt.NDArray[np.float32]) -> float:
    """The gain on (H, W) or (H, W, 3) roots of radiance at which highlights stay below white and the middle is grey."""
    strongest = radiance_root[::_STRIDE, ::_STRIDE]
    if strongest.ndim == 3:  # of the three channels: a red wall must not turn orange
        strongest = strongest.max(axis=2)
    middle, bright = np.percentile(strongest, (50.0, _BRIGHT_SHARE))
    wanted = min(_BRIGHT / max(float(bright), 1e-6), _MIDDLE / max(float(middle), 1e-6))
    return min(max(wanted, 1.0 / _LARGEST), _LARGEST)


class AutomaticExposure:
    """Follows the metered gain with a time constant (s) in its logarithm; the first frame sets it at once.

    A value of the frames seen since `reset` and of nothing else.
    """

    follows = True

    def __init__(self, rate: float, time_constant: float = TIME_CONSTANT) -> None:
        self._share = 1.0 - math.exp(-1.0 / (rate * time_constant))
        self.reset()

    def reset(self) -> None:
        """Forget the frames seen."""
        self._log_gain: float | None = None
        self._metered: tuple[npt.NDArray[np.float32] | None, float] = None, 1.0

    def gain(self, radiance_root: npt.NDArray[np.float32]) -> float:
        """The gain on roots of radiance for this frame, and for every camera that must match it."""
        if radiance_root is not self._metered[0]:
            self._metered = radiance_root, metered_gain(radiance_root)
        wanted = math.log(self._metered[1])
        if self._log_gain is None:
            self._log_gain = wanted
        else:
            self._log_gain += self._share * (wanted - self._log_gain)
        return math.exp(self._log_gain)


class FixedExposure:
    """Always the same: `exposure` multiplies radiance, its root multiplies the root."""

    follows = False

    def __init__(self, exposure: float) -> None:
        self._gain = math.sqrt(exposure)

    def reset(self) -> None:
        """Nothing to forget."""

    def gain(self, radiance_root: npt.NDArray[np.float32]) -> float:  # noqa: ARG002
        """The gain on roots of radiance."""
        return self._gain


def exposure_of(camera: Camera, lag: float | None = None) -> AutomaticExposure | FixedExposure:
    """What decides a camera's gains; `follows`: whether it must see every frame. lag: its time constant if worn, s."""
    if camera.exposure == "auto":
        return AutomaticExposure(camera.rate, lag or TIME_CONSTANT)
    return FixedExposure(camera.exposure)
