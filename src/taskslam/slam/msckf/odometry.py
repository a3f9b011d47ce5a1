"""`StereoInertialOdometry`: IMU samples and rectified pairs in, a pose for every pair out."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, StereoImages
from taskslam.robot import Imu, StereoCamera
from taskslam.slam.base import Status
from taskslam.slam.inertial.rotations import log_so3
from taskslam.slam.inertial.still_start import standstill
from taskslam.slam.msckf.filter import Msckf, Track
from taskslam.slam.msckf.front_end import FrontEnd, Image
from taskslam.slam.msckf.settings import MsckfSettings

_GAP = NANOSECONDS // 10
_FEWEST, _LOST_AFTER = 10, NANOSECONDS // 2
_UPRIGHT = 0.7


@dataclass(frozen=True, slots=True)
class Outcome:
    """T_world_imu: (4, 4). covariance: (6, 6) of rotation in the IMU frame and position in the world."""

    T_world_imu: FloatArray
    status: Status
    covariance: FloatArray


class StereoInertialOdometry:
    """The filter, the features, and what the IMU has said since the last pair."""

    def __init__(self, settings: MsckfSettings, camera: StereoCamera, imu: Imu) -> None:
        self._settings, self._imu = settings, imu
        self._T_imu_camera = invert_se3(imu.mount.matrix()) @ camera.mount.matrix() @ OPTICAL_IN_BODY
        self._down_of_mount = -imu.mount.matrix()[2, :3]
        self._baseline = camera.baseline
        self.front_end = FrontEnd(settings, camera.focal_length, camera.center)
        self.filter: Msckf | None = None
        self._tracks: dict[int, Track] = {}
        self._now, self._last_stamp, self._good_until = 0, 0, 0
        self._scale = 1.0
        self._last = np.zeros(3), np.zeros(3)
        self._samples: list[tuple[int, FloatArray, FloatArray]] = []

    def add(self, samples: ImuSamples) -> None:
        """Keep samples until the pair that they belong to; those that are not finite or come too late are left out."""
        for stamp, rate, force in zip(
            samples.stamps.tolist(), samples.angular_velocity, samples.linear_acceleration, strict=True
        ):
            if stamp > self._last_stamp and np.isfinite(rate).all() and np.isfinite(force).all():
                self._last_stamp = stamp
                self._samples.append((stamp, np.array(rate, np.float64), np.array(force, np.float64)))
        if self.filter is None:
            self._try_to_begin()

    def process(self, pair: StereoImages) -> Outcome:
        """The pose at the pair's stamp. Raises InputError: the IMU does not stand upright at the start."""
        if self.filter is None or (pair.stamp <= self._now and not self.filter.window):
            return self._outcome(Status.STARTING)
        if pair.stamp <= self._now:
            return self._outcome(Status.LOST)
        heard = pair.stamp - self._last_stamp <= _GAP
        R_before_now = self._carry(pair.stamp)
        self.filter.enter(pair.stamp)
        share = self.front_end.observe(_grey(pair.left), _grey(pair.right), R_before_now)
        believed = self._tell(pair.stamp)
        self._shrink(share)
        if len(self.front_end.features) >= _FEWEST and (believed or share > 0.5):
            self._good_until = pair.stamp
        deviation = np.sqrt(np.diag(self.filter.P)[3:6]).max()
        lost = pair.stamp - self._good_until > _LOST_AFTER or deviation > self._settings.position_std_threshold
        return self._outcome(Status.LOST if lost or not heard else Status.TRACKING)

    def _try_to_begin(self) -> None:
        s = self._settings
        stamps = [stamp for stamp, _, _ in self._samples]
        if not stamps or stamps[-1] - stamps[0] + 1.5e9 / self._imu.rate < s.still_start * NANOSECONDS:
            return
        rates, forces = (np.array([sample[k] for sample in self._samples]) for k in (1, 2))
        found = standstill(rates, forces, self._imu.gyro_noise, self._imu.accel_noise, s.gravity)
        if found is None:
            del self._samples[: len(stamps) // 2 + 1]
            return
        if found.gravity @ self._down_of_mount < _UPRIGHT * s.gravity:
            raise InputError("msckf: at rest the IMU does not stand upright as its mount in the robot's rig says")
        initial = np.repeat(
            [
                1e-8,
                1e-8,
                s.initial_covariance_velocity,
                s.initial_covariance_gyro_bias,
                s.initial_covariance_acc_bias,
                s.initial_covariance_extrinsic_rotation,
                s.initial_covariance_extrinsic_translation,
            ],
            3,
        )
        noise = np.array([s.gyro_noise, s.acc_noise, s.gyro_bias_noise, s.acc_bias_noise])
        self.filter = Msckf(
            self._T_imu_camera,
            self._baseline,
            found.gravity,
            found.gyro_bias,
            initial,
            noise,
            s.feature_noise,
            s.gate,
            s.observability_constraints,
            s.most_rows,
        )
        self._scale, self._now, self._good_until = found.scale, stamps[-1], stamps[-1]
        self._last = found.gyro_bias, -found.gravity
        self._samples = []

    def _carry(self, end: int) -> FloatArray:
        """Take the state to `end` (ns); returns the rotation of the left camera meanwhile."""
        assert self.filter is not None
        R = self.filter.R
        pieces = [sample for sample in self._samples if sample[0] <= end]
        self._samples = self._samples[len(pieces) :]
        if not pieces or pieces[-1][0] < end:
            rate, force = (pieces[-1][1], pieces[-1][2] * self._scale) if pieces else self._last
            pieces.append((end, rate, force / self._scale))
        for stamp, rate, force in pieces:
            dt = (stamp - self._now) / NANOSECONDS
            if dt > 0.0:
                self.filter.carry(rate, force * self._scale, dt)
                self._last, self._now = (rate, force * self._scale), stamp
        turned: FloatArray = self.filter.R_ic.T @ R.T @ self.filter.R @ self.filter.R_ic
        return turned

    def _tell(self, stamp: int) -> int:
        """Note what is seen now; tell the filter of landmarks that are seen no longer."""
        assert self.filter is not None
        for name, seen in zip(self.front_end.features.ids.tolist(), self.front_end.normalised(), strict=True):
            track = self._tracks.setdefault(name, Track())
            track.stamps.append(stamp)
            track.seen.append(seen)
        live = set(self.front_end.features.ids.tolist())
        ended = [name for name in self._tracks if name not in live]
        told = [self._tracks.pop(name) for name in ended]
        return self.filter.tell([track for track in told if len(track.stamps) >= 3])

    def _shrink(self, share: float) -> None:
        """Where the window is full, two poses leave it, and what was seen from both is told before."""
        assert self.filter is not None
        if len(self.filter.window) < self._settings.max_cam_state_size:
            return
        gone = self._two_to_go(share)
        told = []
        for track in self._tracks.values():
            both = [n for n, stamp in enumerate(track.stamps) if stamp in gone]
            if len(both) == 2 and len(track.stamps) >= 3:
                told.append(Track([track.stamps[n] for n in both], [track.seen[n] for n in both]))
        self.filter.tell(told)
        for track in self._tracks.values():
            for n in reversed([n for n, stamp in enumerate(track.stamps) if stamp in gone]):
                del track.stamps[n], track.seen[n]
        self.filter.leave(gone)

    def _two_to_go(self, share: float) -> list[int]:
        """Of the latest poses those that are no keyframes, else the oldest (Sun et al., Sec. III-C)."""
        assert self.filter is not None
        s, window = self._settings, self.filter.window
        key, gone, latest, oldest = window[-4], [], len(window) - 3, 0
        for _ in range(2):
            pose = window[latest]
            turn = float(np.linalg.norm(log_so3(key.R.T @ pose.R)))
            near = float(np.linalg.norm(pose.p - key.p)) < s.translation_threshold and turn < s.rotation_threshold
            if near and share > s.tracking_rate_threshold:
                gone.append(pose.stamp)
                latest += 1
            else:
                gone.append(window[oldest].stamp)
                oldest += 1
                latest -= 1
        return sorted(set(gone))

    def _outcome(self, status: Status) -> Outcome:
        T = np.eye(4)
        if self.filter is None:
            return Outcome(T, status, np.zeros((6, 6)))
        T[:3, :3], T[:3, 3] = self.filter.R, self.filter.p
        return Outcome(T, status, self.filter.P[:6, :6].copy())


def _grey(image: Image) -> Image:
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image
    return np.ascontiguousarray(grey, np.uint8)


def warm_up(settings: MsckfSettings, camera: StereoCamera) -> None:
    """Run the compiled parts once, so that no pair waits for compilation."""
    down = np.array([0.0, 0.0, -settings.gravity])
    noise = np.full(4, 1e-3)
    filter_ = Msckf(np.eye(4), camera.baseline, down, np.zeros(3), np.full(21, 1e-4), noise, 0.01, 0.5, True, 100)
    for k in range(4):
        filter_.carry(np.full(3, 0.01), np.array([0.5, 0.2, settings.gravity]), 0.1)
        filter_.enter(k)
    seen = np.array([0.1, 0.1, 0.1 - 0.5 * camera.baseline])
    filter_.tell([Track([0, 1, 2, 3], [seen] * 4)])
