import math

import numpy as np

from taskslam.geometry import wrap_angle
from taskslam.navigation.velocity_smoother import Velocity


class PurePursuit:
    def __init__(self, robot):
        self.fastest = robot.drive.max_linear / 2

    def reset(self):
        """Nothing is remembered from one command to the next."""

    def command(self, request):
        pose, goal = request.pose, request.goal
        if pose.distance_to(goal) < 0.15:
            return Velocity(0.0, wrap_angle(goal.theta - pose.theta))
        if request.costmap.cost_at(pose.x, pose.y) >= 253:  # the robot would touch something
            return None
        distance = np.hypot(*(request.path - (pose.x, pose.y)).T)
        ahead = request.path[(np.arange(len(distance)) >= distance.argmin()) & (distance > 0.3)]
        x, y = ahead[0] if len(ahead) else (goal.x, goal.y)
        bearing = wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.theta)
        return Velocity(self.fastest * max(0.0, math.cos(2 * bearing)) if abs(bearing) < 0.8 else 0.0, 1.5 * bearing)
