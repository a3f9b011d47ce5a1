"""Topics of a robot beside those of its sensors: our served simulator has them, a real robot is asked for them."""

from __future__ import annotations

CLOCK, TF, TF_STATIC, MAP_TOPIC = "/clock", "/tf", "/tf_static", "/map"
COMMAND = "/cmd_vel"
BUMPER = "/bumper"
"""std_msgs/Bool: whether it is pressed."""
PLACE, PLACED = "/taskslam/place", "/taskslam/placed"
"""geometry_msgs/PoseStamped in `map`: put the robot down there; and that this was done, at which time."""
ALSO = {"/velodyne_points": "/points"}
"""What the served robot says under a second name too: the first is that of bags and of the paper's nodes."""
GO = "/taskslam/go"
"""std_msgs/Bool: a person says, away from the keyboard, that the robot stands at the start."""

KINDS = {
    CLOCK: "rosgraph_msgs/msg/Clock",
    TF: "tf2_msgs/msg/TFMessage",
    TF_STATIC: "tf2_msgs/msg/TFMessage",
    MAP_TOPIC: "nav_msgs/msg/OccupancyGrid",
    COMMAND: "geometry_msgs/msg/Twist",
    BUMPER: "std_msgs/msg/Bool",
    PLACE: "geometry_msgs/msg/PoseStamped",
    PLACED: "geometry_msgs/msg/PoseStamped",
    GO: "std_msgs/msg/Bool",
}
LATCHED = frozenset({TF_STATIC, MAP_TOPIC, BUMPER})
