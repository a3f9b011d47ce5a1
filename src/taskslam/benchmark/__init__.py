"""The closed loop and the protocol around it: SLAM steers the robot, and every arrival is recorded."""
