"""`msckf`: stereo visual-inertial odometry, an independent implementation of S-MSCKF, Sun et al., RA-L 2018.

Ke Sun, Kartik Mohta, Bernd Pfrommer, Michael Watterson, Sikang Liu, Yash Mulgaonkar, Camillo J. Taylor and Vijay Kumar,
"Robust Stereo Visual Inertial Odometry for Fast Autonomous Flight", IEEE RA-L 3(2), 2018 (arXiv 1712.00036); the filter
is that of Mourikis and Roumeliotis, ICRA 2007, its observability constraints those of Hesch, Kottas, Bowman and
Roumeliotis, 2012. Written from the papers, with the constants of the benchmark's runs (`slam/msckf/settings.py`).

The IMU carries position, velocity and biases from pair to pair; each pair's pose joins a window of twenty. Corners are
followed through the pairs, and when one is lost, all that was seen of it binds the poses that saw it together: the
landmark itself is never part of the state (`slam/msckf/odometry.py`). The linearisation is changed least so that a turn
of everything about gravity, which nobody can see, stays unseen. Odometry: no map, no loop closure.

Where it differs from the authors' program, and why:

- The pair is rectified and gives three numbers a landmark and not four (`slam/msckf/observation.py`).
- A feature must look alike in both pictures (`least_correlation`): noise on a bare wall has corners, too.
- It says when it is lost (`slam/vision/vigil.py`), also where the IMU is silent. The original never does.
- Pictures that repeat those before, byte for byte, though they are noisy, are no measurement.
- The noise of the IMU is taken as that of a sample, as the robot's data sheet has it, not as a density.
- An IMU that does not stand upright at the start as its mount says is refused in a sentence.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from taskslam.geometry import FloatArray
from taskslam.measurements import Measurement, Sensor
from taskslam.robot import SensorRig, StereoCamera
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate
from taskslam.slam.methods.stereo_method import StereoMethod, StereoTracker
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.needs import need_imu
from taskslam.slam.option_settings import read_options


class Msckf(StereoMethod):
    """Stereo visual-inertial odometry. Options: the fields of `MsckfSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="msckf",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.STEREO_IMAGES, Sensor.IMU),
        summary="independent implementation of stereo MSCKF (Sun et al., RA-L 2018): visual-inertial odometry",
        needs_still_start=2.5,
        map_mode=MapMode.NONE,
        deterministic=True,
        latency=0.015,
        queue=1,
        homepage="https://arxiv.org/abs/1712.00036",
        extra="msckf",
    )

    def __init__(self, **options: object) -> None:
        self._settings = read_options(MsckfSettings, "msckf", options)
        self.levels = self._settings.pyramid_levels + 1

    def start(self, rig: SensorRig) -> None:
        """Begin. Raises InputError: no stereo camera or no IMU, or pictures too small for the pyramid."""
        self._imu = need_imu("msckf", rig)
        super().start(rig)

    def make_tracker(self, camera: StereoCamera, R_camera_imu: FloatArray | None) -> StereoTracker:  # noqa: ARG002
        """Compiled by a made-up drive."""
        from taskslam.slam.msckf.odometry import StereoInertialOdometry  # numba comes with it: not to read a card
        from taskslam.slam.msckf.warm_up import warm_up

        warm_up(self._settings, camera, self._imu)
        self._odometry = StereoInertialOdometry(self._settings, camera, self._imu, noisy=camera.noise > 0)
        return self._odometry

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every pair, with its covariance; None for the IMU."""
        estimate = super().feed(measurement)
        return None if estimate is None else replace(estimate, covariance=self._odometry.planar_covariance())
