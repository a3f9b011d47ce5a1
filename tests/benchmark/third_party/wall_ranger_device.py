import numpy as np
from wall_ranger import WallDistance

from taskslam.simulation.streams import stream


class Device:
    sensor = WallDistance.sensor

    def __init__(self, part, surroundings):
        self.part, self.rate = part, part.rate
        self.surroundings = surroundings

    def reset(self, count):
        self.noise = stream(self.surroundings.seed, "wall_distance/noise", count)

    def measure(self, stamp, motion):
        x, y, theta = motion.pose_at([stamp])[0]
        origin = np.array([[x, y, self.part.height]], np.float32)
        ahead = np.array([[np.cos(theta), np.sin(theta), 0.0]], np.float32)
        true = float(self.surroundings.rays.distances(origin, ahead)[0])
        reading = true + self.part.noise * self.noise.standard_normal()
        return WallDistance(stamp, reading if true <= self.part.range_max else float("inf"))
