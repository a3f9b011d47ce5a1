"""ROS is a neighbour, not a foundation: somebody's SLAM node in our loop, in lockstep, without a ROS of ours."""
