"""Our `karto` as a ROS node would be: scans on /scan, odometry on /odom, poses on /pose, stamped as their scans.

It speaks the ROS whose number it is given first: 1 with our own node, 2 with rclpy.
"""

import os
import shutil
import sys
from pathlib import Path
from queue import SimpleQueue

import numpy as np

if compiled := os.environ.get("KARTO_COMPILED"):  # what numba has compiled before: a copy of its own, to write to
    shutil.copytree(compiled, "compiled-karto", dirs_exist_ok=True)
    os.environ["NUMBA_CACHE_DIR"] = str(Path("compiled-karto").absolute())

from taskslam.datasets import ros_decoding
from taskslam.datasets.quaternions import planar_quaternion
from taskslam.geometry import SE2
from taskslam.robot import load_robot
from taskslam.slam.methods.karto import Karto

ODOMETRY, SCAN = "nav_msgs/msg/Odometry", "sensor_msgs/msg/LaserScan"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"


def serve(types, inbox, publish):
    """inbox: of types and messages; types: the messages' classes; publish: told the poses."""
    rig, karto = load_robot("turtlebot2").rig, Karto()
    karto.start(rig)
    new = {kind.rpartition("/")[2]: made for kind, made in types.items()}
    odometry_until, waiting = -1, []
    while True:
        kind, message = inbox.get()
        if kind == ODOMETRY:
            karto.feed(ros_decoding.odometry(message, None))
            odometry_until = ros_decoding.stamp_of(message)
        else:
            waiting.append((message.header, ros_decoding.laser_scan(message, rig.lidar_2d)))
        while waiting and odometry_until >= waiting[0][1].stamp:  # two topics, two sockets: in any order
            header, scan = waiting.pop(0)
            estimate = karto.feed(scan)
            at = SE2.from_matrix(estimate.T_start_base)
            z, w = planar_quaternion(at.theta)
            covariance = np.zeros((6, 6))
            if estimate.covariance is not None:
                covariance[np.ix_([0, 1, 5], [0, 1, 5])] = estimate.covariance
            inner = new["Pose"](
                position=new["Point"](x=at.x, y=at.y, z=0.0),
                orientation=new["Quaternion"](x=0.0, y=0.0, z=z, w=w),
            )
            header.frame_id = "map"
            publish(
                new["PoseWithCovarianceStamped"](
                    header=header, pose=new["PoseWithCovariance"](pose=inner, covariance=covariance.ravel())
                )
            )


def ros1():
    from taskslam.ros.ros1.node import Node, short

    named = dict(word.split(":=") for word in sys.argv[1:] if ":=" in word)
    node, inbox = Node("/" + named["__name"], os.environ["ROS_MASTER_URI"]), SimpleQueue()
    pose = node.advertise("/pose", short(POSE))

    def hear(topic, kind):
        node.subscribe(topic, short(kind), lambda _, data: inbox.put((kind, node.decode(short(kind), data))))

    hear("/odom", ODOMETRY)
    hear("/scan", SCAN)
    serve(node.store.types, inbox, pose.publish)


def ros2():
    import threading

    import rclpy
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import Odometry
    from rosbags.typesys import Stores
    from sensor_msgs.msg import LaserScan

    from taskslam.datasets.bag_access import ros_types

    rclpy.init(args=sys.argv)
    node, inbox, store = rclpy.create_node("karto"), SimpleQueue(), ros_types(Stores.ROS2_KILTED)
    pose = node.create_publisher(PoseWithCovarianceStamped, "/pose", 100)

    def hear(topic, made, kind):
        def take(data):
            inbox.put((kind, store.deserialize_cdr(data, kind)))

        node.create_subscription(made, topic, take, 1000, raw=True)

    hear("/odom", Odometry, ODOMETRY)
    hear("/scan", LaserScan, SCAN)
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    serve(store.types, inbox, lambda message: pose.publish(bytes(store.serialize_cdr(message, POSE))))


if __name__ == "__main__":
    {"1": ros1, "2": ros2}[sys.argv[1]]()
