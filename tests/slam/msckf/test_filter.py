"""The filter on made-up landmarks: what it knows, what it must not know, and its algebra."""

import gtsam
import numpy as np
import pytest

from taskslam.geometry import OPTICAL_IN_BODY
from taskslam.slam.inertial.propagation import move, transition
from taskslam.slam.inertial.rotations import exp_so3, hat
from taskslam.slam.msckf.filter import IMU, MultiStateFilter, Track, constrained, free_rows
from taskslam.slam.msckf.observation import seen_from
from taskslam.slam.msckf.settings import MsckfSettings

G = np.array([0.0, 0.0, -9.81])
BASELINE = 0.11
NOISE = np.array([0.002, 0.03, 1e-5, 1e-4])
FEATURE_NOISE = 0.003
RATE, RADIUS = 0.3, 2.0
YAW = 0.05


def camera():
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = OPTICAL_IN_BODY[:3, :3], [0.1, 0.0, 0.2]
    return T


def a_filter(constrain=True, yaw=YAW):
    settings = MsckfSettings(
        **dict(zip(("gyro_noise", "acc_noise", "gyro_bias_noise", "acc_bias_noise"), NOISE.tolist(), strict=True)),
        feature_noise=FEATURE_NOISE,
        gate=0.95,
        observability_constraints=constrain,
    )
    filter_ = MultiStateFilter(settings, camera(), BASELINE, G, np.zeros(3))
    initial = np.array([1e-8, 1e-8, yaw**2] + [1e-8] * 3 + [1.0] * 3 + [1e-6] * 3 + [1e-4] * 3 + [1e-8] * 6)
    filter_.P = np.diag(initial)
    return filter_


def on_the_circle(t):
    a = RATE * t
    place = np.array([RADIUS * np.sin(a), RADIUS * (1 - np.cos(a)), 0.0])
    return exp_so3(np.array([0.0, 0.0, a])), place, RADIUS * RATE * np.array([np.cos(a), np.sin(a), 0.0])


def driven(constrain, seconds=12, seed=0):
    """Standard deviations of yaw at 10 Hz and the last error of the position, round a circle among landmarks."""
    dice, filter_ = np.random.default_rng(seed), a_filter(constrain)
    start = exp_so3(np.array([0.0, 0.0, 0.5 * YAW]))  # the world's yaw is the filter's own: it begins 0.5 sigma off
    filter_.R, filter_.v = start, start @ on_the_circle(0.0)[2]
    filter_._linear = filter_.R, filter_.p, filter_.v
    landmarks = dice.uniform([-8, -6, -2], [8, 10, 3], (1500, 3))
    landmarks = landmarks[np.hypot(landmarks[:, 0], landmarks[:, 1] - RADIUS) > 3.2]
    tracks, deviations, up, T_imu_camera = {}, [], np.array([0.0, 0.0, 1.0]), camera()
    rate, force = np.array([0.0, 0.0, RATE]), np.array([0.0, RADIUS * RATE**2, 9.81])
    for k in range(1, seconds * 100 + 1):
        filter_.carry(rate + NOISE[0] * dice.normal(size=3), force + NOISE[1] * dice.normal(size=3), 0.01)
        if k % 10:
            continue
        R, p, _ = on_the_circle(k * 0.01)
        filter_.enter(k)
        R, p = R @ T_imu_camera[:3, :3], p + R @ T_imu_camera[:3, 3]
        near = np.flatnonzero(np.linalg.norm(landmarks - p, axis=1) < 6)
        live = set()
        for n in near.tolist():
            seen = seen_from(R, p, landmarks[n], BASELINE)
            track = tracks.setdefault(n, Track())
            if len(live) < 60 and abs(seen[0]) < 1 and abs(seen[1]) < 0.6 and len(track.stamps) < 12:
                live.add(n)
                track.stamps.append(k)
                track.seen.append(seen + FEATURE_NOISE * dice.normal(size=3))
        ended = [tracks.pop(n) for n in list(tracks) if n not in live]
        filter_.tell([track for track in ended if len(track.stamps) >= 3])
        if len(filter_.window) >= 20:
            oldest = filter_.window[0].stamp
            for track in tracks.values():
                if track.stamps[0] == oldest:
                    del track.stamps[0], track.seen[0]
            filter_.leave([oldest])
        axis = filter_.R.T @ up
        deviations.append(np.sqrt(axis @ filter_.P[:3, :3] @ axis))
    assert np.linalg.eigvalsh(filter_.P).min() > -1e-9
    return np.array(deviations), np.linalg.norm(start.T @ filter_.p - on_the_circle(seconds)[1])


def test_with_the_constraints_yaw_is_never_surer_than_at_the_start() -> None:
    deviations, error = driven(True)
    assert deviations.min() > 0.995 * YAW
    assert error < 0.2


def test_without_them_it_gains_what_nobody_has_seen() -> None:
    deviations, _ = driven(False)
    assert deviations[-1] < 0.95 * YAW


def test_the_constrained_transition_keeps_the_unseen_turn_unseen() -> None:
    R, p, v = exp_so3(np.array([0.1, -0.2, 0.7])), np.array([1.0, 2.0, 0.5]), np.array([0.5, 0.1, 0.0])
    rate, force, dt = np.array([0.1, 0.2, 0.8]), np.array([0.5, 0.1, 9.9]), 0.01
    after = move(R, p, v, rate, force, G, dt)
    elsewhere = (R @ exp_so3(np.array([0.01, 0.02, -0.01])), p + 0.01, v - 0.02)  # predicted before an update
    F = constrained(transition(R, rate, force, dt), *elsewhere, *after, G, dt)

    def turn(R, p, v):
        return np.concatenate([R.T @ G, hat(G) @ p, hat(G) @ v, np.zeros(6)])

    np.testing.assert_allclose(F @ turn(*elsewhere), turn(*after), atol=1e-9)
    assert np.abs(transition(R, rate, force, dt) @ turn(*elsewhere) - turn(*after)).max() > 1e-4


def test_rows_show_nothing_of_a_turn_of_all_about_gravity() -> None:
    dice = np.random.default_rng(1)
    R0 = np.array([exp_so3(0.1 * dice.normal(size=3)) for _ in range(4)])
    p0 = 0.2 * dice.normal(size=(4, 3))
    R = np.array([one @ exp_so3(0.01 * dice.normal(size=3)) for one in R0])
    p = p0 + 0.01 * dice.normal(size=(4, 3))
    landmark = np.array([0.3, -0.2, 4.0])
    seen = np.array([seen_from(a, b, landmark, BASELINE) for a, b in zip(R, p, strict=True)])
    turn = np.concatenate([np.concatenate([a.T @ G, hat(G) @ b]) for a, b in zip(R0, p0, strict=True)])
    H, r = free_rows(R, p, R0, p0, np.arange(4), seen, landmark, BASELINE, G, True)
    np.testing.assert_allclose(r, 0.0, atol=1e-12)
    np.testing.assert_allclose(H @ turn, 0.0, atol=1e-9)
    plain = free_rows(R, p, R0, p0, np.arange(4), seen, landmark, BASELINE, G, False)[0]
    assert np.abs(plain @ turn).max() > 1e-3


def test_an_update_equals_the_textbooks() -> None:
    filter_, dice = a_filter(), np.random.default_rng(2)
    for k in range(3):
        filter_.carry(np.array([0.1, 0.0, 0.3]), np.array([0.1, 0.2, 9.8]), 0.1)
        filter_.enter(k)
    size = len(filter_.P)
    H, r = np.zeros((30, size)), 0.01 * dice.normal(size=30)
    H[:, IMU:] = dice.normal(size=(30, size - IMU))
    P, p = filter_.P.copy(), filter_.p.copy()
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + FEATURE_NOISE**2 * np.eye(30))
    filter_._update(H, r)
    np.testing.assert_allclose(filter_.P, (np.eye(size) - K @ H) @ P, atol=1e-9)
    np.testing.assert_allclose(filter_.p - p, (K @ r)[3:6], atol=1e-10)


def test_a_pose_enters_with_the_imus_errors_and_leaves_without_trace() -> None:
    filter_ = a_filter()
    filter_.carry(np.array([0.1, 0.0, 0.3]), np.array([0.1, 0.2, 9.8]), 0.1)
    before = filter_.P.copy()
    filter_.enter(7)
    pose = filter_.window[0]
    np.testing.assert_allclose(pose.R, filter_.R @ camera()[:3, :3], atol=1e-15)
    np.testing.assert_allclose(pose.p, filter_.p + filter_.R @ camera()[:3, 3], atol=1e-15)
    step = 1e-6
    J = np.zeros((6, IMU))
    for k, d in enumerate(step * np.eye(IMU)):
        R, p = filter_.R @ exp_so3(d[:3]), filter_.p + d[3:6]
        R_ic, p_ic = camera()[:3, :3] @ exp_so3(d[15:18]), camera()[:3, 3] + d[18:21]
        turned = pose.R.T @ R @ R_ic
        J[:3, k] = np.array([turned[2, 1], turned[0, 2], turned[1, 0]]) / step
        J[3:, k] = (p + R @ p_ic - pose.p) / step
    np.testing.assert_allclose(filter_.P[IMU:, IMU:], J @ before @ J.T, atol=1e-6)
    np.testing.assert_allclose(filter_.P[IMU:, :IMU], J @ before, atol=1e-6)
    filter_.leave([7])
    np.testing.assert_array_equal(filter_.P, before)


def test_an_update_equals_a_factor_graph_of_the_same_rows() -> None:
    """gtsam solves the prior and the rows as one least-squares problem, and knows nothing of Kalman."""
    filter_, dice = a_filter(), np.random.default_rng(3)
    for k in range(2):
        filter_.carry(np.array([0.1, 0.0, 0.3]), np.array([0.1, 0.2, 9.8]), 0.1)
        filter_.enter(k)
    filter_.P += 1e-6 * np.eye(len(filter_.P))  # two poses that entered without noise between: not to be singular
    size, p, v = len(filter_.P), filter_.p.copy(), filter_.v.copy()
    H, r = np.zeros((12, size)), 0.01 * dice.normal(size=12)
    H[:, IMU:] = dice.normal(size=(12, size - IMU))
    graph = gtsam.GaussianFactorGraph()
    whitened = np.linalg.inv(np.linalg.cholesky(filter_.P))
    graph.add(gtsam.JacobianFactor(0, whitened, np.zeros(size), gtsam.noiseModel.Unit.Create(size)))
    graph.add(gtsam.JacobianFactor(0, H, r, gtsam.noiseModel.Isotropic.Sigma(12, FEATURE_NOISE)))
    expected, information = graph.optimize().at(0), graph.hessian()[0]
    filter_._update(H, r)
    np.testing.assert_allclose(np.concatenate([filter_.p - p, filter_.v - v]), expected[3:9], atol=1e-8)
    np.testing.assert_allclose(filter_.P, np.linalg.inv(information), atol=1e-8)


def test_while_the_imu_is_silent_it_goes_straight_on_and_knows_less_and_less() -> None:
    filter_ = a_filter()
    filter_.v = np.array([0.3, 0.0, 0.0])
    deviations = []
    for _ in range(5):
        filter_.coast(0.1)
        deviations.append(np.sqrt(np.diag(filter_.P)[3]))
    np.testing.assert_allclose(filter_.p, [0.15, 0.0, 0.0], atol=1e-12)
    assert (np.diff(deviations) > 0).all()


def test_a_filter_that_gives_up_its_certainty_stays_where_it_is() -> None:
    filter_ = a_filter()
    fresh = MultiStateFilter(filter_._settings, camera(), BASELINE, G, np.zeros(3)).P
    for k in range(3):
        filter_.carry(np.array([0.1, 0.0, 0.3]), np.array([0.1, 0.2, 9.8]), 0.1)
        filter_.enter(k)
    p = filter_.p.copy()
    filter_.reset()
    np.testing.assert_array_equal(filter_.p, p)
    np.testing.assert_array_equal(filter_.P, fresh)
    assert not filter_.window


@pytest.mark.parametrize("constrain", [True, False])
def test_a_landmark_that_contradicts_the_rest_is_not_believed(constrain) -> None:
    filter_ = a_filter(constrain)
    T, landmark = camera(), np.array([4.0, 0.5, 0.3])
    track = Track()
    for k in range(4):
        filter_.carry(np.zeros(3), np.array([0.0, 0.0, 9.81]), 0.05)
        filter_.enter(k)
        track.stamps.append(k)
        track.seen.append(seen_from(filter_.R @ T[:3, :3], filter_.p + filter_.R @ T[:3, 3], landmark, BASELINE))
    wrong = Track(list(track.stamps), [seen + np.array([0.2 * (n % 2), 0.0, 0.0]) for n, seen in enumerate(track.seen)])
    assert filter_.tell([wrong]) == 0
    assert filter_.tell([track]) == 1
    assert filter_.tell([]) == 0
