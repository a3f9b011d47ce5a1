"""Guests with a thread of their own."""

import hashlib
import threading

import numpy as np

from taskslam.measurements import Sensor
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status


class Crunches(SlamMethod):
    """Says how much its thread has done since the frame before. works: False if it has none."""

    card = MethodCard(
        "crunches", "1", "MIT", Kind.ODOMETRY, (Sensor.LASER_SCAN,), asynchronous=True, deterministic=False
    )

    def __init__(self, works=True):
        self.works = works
        self.done = self.told = 0

    def start(self, rig):
        if self.works:
            threading.Thread(target=self.crunch, daemon=True).start()

    def crunch(self):
        block = bytes(1 << 14)
        while True:
            hashlib.sha256(block).digest()  # without the interpreter's lock
            self.done += 1

    def feed(self, measurement):
        T = np.eye(4)
        T[0, 3], self.told = self.done - self.told, self.done
        return PoseEstimate(measurement.stamp, T, Status.TRACKING)
