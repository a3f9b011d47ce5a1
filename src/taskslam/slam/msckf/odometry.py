"""`StereoInertialOdometry`: IMU samples and rectified pairs in, a pose for every pair out.

What the papers leave open, or what is ours: a sample of the IMU holds since the one before it. A pair that shows too
little is no measurement (`settings.py`): the IMU goes on alone, and what was seen before is looked for in the next
pair, so that a wink costs nothing; what becomes of longer darkness, `vision/vigil.py` tells. Where the IMU is silent
for longer than `imu_gap` the robot is taken to go on as it went, after a second of silence to stand, and is lost
meanwhile. So it is where the filter refuses most of the landmarks: cameras and IMU then tell of different motions, as
they do with a wrong calibration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.geometry import OPTICAL_IN_BODY, FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, Measurement
from taskslam.robot import Imu, StereoCamera
from taskslam.slam.base import Status
from taskslam.slam.inertial.rotations import log_so3
from taskslam.slam.inertial.still_start import standstill
from taskslam.slam.msckf.filter import MultiStateFilter, Track
from taskslam.slam.msckf.front_end import FrontEnd, Seen
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import grey
from taskslam.slam.vision.vigil import Vigil

_SILENCE = NANOSECONDS
_FASTEST, _HARDEST = 100.0, 1000.0  # rad/s, m/s^2: what no sample says
_UPRIGHT = 0.7  # cosine of the angle between the two downs, of the IMU and of its mount
_LEAST_SIGHTINGS = 3  # of a landmark that the filter is told of
_FADING, _TOO_FEW = 0.9, 10.0  # of the count of landmarks, a pair; of less, a share says nothing


@dataclass(frozen=True, slots=True)
class Outcome:
    """T_world_camera: (4, 4), the world being the first left camera, optical axes."""

    T_world_camera: FloatArray
    status: Status


class StereoInertialOdometry:
    """The filter, the features, and what the IMU has said since the last pair.

    noisy: whether two pictures of the same thing must differ.
    """

    def __init__(self, settings: MsckfSettings, camera: StereoCamera, imu: Imu, noisy: bool = False) -> None:
        s = self._settings = settings
        self._imu, self._noisy = imu, noisy
        self._T_imu_camera = invert_se3(imu.mount.matrix()) @ camera.mount.matrix() @ OPTICAL_IN_BODY
        self._down_of_mount = -imu.mount.matrix()[2, :3]
        self._baseline = camera.baseline
        self.front_end = FrontEnd(s, Pinhole.of(camera))
        self.filter: MultiStateFilter | None = None
        self._vigil = Vigil(s.lost_after, s.reinit_after)
        self._tracks: dict[int, Track] = {}
        self._pair: tuple[npt.NDArray[np.uint8], ...] = ()
        self._T_kept = np.eye(4)  # of the camera in the filter's world, at the pair that the next is compared with
        self._now, self._last_stamp = 0, 0
        self._scale = 1.0
        self._told, self._believed = 0.0, 0.0  # landmarks, those of long ago counting less
        self._samples: list[tuple[int, FloatArray, FloatArray]] = []

    def hear(self, measurement: Measurement) -> None:
        """Keep samples until the pair that they belong to; those that cannot be, or come too late, are left out.

        Raises:
            InputError: the IMU says at rest that the robot does not stand upright; names the angle.
        """
        if not isinstance(measurement, ImuSamples):
            return
        for stamp, rate, force in zip(
            measurement.stamps.tolist(), measurement.angular_velocity, measurement.linear_acceleration, strict=True
        ):
            possible = (np.abs(rate) < _FASTEST).all() and (np.abs(force) < _HARDEST).all()  # and so finite
            if stamp > self._last_stamp and possible:
                self._last_stamp = stamp
                self._samples.append((stamp, np.array(rate, np.float64), np.array(force, np.float64)))
        if self.filter is None:
            self._try_to_begin()

    def process(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], stamp: int) -> Outcome:
        """Take in a pair of (H, W) or (H, W, 3) images, stamped in ns, after those before."""
        s, pair = self._settings, (np.array(grey(left), order="C"), np.array(grey(right), order="C"))
        before, self._pair = self._pair, pair
        if self.filter is None:
            return self._outcome(Status.STARTING)
        if stamp <= self._now:
            return self._outcome(Status.LOST if self.filter.window else Status.STARTING)
        heard = stamp - self._last_stamp <= s.imu_gap * NANOSECONDS
        self._carry(stamp)
        T_world_camera = self._T_world_camera()
        frozen = self._noisy and len(before) > 0 and all(map(np.array_equal, before, pair))
        seen = None if frozen else self.front_end.look(*pair, invert_se3(self._T_kept) @ T_world_camera)
        if seen is None or not self._fits(seen):
            if self._vigil.gives_up(stamp):
                self._forget()
            return self._outcome(self._vigil.misses(stamp), heard)
        anew = not len(self.front_end.features)
        self.front_end.keep(seen)
        self._T_kept = T_world_camera
        if anew:  # noise has features, too, but the next pair does not find them again
            return self._outcome(self._vigil.misses(stamp), heard)
        self._vigil.fits(stamp)
        self.filter.enter(stamp)
        self._note(stamp)
        self._told, self._believed = _FADING * self._told, _FADING * self._believed
        self._tell(self._ended())
        self._shrink(seen.share)
        if self._deviation() > s.position_std_threshold:
            self.filter.reset()
            self._forget()
            return self._outcome(Status.LOST)
        return self._outcome(Status.TRACKING, heard)

    def _T_world_camera(self) -> FloatArray:  # noqa: N802
        """(4, 4) in the filter's world, where it estimates the camera to be in the IMU."""
        assert self.filter is not None
        T: FloatArray = np.eye(4)
        T[:3, :3], T[:3, 3] = self.filter.R @ self.filter.R_ic, self.filter.p + self.filter.R @ self.filter.p_ic
        return T

    def _fits(self, seen: Seen) -> bool:
        s = self._settings
        count = seen.found if len(self.front_end.features) else len(seen.features)
        return seen.share >= s.least_share and count >= s.least_features and seen.cells >= s.least_cells

    def _forget(self) -> None:
        """Begin with new features where the IMU has it."""
        self.front_end.forget()
        self._tracks = {}

    def _deviation(self) -> float:
        """The largest standard deviation of the position, m."""
        assert self.filter is not None
        return float(np.sqrt(np.diag(self.filter.P)[3:6].max()))

    def _try_to_begin(self) -> None:
        """Take gravity and the gyro's bias from the last seconds, if the robot stood."""
        s = self._settings
        stamps = [stamp for stamp, _, _ in self._samples]
        if not stamps or stamps[-1] - stamps[0] + 1.5 * NANOSECONDS / self._imu.rate < s.still_start * NANOSECONDS:
            return
        rates, forces = (np.array([sample[k] for sample in self._samples]) for k in (1, 2))
        found = standstill(rates, forces, self._imu.gyro_noise, self._imu.accel_noise, s.gravity)
        if found is None:
            del self._samples[: len(stamps) // 2 + 1]
            return
        upright = float(found.gravity @ self._down_of_mount) / s.gravity
        if upright < _UPRIGHT:
            angle = np.degrees(np.arccos(max(-1.0, upright)))
            raise InputError(
                f"msckf: at rest the IMU measures gravity {angle:.0f} degrees away from where its mount in the robot's "
                f"rig has it; is it mounted as rig.imu.mount says?"
            )
        self.filter = MultiStateFilter(s, self._T_imu_camera, self._baseline, found.gravity, found.gyro_bias)
        self._scale, self._now = found.scale, stamps[-1]
        self._samples = []

    def _carry(self, end: int) -> None:
        """Take the state to `end`, ns; the samples up to it are used up."""
        assert self.filter is not None
        gap = self._settings.imu_gap * NANOSECONDS
        pieces = [sample for sample in self._samples if sample[0] <= end]
        later = self._samples[len(pieces) :]
        self._samples = later
        if not pieces or pieces[-1][0] < end:
            held = (pieces or later)[-1:] or [(end, self.filter.b_g, -self.filter.R.T @ self.filter.g / self._scale)]
            pieces.append((end, held[0][1], held[0][2]))
        for stamp, rate, force in pieces:
            took = stamp - self._now
            if took <= 0:
                continue
            self._now = stamp
            if took <= gap and stamp - self._last_stamp <= gap:
                self.filter.carry(rate, force * self._scale, took / NANOSECONDS)
                continue
            if took >= _SILENCE:
                self.filter.v = np.zeros(3)
            self.filter.coast(min(took, _SILENCE) / NANOSECONDS)

    def _note(self, stamp: int) -> None:
        """What is seen now, by landmark."""
        for name, seen in zip(self.front_end.features.ids.tolist(), self.front_end.normalised(), strict=True):
            track = self._tracks.setdefault(name, Track())
            track.stamps.append(stamp)
            track.seen.append(seen)

    def _ended(self) -> list[Track]:
        """Landmarks that are seen no longer."""
        live = set(self.front_end.features.ids.tolist())
        ended = [self._tracks.pop(name) for name in list(self._tracks) if name not in live]
        return [track for track in ended if len(track.stamps) >= _LEAST_SIGHTINGS]

    def _tell(self, tracks: list[Track]) -> None:
        assert self.filter is not None
        self._told += len(tracks)
        self._believed += self.filter.tell(tracks)

    def _shrink(self, share: float) -> None:
        """Where the window is full, two poses leave it, and what was seen from both is told before."""
        assert self.filter is not None
        if len(self.filter.window) < self._settings.max_cam_state_size:
            return
        gone = self._two_to_go(share)
        told = []
        for track in self._tracks.values():
            both = [n for n, stamp in enumerate(track.stamps) if stamp in gone]
            if len(both) == 2 and len(track.stamps) >= _LEAST_SIGHTINGS:
                told.append(Track([track.stamps[n] for n in both], [track.seen[n] for n in both]))
        self._tell(told)
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

    def planar_covariance(self) -> FloatArray:
        """(3, 3) over x, y, theta in the start frame; zeros before the beginning."""
        if self.filter is None:
            return np.zeros((3, 3))
        R_base_imu = self._imu.mount.matrix()[:3, :3]
        across = np.zeros((3, 6))
        across[:2, 3:] = R_base_imu[:2]
        across[2, :3] = (R_base_imu @ self.filter.R)[2]
        planar: FloatArray = across @ self.filter.P[:6, :6] @ across.T
        return planar

    def _outcome(self, status: Status, heard: bool = True) -> Outcome:
        """A pose that would be tracked is lost where the IMU was not heard, or tells of another motion."""
        agreed = self._believed >= self._settings.least_believed * self._told or self._told < _TOO_FEW
        if status is Status.TRACKING and not (heard and agreed):
            status = Status.LOST
        T = np.eye(4)
        if self.filter is not None:
            T[:3, :3], T[:3, 3] = self.filter.R, self.filter.p
        return Outcome(invert_se3(self._T_imu_camera) @ T @ self._T_imu_camera, status)
