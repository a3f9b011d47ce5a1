"""ROS 2, spoken by a process of the user's interpreter: whatever distribution that has, and none of it in ours."""
