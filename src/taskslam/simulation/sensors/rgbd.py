"""The RGB-D camera: an image, and the depth of its pixels from the same pass of the rasterizer.

Depth comes from matching a stereo pair, so its noise is that of a disparity: sigma_z = z^2 sigma_d / (f B), sigma_d the
disparity's noise in pixels, f the focal length in pixels and B the baseline of the pair (Grunnet-Jepsen, Sweetser and
Woodfill, "Tuning depth cameras for best performance", Intel RealSense). Every pixel draws alone. What a real one also
has is left out: holes on what has no texture or lies in the shadow of one of the pair, and edges that fly.
"""

from __future__ import annotations

from typing import Self

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray
from taskslam.measurements import RgbdImages, Sensor
from taskslam.robot.imperfections import CameraImperfections
from taskslam.robot.rgbd import RgbdCamera
from taskslam.simulation.motion import Motion
from taskslam.simulation.rendering.scene import Scene, View, depth_image
from taskslam.simulation.sensors.camera import pinhole_of
from taskslam.simulation.sensors.counted_noise import next_key, standard_normal
from taskslam.simulation.sensors.exposure import exposure_of
from taskslam.simulation.sensors.later import LaterRgbdImages, WhileStanding
from taskslam.simulation.sensors.read_noise import develop
from taskslam.simulation.sensors.shutter import Shutter
from taskslam.simulation.sensors.simulated_sensor import Surroundings
from taskslam.simulation.streams import stream
from taskslam.world import World


class RgbdCameraSensor:
    """Image and depth of one instant."""

    sensor = Sensor.RGBD_IMAGES

    def __init__(self, camera: RgbdCamera, world: World, seed: int, exposure_lag: float | None = None) -> None:
        self.rate = camera.rate
        self._camera = camera
        self._seed = seed
        self._scene = Scene(world, camera.color)
        self._pinhole = pinhole_of(camera)
        self._T_base_camera = camera.mount.matrix() @ OPTICAL_IN_BODY
        self._exposure = exposure_of(camera, exposure_lag)
        self._shutter = Shutter(camera)
        self._standing = WhileStanding[View]()
        self.reset(0)

    @classmethod
    def fitted(cls, camera: RgbdCamera, surroundings: Surroundings) -> Self:
        """As a robot carries it through a world."""
        wrong = surroundings.imperfections.rgbd or CameraImperfections()
        return cls(camera, surroundings.world, surroundings.seed, wrong.exposure_lag)

    def reset(self, count: int) -> None:
        """Fresh noise after the count-th reset; automatic exposure starts anew."""
        self._read_noise = stream(self._seed, "rgbd/read_noise", count)
        self._depth_noise = stream(self._seed, "rgbd/depth_noise", count)
        self._exposure.reset()

    def measure(self, stamp: int, motion: Motion) -> RgbdImages:
        """The frame whose last row is exposed, in no time, at `stamp`."""
        poses = self._shutter.poses(stamp, motion)
        read_key, depth_key = next_key(self._read_noise), next_key(self._depth_noise)

        def draw() -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
            view = self._standing.seen(poses, self.view)
            gain = self._exposure.gain(view.radiance_root)
            image = develop(view.radiance_root, gain, self._camera.noise, read_key)
            true = depth_image(view)
            return image, measured_depth(true, standard_normal(depth_key, true.shape), self._camera)

        frame = LaterRgbdImages(stamp, draw)
        if self._exposure.follows:
            frame.work_out()  # it looks at every frame
        return frame

    def view(self, T_world_base: FloatArray) -> View:
        """What it sees, before exposure and noise, with the base at `T_world_base` (4, 4).

        (B, 4, 4): of bands of rows.
        """
        return self._scene.view(T_world_base @ self._T_base_camera, self._pinhole)


def measured_depth(
    true: npt.NDArray[np.float32], draws: npt.NDArray[np.float32], camera: RgbdCamera
) -> npt.NDArray[np.float32]:
    """(H, W) float32 m from true depths (0: none) and standard normal draws; 0 for what lies outside the limits."""
    numbers = camera.depth_noise, camera.depth_resolution, camera.depth_min, camera.depth_max
    flat: npt.NDArray[np.float32] = _measured(true.ravel(), draws.ravel(), *numbers)
    return flat.reshape(true.shape)


@njit(cache=True)
def _measured(true, draws, noise, resolution, depth_min, depth_max):  # type: ignore[no-untyped-def]
    out = np.zeros(len(true), np.float32)
    for i in range(len(true)):
        if not depth_min <= true[i] <= depth_max:
            continue
        reading = true[i] + noise * true[i] * true[i] * draws[i]
        if resolution > 0.0:
            reading = round(reading / resolution) * resolution
        if depth_min <= reading <= depth_max:
            out[i] = reading
    return out
