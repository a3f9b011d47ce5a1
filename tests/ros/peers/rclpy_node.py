"""A ROS 2 node for the tests: answers every scan with the odometry of its stamp, and has faults from a frame on.

Parameters: fault, after (frames before it), rate (a double), whole (an int), late (offers /pose with its first frame).
"""

import contextlib
import os
import sys
import time

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty


class Echo(Node):
    def __init__(self):
        super().__init__("some_name")
        defaults = {"fault": "", "after": 0, "rate": 10.0, "whole": 1, "late": False, "odom_frame": "odom"}
        self.told = {name: self.declare_parameter(name, value).value for name, value in defaults.items()}
        self.seen, self.resets, self.waiting, self.odometry, self.pose = 0, 0, [], {}, None
        self.create_subscription(Odometry, "/odom", self.hear_odometry, 1000)
        reliability = ReliabilityPolicy[os.environ.get("READS", "reliable").upper()]
        self.create_subscription(LaserScan, "/scan", self.hear_scan, QoSProfile(depth=10, reliability=reliability))
        self.create_service(Empty, "/reset", self.reset)
        if not self.told["late"]:
            self.offer()
        print("whole", self.told["whole"], "rate", self.told["rate"], flush=True)

    def offer(self):
        reliability = ReliabilityPolicy[os.environ.get("SAYS", "reliable").upper()]
        quality = QoSProfile(depth=10, reliability=reliability)
        self.pose = self.create_publisher(PoseWithCovarianceStamped, "/pose", quality)

    def reset(self, request, response):
        self.resets += 1
        print("resets", self.resets, flush=True)
        return response

    def hear_odometry(self, message):
        self.odometry[message.header.stamp.sec, message.header.stamp.nanosec] = message
        self.answer()

    def hear_scan(self, message):
        self.waiting.append(message.header)
        self.answer()

    def answer(self):
        while self.waiting:
            header = self.waiting[0]
            if (header.stamp.sec, header.stamp.nanosec) not in self.odometry:
                return
            self.waiting.pop(0)
            self.say(header, self.odometry[header.stamp.sec, header.stamp.nanosec])

    def say(self, header, odometry):
        self.seen += 1
        if self.pose is None:
            self.offer()
            return
        fault = self.told["fault"] if self.seen > self.told["after"] else ""
        if fault == "dies":
            print("the map has no cells", flush=True)
            os.abort()
        if fault == "hangs":
            time.sleep(3600)
        if fault == "silent":
            return
        if fault == "warns":
            self.get_logger().warning("the frame base_linc does not exist")
        if fault == "works":
            until = time.process_time() + 0.02
            while time.process_time() < until:
                pass
        answer = PoseWithCovarianceStamped()
        answer.header.stamp = header.stamp
        answer.header.frame_id = "world" if fault == "wrong_frame" else "map"
        answer.pose.pose = odometry.pose.pose
        if fault == "back":
            answer.header.stamp.sec -= 1
        if fault == "nan":
            answer.pose.pose.position.x = float("nan")
        self.pose.publish(answer)


rclpy.init(args=sys.argv)
with contextlib.suppress(KeyboardInterrupt):
    rclpy.spin(Echo())
