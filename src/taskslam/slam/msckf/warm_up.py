"""Compiling before the first pair."""

from __future__ import annotations

import numpy as np

from taskslam.geometry import invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples
from taskslam.robot import Imu, StereoCamera
from taskslam.slam.msckf.odometry import StereoInertialOdometry
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.vision.made_up_drive import PINHOLE, SIDE, made_up_drive


def warm_up(settings: MsckfSettings, camera: StereoCamera, imu: Imu) -> None:
    """Stand, follow a made-up drive, and forget it: no real pair waits for compilation."""
    fov = 2.0 * np.arctan(0.5 * SIDE / PINHOLE.f)
    small = {"width": SIDE, "height": SIDE, "horizontal_fov": float(fov), "baseline": PINHOLE.baseline}
    changed = {"max_cam_state_size": 5, "least_share": 0.0, "still_start": 0.1}
    odometry = StereoInertialOdometry(settings.model_copy(update=changed), camera.model_copy(update=small), imu)
    up = invert_se3(imu.mount.matrix())[:3, 2] * settings.gravity
    period, count = round(NANOSECONDS / imu.rate), round(imu.rate)
    stamps = period * np.arange(1, count + 1, dtype=np.int64)
    still = np.zeros((count, 3))
    odometry.hear(ImuSamples(int(stamps[-1]), stamps, still, np.tile(up, (count, 1))))
    for left, right, stamp in made_up_drive(12):
        now = int(stamps[-1]) + period + stamp
        odometry.hear(ImuSamples(now, np.array([now]), still[:1], up[None]))
        odometry.process(left, right, now)
