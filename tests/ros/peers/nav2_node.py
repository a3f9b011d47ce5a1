"""A small Nav2 for the tests: an action server NavigateToPose that turns, drives straight to the goal, and turns.

Its localisation is odometry, which it says as map -> odom on /tf. `--fault`: abort (code 208), reject, hang (never
moves), nan (a transform that is none besides), wrong (another frame than map). It prints what it does, a word a line.
"""

import argparse
import contextlib
import math
import threading

import rclpy
from geometry_msgs.msg import TransformStamped, Twist
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from tf2_msgs.msg import TFMessage

NEAR, SPEED, TURN = 0.02, 0.3, 0.8


def wrapped(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


def heading(q):
    return 2 * math.atan2(q.z, q.w)


class SmallNav2(Node):
    def __init__(self, fault):
        super().__init__("small_nav2")
        self.fault, self.goal, self.arrived, self.at = fault, None, threading.Event(), None
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.transforms = self.create_publisher(TFMessage, "/tf", 100)
        self.create_subscription(Odometry, "/odom", self.hear, 100)
        self.server = ActionServer(
            self, NavigateToPose, "/navigate_to_pose", self.drive, goal_callback=self.take,
            cancel_callback=lambda _: CancelResponse.ACCEPT, callback_group=ReentrantCallbackGroup(),
        )  # fmt: skip

    def take(self, request):
        return GoalResponse.REJECT if self.fault == "reject" else GoalResponse.ACCEPT

    def hear(self, odometry):
        pose = odometry.pose.pose
        self.at = (pose.position.x, pose.position.y, heading(pose.orientation))
        self.localise(odometry.header.stamp)
        if self.goal is None:
            return
        if self.fault != "hang":
            linear, angular = self.command(*self.at, *self.goal)
            self.commands.publish(twist(linear, angular))

    def localise(self, stamp):
        said = TransformStamped()
        said.header.stamp, said.child_frame_id = stamp, "odom"
        said.header.frame_id = "world" if self.fault == "wrong" else "map"
        both = [said]
        if self.fault == "nan":
            broken = TransformStamped()
            broken.header.frame_id, broken.child_frame_id = "odom", "arm"
            broken.transform.translation.x = math.nan
            both.append(broken)
        self.transforms.publish(TFMessage(transforms=both))

    def command(self, x, y, theta, to_x, to_y, to_theta):
        away, bearing = math.hypot(to_x - x, to_y - y), wrapped(math.atan2(to_y - y, to_x - x) - theta)
        if away > NEAR and abs(bearing) > 0.1:
            return 0.0, math.copysign(TURN, bearing)
        if away > NEAR:
            return min(SPEED, 0.05 + away), bearing
        off = wrapped(to_theta - theta)
        if abs(off) > 0.05:
            return 0.0, math.copysign(min(TURN, 0.1 + abs(off)), off)
        self.arrived.set()
        return 0.0, 0.0

    def drive(self, handle):
        pose, result = handle.request.pose, NavigateToPose.Result()
        print("driving", flush=True)
        if self.fault == "abort":
            result.error_code, result.error_msg = 208, "no way there"
            handle.abort()
            return result
        assert pose.header.frame_id == "map"
        self.arrived.clear()
        self.goal = (pose.pose.position.x, pose.pose.position.y, heading(pose.pose.orientation))
        while not self.arrived.wait(0.02) and not handle.is_cancel_requested:
            pass
        self.goal = None
        self.commands.publish(twist(0.0, 0.0))
        if handle.is_cancel_requested:
            handle.canceled()
            print("canceled", flush=True)
        else:
            handle.succeed()
            print("arrived", flush=True)
        return result


def twist(linear, angular):
    said = Twist()
    said.linear.x, said.angular.z = linear, angular
    return said


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--fault", default="")
    rclpy.init()
    node, executor = SmallNav2(parser.parse_args().fault), MultiThreadedExecutor(4)
    executor.add_node(node)
    print("ready", flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()
    node.destroy_node()


main()
