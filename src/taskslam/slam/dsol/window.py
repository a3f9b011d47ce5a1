"""The window of keyframes: its points as one cloud, whom a new keyframe replaces, and its adjustment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.slam.bundle.photometric import adjust
from taskslam.slam.dsol.points import GUESSED
from taskslam.slam.dsol.settings import DsolSettings
from taskslam.slam.vision.patches import Patches, Weighting, sample_patches
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import Pyramid

_MOST_INFORMATION = 10


@dataclass(frozen=True, slots=True)
class Keyframe:
    """A stereo pair with points of known depth.

    T_world_camera: (4, 4) of the left camera, optical axes. gain: of the exposure, the first keyframe's being 1.
    points: (N, 2) pixels of level 0; rays: (N, 2) x/z, y/z; inverse_depths: (N,) 1/m; information: (N,), see
    `points.MATCHED`; patches: of every level, (N, 5, 3).
    """

    T_world_camera: FloatArray
    gain: float
    left: Pyramid
    right: Pyramid
    points: FloatArray
    rays: FloatArray
    inverse_depths: FloatArray
    information: npt.NDArray[np.int64]
    patches: tuple[Patches, ...]


def make_keyframe(
    T_world_camera: FloatArray,
    gain: float,
    pair: tuple[Pyramid, Pyramid],
    pinhole: Pinhole,
    points: FloatArray,
    inverse_depths: FloatArray,
    information: npt.NDArray[np.int64],
) -> Keyframe:
    """A keyframe of the points whose inverse depth is known."""
    known = np.isfinite(inverse_depths)
    points = points[known]
    rays = (points - (pinhole.cx, pinhole.cy)) / pinhole.f
    patches = tuple(sample_patches(image, points, level) for level, image in enumerate(pair[0]))
    return Keyframe(T_world_camera, gain, *pair, points, rays, inverse_depths[known], information[known], patches)


class Cloud(NamedTuple):
    """The points of several keyframes one after another; hosts: (N,) which keyframe each is of."""

    hosts: npt.NDArray[np.int64]
    rays: FloatArray
    inverse_depths: FloatArray
    information: npt.NDArray[np.int64]
    patches: tuple[Patches, ...]

    def at_least(self, information: int) -> Cloud:
        """The points with so much information."""
        keep = self.information >= information
        patches = tuple(level[keep] for level in self.patches)
        return Cloud(self.hosts[keep], self.rays[keep], self.inverse_depths[keep], self.information[keep], patches)


def cloud_of(keyframes: Sequence[Keyframe]) -> Cloud:
    """All points of at least one keyframe."""
    return Cloud(
        np.repeat(np.arange(len(keyframes)), [len(keyframe.points) for keyframe in keyframes]),
        np.concatenate([keyframe.rays for keyframe in keyframes]),
        np.concatenate([keyframe.inverse_depths for keyframe in keyframes]),
        np.concatenate([keyframe.information for keyframe in keyframes]),
        tuple(np.concatenate(level) for level in zip(*(keyframe.patches for keyframe in keyframes), strict=True)),
    )


def make_room(keyframes: Sequence[Keyframe], most: int, hosts_tracked: npt.NDArray[np.int64]) -> list[Keyframe]:
    """At most `most` - 1 keyframes: without those of whose points the fewest are tracked; hosts_tracked: (N,) hosts."""
    tracked = np.bincount(hosts_tracked, minlength=len(keyframes))
    leave = np.argsort(tracked, kind="stable")[: max(len(keyframes) - most + 1, 0)]
    return [keyframe for number, keyframe in enumerate(keyframes) if number not in leave]


def adjust_window(
    keyframes: Sequence[Keyframe], settings: DsolSettings, pinhole: Pinhole, weighting: Weighting
) -> list[Keyframe]:
    """The keyframes after photometric bundle adjustment.

    A point that fits in half of its images gains information; another loses some, and leaves when it has none to lose.
    """
    s, cloud = settings, cloud_of(keyframes)
    levels = range(min(s.adjust_level, s.levels - 1) + 1)
    adjusted = adjust(
        tuple(np.stack([keyframe.left[level] for keyframe in keyframes]) for level in levels),
        tuple(np.stack([keyframe.right[level] for keyframe in keyframes]) for level in levels),
        pinhole,
        np.stack([keyframe.T_world_camera for keyframe in keyframes]),
        np.array([keyframe.gain for keyframe in keyframes]),
        cloud.hosts,
        cloud.rays,
        cloud.inverse_depths,
        cloud.patches,
        weighting,
        levels[-1],
        s.adjust_iterations,
        (1.0 / s.max_depth, 1.0 / s.min_depth),
    )
    fits = (adjusted.fitting > 0) & (2 * adjusted.fitting >= adjusted.seen)
    information = np.minimum(cloud.information + np.where(fits, 1, -1), _MOST_INFORMATION)
    result = []
    for number, keyframe in enumerate(keyframes):
        own = cloud.hosts == number
        keep = information[own] >= GUESSED
        result.append(
            replace(
                keyframe,
                T_world_camera=adjusted.T_world_keyframes[number],
                points=keyframe.points[keep],
                rays=keyframe.rays[keep],
                inverse_depths=adjusted.inverse_depths[own][keep],
                information=information[own][keep],
                patches=tuple(level[keep] for level in keyframe.patches),
            )
        )
    return result
