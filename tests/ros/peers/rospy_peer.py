"""A node of Debian's rospy: repeats scans with their ranges doubled, offers services, reads parameters of all types."""

import json

import rospy
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyResponse, Trigger

rospy.init_node("rospy_peer")
doubled = rospy.Publisher("/doubled", LaserScan, queue_size=100)


def take(scan):
    scan.ranges = [2 * reading for reading in scan.ranges]
    doubled.publish(scan)


def fail(request):
    raise ValueError("no map yet")


rospy.Subscriber("/scan", LaserScan, take, queue_size=1000)
rospy.Service("/reset", Empty, lambda request: EmptyResponse())
rospy.Service("/fails", Trigger, fail)
rospy.set_param("~seen", 1.5)
keys = ("whole", "part", "words", "truth", "list", "folder/below")
values = {key: rospy.get_param(f"~{key}", None) for key in keys}
print(
    json.dumps(values | {"absent": rospy.has_param("~absent"), "found": rospy.search_param("use_sim_time")}), flush=True
)
rospy.spin()
