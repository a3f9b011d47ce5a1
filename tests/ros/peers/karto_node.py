"""Our `karto` as a ROS 1 node would be: scans on /scan, odometry on /odom, poses on /pose, stamped as their scans."""

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
from taskslam.ros.ros1.node import Node
from taskslam.slam.methods.karto import Karto


def main(master: str, name: str) -> None:
    node, rig = Node(name, master), load_robot("turtlebot2").rig
    inbox: SimpleQueue = SimpleQueue()
    pose = node.advertise("/pose", "geometry_msgs/PoseWithCovarianceStamped")
    karto = Karto()
    karto.start(rig)
    node.subscribe("/odom", "nav_msgs/Odometry", lambda _, data: inbox.put(("nav_msgs/Odometry", data)))
    node.subscribe("/scan", "sensor_msgs/LaserScan", lambda _, data: inbox.put(("sensor_msgs/LaserScan", data)))
    new = {kind.rpartition("/")[2]: made for kind, made in node.store.types.items()}
    odometry_until, waiting = -1, []
    while True:
        kind, data = inbox.get()
        message = node.decode(kind, data)
        if kind == "nav_msgs/Odometry":
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
            pose.publish(
                new["PoseWithCovarianceStamped"](
                    header=header, pose=new["PoseWithCovariance"](pose=inner, covariance=covariance.ravel())
                )
            )


if __name__ == "__main__":
    named = dict(word.split(":=") for word in sys.argv[1:] if ":=" in word)
    main(os.environ["ROS_MASTER_URI"], "/" + named["__name"])
