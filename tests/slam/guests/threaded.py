"""Guests with a thread of their own."""

import hashlib
import threading
import time

import numpy as np

from taskslam.measurements import Sensor
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status


class Crunches(SlamMethod):
    """Says how much its thread has done since the frame before. naps: seconds that the thread sleeps between works."""

    card = MethodCard(
        "crunches", "1", "MIT", Kind.ODOMETRY, (Sensor.LASER_SCAN,), asynchronous=True, deterministic=False
    )

    def __init__(self, naps=0.0, works=True):
        self.naps, self.works = naps, works
        self.done = self.told = 0

    def start(self, rig):
        threading.Thread(target=self.crunch, daemon=True).start()

    def crunch(self):
        block = bytes(1 << 14)
        while True:
            if self.naps:
                time.sleep(self.naps)
            if self.works:
                hashlib.sha256(block).digest()  # without the interpreter's lock
                self.done += 1

    def feed(self, measurement):
        T = np.eye(4)
        T[0, 3], self.told = self.done - self.told, self.done
        return PoseEstimate(measurement.stamp, T, Status.TRACKING)
