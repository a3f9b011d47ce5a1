"""Drives 2 s of simulated time at 0.2 m/s as a rospy node does, at 10 Hz; prints what odometry and scans say."""

import json

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

rospy.init_node("driver")
rospy.wait_for_message("/clock", Clock, 60)
rospy.set_param("/use_sim_time", True)
at, rays = [], []
rospy.Subscriber("/odom", Odometry, lambda message: at.append(message.pose.pose.position.x))
rospy.Subscriber("/scan", LaserScan, lambda message: rays.append(len(message.ranges)))
publisher = rospy.Publisher("/cmd_vel", Twist, queue_size=10)
now = []
rospy.Subscriber("/clock", Clock, lambda message: now.append(message.clock.to_sec()))
while not (at and rays and now and publisher.get_num_connections()):
    rospy.rostime.wallsleep(0.01)
speed, commands = Twist(), 0
speed.linear.x = 0.2
began = following = now[-1]
while now[-1] < began + 2.0:
    if now[-1] >= following:
        publisher.publish(speed)
        commands += 1
        following += 0.1
    rospy.rostime.wallsleep(0.001)
publisher.publish(Twist())
until = now[-1] + 2.0
while now[-1] < until:
    rospy.rostime.wallsleep(0.01)
print(json.dumps({"distance": at[-1] - at[0], "commands": commands, "rays": rays[-1]}), flush=True)
