"""SLAM methods that do what guests should not. Each behaves until the scan stamped 0.3 s."""

import os
import signal
import sys
import time

import numpy as np

from taskslam.errors import RecordError
from taskslam.measurements import Sensor
from taskslam.slam import Kind, MethodCard, PoseEstimate, SlamMethod, Status

BAD_STAMP = 300_000_000


class Guest(SlamMethod):
    card = MethodCard("guest", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY), latency=0.05)

    def start(self, rig):
        self.T = np.eye(4)

    def feed(self, measurement):
        if measurement.sensor is not Sensor.LASER_SCAN:
            return None
        if measurement.stamp >= BAD_STAMP:
            return self.misbehave(measurement.stamp)
        return self.estimate(measurement.stamp)

    def estimate(self, stamp, T=None):
        return PoseEstimate(stamp, self.T if T is None else T, Status.TRACKING)

    def misbehave(self, stamp):
        return self.estimate(stamp)


class SaysThatItStarts(Guest):
    def start(self, rig):
        super().start(rig)
        print("started")


class Segfault(Guest):
    def misbehave(self, stamp):
        os.kill(os.getpid(), signal.SIGSEGV)


class AbortsWithAReason(Guest):
    def misbehave(self, stamp):
        os.write(2, b"omega is not finite\n")
        os.abort()


class ReadsNull(Guest):
    def misbehave(self, stamp):
        import ctypes

        ctypes.string_at(0)


class Exits(Guest):
    def misbehave(self, stamp):
        os._exit(3)


class ExitsPolitely(Guest):
    def misbehave(self, stamp):
        sys.exit(4)


class Hangs(Guest):
    def misbehave(self, stamp):
        while True:
            time.sleep(1)


class HangsUnkillable(Hangs):
    def start(self, rig):
        super().start(rig)
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)


class PrintsWithoutEnd(Guest):
    def misbehave(self, stamp):
        while True:
            os.write(1, b"spam " * 4096)


class PrintsMuchButWorks(Guest):
    def misbehave(self, stamp):
        os.write(1, b"x" * 400_000)
        return self.estimate(stamp)


class Raises(Guest):
    def misbehave(self, stamp):
        raise ValueError("first line\nscan does not match")


class EatsMemory(Guest):
    def misbehave(self, stamp):
        hoard = []
        while True:
            hoard.append(np.ones(1 << 20))


class NotFinite(Guest):
    def misbehave(self, stamp):
        T = np.eye(4)
        T[0, 3] = np.nan
        return self.estimate(stamp, T)


class NotRigid(Guest):
    def misbehave(self, stamp):
        return self.estimate(stamp, np.diag([2.0, 1, 1, 1]))


class WrongShape(Guest):
    def misbehave(self, stamp):
        return self.estimate(stamp, np.eye(3))


class HugeReply(Guest):
    def misbehave(self, stamp):
        return self.estimate(stamp, np.zeros((3000, 3000)))


class WrongType(Guest):
    def misbehave(self, stamp):
        return "here"


class BackInTime(Guest):
    def misbehave(self, stamp):
        return self.estimate(100_000_000)


class Prophet(Guest):
    def misbehave(self, stamp):
        return self.estimate(stamp + 1)


class BadCovariance(Guest):
    def misbehave(self, stamp):
        return PoseEstimate(stamp, self.T, Status.TRACKING, np.full((3, 3), np.inf))


class ScribblesIntoPipes(Guest):
    def misbehave(self, stamp):
        for descriptor in range(3, 64):
            try:
                os.write(descriptor, b"garbage" * 8)
            except OSError:
                continue
        return self.estimate(stamp)


class ClosesEverything(Guest):
    def misbehave(self, stamp):
        os.closerange(0, 64)
        time.sleep(60)


class LeavesProcessBehind(Guest):
    def misbehave(self, stamp):
        if os.fork() == 0:
            time.sleep(60)
        os._exit(5)


class NeverStops(Guest):
    def stop(self):
        time.sleep(60)


class StopsSlowly(Guest):
    def stop(self):
        time.sleep(4)


class FailsToStart(Guest):
    def start(self, rig):
        raise RuntimeError("no licence file")


class HangsAtStart(Guest):
    def start(self, rig):
        time.sleep(60)


class NeedsAbsentPackage(Guest):
    def start(self, rig):
        import a_package_that_nobody_has  # noqa: F401


class TakesOptions(Guest):
    def __init__(self, resolution: float = 0.05, passes: int = 2) -> None:
        if resolution <= 0:
            raise ValueError("resolution must be positive")


class WantsTheTruth(Guest):
    card = MethodCard("cheat", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN, Sensor.TRUE_POSE))


class Timeless(Guest):
    card = MethodCard("timeless", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), latency=float("nan"))


class WantsCameras(Guest):
    card = MethodCard("camera", "1", "MIT", Kind.SLAM, (Sensor.STEREO_IMAGES,))


class Mapper(Guest):
    """Counts scans; its map is the count."""

    card = MethodCard("mapper", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), can_save_map=True)
    scans = 0

    def feed(self, measurement):
        self.scans += 1
        return self.estimate(measurement.stamp)

    def save_map(self, path):
        path.write_text(str(self.scans), encoding="ascii")

    def load_map(self, path):
        self.scans = int(path.read_text(encoding="ascii"))


class PickyMapper(Mapper):
    def load_map(self, path):
        raise RecordError(f"{path.name}: not a map")


class SavesNothing(Mapper):
    def save_map(self, path):
        return


class NotAMethod:
    pass


class Unfinished(SlamMethod):
    def start(self, rig):
        return

    def feed(self, measurement):
        return None
