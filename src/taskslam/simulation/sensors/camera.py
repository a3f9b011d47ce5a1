"""The stereo camera: a rectified pair of pinholes with exactly equal stamps, one exposure and read noise of its own."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Self

import numpy as np
import numpy.typing as npt

from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import Sensor, StereoImages
from taskslam.robot import Camera, StereoCamera
from taskslam.robot.imperfections import CameraImperfections
from taskslam.simulation.motion import Motion
from taskslam.simulation.rendering.rasterizer import Pinhole
from taskslam.simulation.rendering.scene import Scene, View
from taskslam.simulation.sensors.counted_noise import next_key
from taskslam.simulation.sensors.exposure import exposure_of
from taskslam.simulation.sensors.later import LaterStereoImages, WhileStanding
from taskslam.simulation.sensors.read_noise import develop
from taskslam.simulation.sensors.shutter import Shutter
from taskslam.simulation.sensors.simulated_sensor import Surroundings
from taskslam.simulation.streams import stream
from taskslam.world import World


def pinhole_of(camera: Camera) -> Pinhole:
    """How a camera is rendered; both of a pair are alike."""
    return Pinhole(camera.width, camera.height, camera.focal_length, camera.center, camera.near, camera.far)


class StereoCameraSensor:
    """Both images of one instant, (H, W) grey or (H, W, 3) RGB uint8, drawn side by side on two threads."""

    sensor = Sensor.STEREO_IMAGES

    def __init__(self, camera: StereoCamera, world: World, seed: int, exposure_lag: float | None = None) -> None:
        self.rate = camera.rate
        self._noise = camera.noise
        self._seed = seed
        self._scene = Scene(world, camera.color)
        self._pinhole = pinhole_of(camera)
        right = np.eye(4)
        right[1, 3] = -camera.baseline
        mount = camera.mount.matrix()
        self._T_base_cameras = (mount @ OPTICAL_IN_BODY, mount @ right @ OPTICAL_IN_BODY)
        self._beside = ThreadPoolExecutor(1, "right-eye")
        self._exposure = exposure_of(camera, exposure_lag)
        self._shutter = Shutter(camera)
        self._standing = WhileStanding[tuple[View, View]]()
        self.reset(0)

    @classmethod
    def fitted(cls, camera: StereoCamera, surroundings: Surroundings) -> Self:
        """As a robot carries it through a world."""
        wrong = surroundings.imperfections.stereo or CameraImperfections()
        return cls(camera, surroundings.world, surroundings.seed, wrong.exposure_lag)

    def reset(self, count: int) -> None:
        """Fresh noise after the count-th reset; automatic exposure starts anew."""
        self._streams = [stream(self._seed, f"stereo/{eye}/read_noise", count) for eye in ("left", "right")]
        self._exposure.reset()

    def measure(self, stamp: int, motion: Motion) -> StereoImages:
        """The pair whose last row is exposed, in no time, at `stamp`."""
        poses = self._shutter.poses(stamp, motion)
        keys = [next_key(one) for one in self._streams]

        def draw() -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
            left, right = self._standing.seen(poses, self.views)
            gain = self._exposure.gain(left.radiance_root)
            first, second = (
                develop(view.radiance_root, gain, self._noise, key)
                for view, key in zip((left, right), keys, strict=True)
            )
            return first, second

        pair = LaterStereoImages(stamp, draw)
        if self._exposure.follows:
            pair.work_out()  # it looks at every frame
        return pair

    def views(self, T_world_base: FloatArray) -> tuple[View, View]:
        """What left and right see, before exposure and noise, with the base at `T_world_base` (4, 4).

        (B, 4, 4): of bands of rows.
        """
        left, right = (T_world_base @ T_base_camera for T_base_camera in self._T_base_cameras)
        drawn_beside = self._beside.submit(self._scene.view, right, self._pinhole)
        return self._scene.view(left, self._pinhole), drawn_beside.result()
