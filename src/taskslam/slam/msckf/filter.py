"""The filter: a state of the IMU, a window of camera poses, and what both are told.

An error is (21 + 6 n,): the 15 of `inertial/propagation.py`, rotation and position of the left camera in the IMU, and
of each pose of the window its rotation (in the camera) and position (in the world).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import gammaincinv

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.inertial.propagation import move, transition
from taskslam.slam.inertial.rotations import exp_so3, hat
from taskslam.slam.msckf.observation import ROWS, derivatives, project_out, seen_from, triangulate
from taskslam.slam.msckf.settings import MsckfSettings
from taskslam.slam.vision.cholesky import solve_positive

IMU = 21
_AS_GIVEN = 1e-8  # variance of a pose that is the origin of the world
_UNKNOWN_TURN, _UNKNOWN_ACCELERATION = 1.0, 2.0  # rad/s, m/s^2: standard deviations while the IMU is silent


@dataclass
class CameraPose:
    """A pose of the window. R, p: in the world; R_first, p_first: as it entered, where it is linearised; stamp: ns."""

    stamp: int
    R: FloatArray
    p: FloatArray
    R_first: FloatArray
    p_first: FloatArray


@dataclass(frozen=True)
class Track:
    """A landmark's observations: stamps of poses, and (3,) each (`observation.py`)."""

    stamps: list[int] = field(default_factory=list)
    seen: list[FloatArray] = field(default_factory=list)


class MultiStateFilter:
    """Estimate and covariance; `carry` and `coast`, `enter`, `tell`, `leave`.

    T_imu_camera: (4, 4) left camera in the IMU. baseline: m. gravity: (3,) in the world, down. The world is where the
    IMU was at the beginning.
    """

    def __init__(
        self,
        settings: MsckfSettings,
        T_imu_camera: FloatArray,
        baseline: float,
        gravity: FloatArray,
        gyro_bias: FloatArray,
    ) -> None:
        s = self._settings = settings
        self.R, self.p, self.v = np.eye(3), np.zeros(3), np.zeros(3)
        self.b_g, self.b_a = gyro_bias.copy(), np.zeros(3)
        self.R_ic, self.p_ic = T_imu_camera[:3, :3].copy(), T_imu_camera[:3, 3].copy()
        self.g = gravity.copy()
        self._baseline = baseline
        self._deviations = np.array([s.gyro_noise, s.acc_noise, s.gyro_bias_noise, s.acc_bias_noise])
        self._gates = 2.0 * gammaincinv(np.arange(1, s.max_cam_state_size + 1) / 2.0, s.gate)  # chi squared
        self.reset()

    def reset(self) -> None:
        """As sure as at the beginning, with an empty window, of whatever is estimated now."""
        s = self._settings
        self.window: list[CameraPose] = []
        self._linear = (self.R, self.p, self.v)
        variances = (
            _AS_GIVEN,
            _AS_GIVEN,
            s.initial_covariance_velocity,
            s.initial_covariance_gyro_bias,
            s.initial_covariance_acc_bias,
            s.initial_covariance_extrinsic_rotation,
            s.initial_covariance_extrinsic_translation,
        )
        self.P = np.diag(np.repeat(variances, 3))

    def carry(self, rate: FloatArray, force: FloatArray, dt: float) -> None:
        """Over one sample of the IMU, (3,) rad/s and (3,) m/s^2, of dt seconds."""
        self._move(rate - self.b_g, force - self.b_a, dt, self._deviations)

    def coast(self, dt: float) -> None:
        """Over dt seconds of which the IMU says nothing: straight on, and as unsure as a robot may move."""
        unsure = np.array([_UNKNOWN_TURN, _UNKNOWN_ACCELERATION, *self._deviations[2:]])
        self._move(np.zeros(3), -self.R.T @ self.g, dt, unsure)

    def _move(self, rate: FloatArray, force: FloatArray, dt: float, deviations: FloatArray) -> None:
        F = transition(self.R, rate, force, dt)
        moved = move(self.R, self.p, self.v, rate, force, self.g, dt)
        if self._settings.observability_constraints:
            F = constrained(F, *self._linear, *moved, self.g, dt)
        self.R, self.p, self.v = moved
        self._linear = moved
        per_root_s = deviations**2 * np.array([dt * dt, dt * dt, dt, dt])
        variances = np.concatenate([np.full(3, per_root_s[0]), np.zeros(3), np.repeat(per_root_s[1:], 3)])
        self.P[:15, :15] = F @ self.P[:15, :15] @ F.T + np.diag(variances)
        self.P[:15, 15:] = F @ self.P[:15, 15:]
        self.P[15:, :15] = self.P[:15, 15:].T

    def enter(self, stamp: int) -> None:
        """The camera's present pose becomes one of the window (Mourikis, eq. (14) to (16))."""
        R, p = self.R @ self.R_ic, self.p + self.R @ self.p_ic
        J = np.zeros((6, len(self.P)))
        J[:3, :3], J[:3, 15:18] = self.R_ic.T, np.eye(3)
        J[3:, :3], J[3:, 3:6], J[3:, 18:21] = -self.R @ hat(self.p_ic), np.eye(3), self.R
        cross = J @ self.P
        self.P = np.block([[self.P, cross.T], [cross, J @ cross.T]])
        self.window.append(CameraPose(stamp, R, p, R, p))

    def leave(self, stamps: Sequence[int]) -> None:
        """These poses leave the window."""
        gone = [n for n, pose in enumerate(self.window) if pose.stamp in stamps]
        rows = [IMU + 6 * n + k for n in gone for k in range(6)]
        self.P = np.delete(np.delete(self.P, rows, axis=0), rows, axis=1)
        self.window = [pose for pose in self.window if pose.stamp not in stamps]

    def tell(self, tracks: Sequence[Track]) -> int:
        """Update with what landmarks looked like from poses of the window; returns how many were believed."""
        if not tracks:
            return 0
        index = {pose.stamp: n for n, pose in enumerate(self.window)}
        H, r, believed = rows_of(
            np.array([pose.R for pose in self.window]),
            np.array([pose.p for pose in self.window]),
            np.array([pose.R_first for pose in self.window]),
            np.array([pose.p_first for pose in self.window]),
            np.cumsum([0, *(len(track.stamps) for track in tracks)]),
            np.array([index[stamp] for track in tracks for stamp in track.stamps]),
            np.array([seen for track in tracks for seen in track.seen]),
            self._baseline,
            self.g,
            self.P,
            self._settings.observability_constraints,
            self._settings.feature_noise**2,
            self._gates,
            self._settings.most_rows,
        )
        if believed:
            self._update(H, r)
        return int(believed)

    def _update(self, H: FloatArray, r: FloatArray) -> None:
        """In the form whose matrices have the size of the state: P' = P - P A (1 + P A)^-1 P, A = H^T H / variance."""
        variance = self._settings.feature_noise**2
        used = np.flatnonzero(np.any(H != 0.0, axis=0))
        H = H[:, used]
        A, b = H.T @ H / variance, H.T @ r / variance
        across = self.P[:, used]
        kept = np.linalg.solve(np.eye(len(used)) + self.P[np.ix_(used, used)] @ A, across.T)  # of P', these rows
        P = self.P - across @ A @ kept
        self.P = 0.5 * (P + P.T)
        self._correct(kept.T @ b)

    def _correct(self, d: FloatArray) -> None:
        self.R, self.p, self.v = self.R @ exp_so3(d[:3]), self.p + d[3:6], self.v + d[6:9]
        self.b_g, self.b_a = self.b_g + d[9:12], self.b_a + d[12:15]
        self.R_ic, self.p_ic = self.R_ic @ exp_so3(d[15:18]), self.p_ic + d[18:21]
        for n, pose in enumerate(self.window):
            part = d[IMU + 6 * n : IMU + 6 * n + 6]
            pose.R, pose.p = pose.R @ exp_so3(part[:3]), pose.p + part[3:]


@njit(cache=True)
def constrained(F, R, p, v, R_next, p_next, v_next, g, dt):  # type: ignore[no-untyped-def]
    """The transition changed least so that a turn about gravity stays unseen (Hesch et al., Sec. IV).

    R, p, v: where the state was predicted to be before, and R_next... where it is now. Unseen directions: translations,
    and the turn N = [R^T g; g x p; g x v] whose image under the transition must be that of the next state.
    """
    out = F.copy()
    out[0:3, 0:3] = R_next.T @ R
    u = R.T @ g
    square = u @ u
    for first, wanted in ((6, hat(g) @ (v_next - v)), (3, hat(g) @ (p_next - p - dt * v))):
        A = np.ascontiguousarray(F[first : first + 3, 0:3])
        miss = A @ u - wanted
        for a in range(3):
            for b in range(3):
                out[first + a, b] = A[a, b] - miss[a] * u[b] / square
    return out


@njit(cache=True)
def free_rows(R, p, R0, p0, at, seen, landmark, baseline, g, constrain):  # type: ignore[no-untyped-def]
    """Rows that say nothing of the landmark: H (3 M - 3, 6 W), r (3 M - 3,), W being the poses of the window.

    at: (M,) the poses that saw it. R0, p0: where the poses are linearised if the directions that nobody can see are to
    stay unseen: the rows are then changed least so that a turn of all about gravity shows nothing (Hesch et al.).
    """
    count = len(at)
    H, H_f, r = np.zeros((ROWS * count, 6 * len(R))), np.empty((ROWS * count, 3)), np.empty(ROWS * count)
    for m in range(count):
        n = at[m]
        by_pose, by_landmark = derivatives(R[n], p[n], landmark, baseline)
        if constrain:
            u = np.empty(6)
            u[:3] = R0[n].T @ g
            u[3:] = hat(g) @ (p0[n] - landmark)
            by_pose = by_pose - np.outer(by_pose @ u, u) / (u @ u)
            by_landmark = -np.ascontiguousarray(by_pose[:, 3:])
        row = ROWS * m
        H[row : row + ROWS, 6 * n : 6 * n + 6] = by_pose
        H_f[row : row + ROWS] = by_landmark
        r[row : row + ROWS] = seen[m] - seen_from(R[n], p[n], landmark, baseline)
    project_out(H_f, H, r)
    return H[3:], r[3:]


@njit(cache=True)
def rows_of(  # type: ignore[no-untyped-def]
    R, p, R0, p0, starts, at, seen, baseline, g, P, constrain, variance, gates, most_rows
):
    """What landmarks say of the state: H (K, len(P)), r (K,), and how many passed the gate.

    starts: (T + 1,) where each landmark's observations begin in at, (M,) poses of the window, and seen, (M, 3). gates:
    the greatest Mahalanobis distance squared by the number of poses that saw a landmark, less two.
    """
    H, r, rows, believed = np.zeros((most_rows + ROWS * len(R), len(P))), np.empty(most_rows + ROWS * len(R)), 0, 0
    for t in range(len(starts) - 1):
        poses, observed = at[starts[t] : starts[t + 1]], seen[starts[t] : starts[t + 1]]
        if len(poses) < 2 or rows > most_rows:
            continue
        landmark, good = triangulate(R[poses], p[poses], observed, baseline)
        if not good:
            continue
        first, last = np.min(poses), np.max(poses) + 1
        some, left = free_rows(
            R[first:last],
            p[first:last],
            R0[first:last],
            p0[first:last],
            poses - first,
            observed,
            landmark,
            baseline,
            g,
            constrain,
        )
        begin, end = IMU + 6 * first, IMU + 6 * last
        some = np.ascontiguousarray(some)
        S = some @ np.ascontiguousarray(P[begin:end, begin:end]) @ some.T
        for k in range(len(S)):
            S[k, k] += variance
        weighed, positive = solve_positive(S, left)
        if not positive or left @ weighed > gates[len(poses) - 2]:
            continue
        H[rows : rows + len(left), begin:end] = some
        r[rows : rows + len(left)] = left
        rows += len(left)
        believed += 1
    return H[:rows], r[:rows], believed
