"""A method that does one act of `acts.py` at one place, and behaves otherwise.

Which, its options say; while it is imported there are none, so then the environment says.
"""

import os

import numpy as np
from acts import ACTS

from taskslam.measurements import Sensor
from taskslam.slam import Kind, MethodCard, PoseEstimate, SlamMethod, Status

LATE = 300_000_000  # ns: after three scans it does its act

if os.environ.get("TASKSLAM_METHOD_IMPORT"):
    ACTS[os.environ["TASKSLAM_METHOD_IMPORT"]]()


def pose(x=0.0):
    T = np.eye(4)
    T[0, 3] = x
    return T


STRANGE = {
    "a_pose_of_1e308": lambda stamp: PoseEstimate(stamp, pose(1e308), Status.TRACKING),
    "a_pose_far_away": lambda stamp: PoseEstimate(stamp, pose(-2e6), Status.TRACKING),
    "a_pose_that_is_no_number": lambda stamp: PoseEstimate(stamp, pose(np.nan), Status.TRACKING),
    "a_pose_of_text": lambda stamp: PoseEstimate(stamp, "here", Status.TRACKING),
    "a_pose_of_70_dimensions": lambda stamp: PoseEstimate(stamp, np.zeros((1,) * 32), Status.TRACKING),
    "a_singular_pose": lambda stamp: PoseEstimate(stamp, np.zeros((4, 4)), Status.TRACKING),
    "a_mirrored_pose": lambda stamp: PoseEstimate(stamp, np.diag([-1.0, 1, 1, 1]), Status.TRACKING),
    "a_complex_pose": lambda stamp: PoseEstimate(stamp, np.eye(4) * 1j, Status.TRACKING),
    "a_boundless_covariance": lambda stamp: PoseEstimate(stamp, pose(), Status.TRACKING, np.full((3, 3), 1e300)),
    "a_stamp_of_the_future": lambda stamp: PoseEstimate(stamp + 10**15, pose(), Status.TRACKING),
    "a_stamp_of_the_past": lambda stamp: PoseEstimate(-(10**18), pose(), Status.TRACKING),
    "a_stamp_beyond_64_bits": lambda stamp: PoseEstimate(10**40, pose(), Status.TRACKING),
    "a_stamp_of_text": lambda stamp: PoseEstimate("now", pose(), Status.TRACKING),
    "a_status_of_its_own": lambda stamp: PoseEstimate(stamp, pose(), "fine"),
    "a_tuple": lambda stamp: (stamp, pose(), 1),
    "true": lambda stamp: True,
}


class Adversary(SlamMethod):
    card = MethodCard("adversary", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY))

    def __init__(self, act: str = "", place: str = "feed") -> None:
        self.act, self.place = act, place
        self.do("construct")

    def do(self, place):
        if place == self.place and self.act in ACTS:
            ACTS[self.act]()

    def start(self, rig):
        self.last = None
        self.do("start")

    def feed(self, measurement):
        if measurement.sensor is Sensor.WHEEL_ODOMETRY:
            first = self.last or (measurement.T_odom_base, None)
            self.last = (first[0], (first[0].inverse() @ measurement.T_odom_base).matrix())
            return None
        if measurement.stamp >= LATE:
            self.do("feed")
            if self.act in STRANGE:
                return STRANGE[self.act](measurement.stamp)
        if self.last is None:
            return None
        return PoseEstimate(measurement.stamp, self.last[1], Status.TRACKING)

    def stop(self):
        self.do("stop")


class Changing(Adversary):
    """Its card at the start is not the one that described it."""

    def __init__(self) -> None:
        super().__init__()
        self.card = MethodCard("adversary", "2", "MIT", Kind.REFERENCE, (Sensor.TRUE_POSE,))


class Patient(Adversary):
    card = MethodCard("patient", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), needs_still_start=1e15)


class Wordy(Adversary):
    card = MethodCard("wordy", "1" * 10**5, "MIT", Kind.SLAM, (Sensor.LASER_SCAN,))


class Truthful(Adversary):
    card = MethodCard("truthful", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN, Sensor.TRUE_POSE))


class Queueing(Adversary):
    card = MethodCard("queueing", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), queue=10**12)


class Mistyped(Adversary):
    card = MethodCard("mistyped", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), deterministic="perhaps", latency="soon")
