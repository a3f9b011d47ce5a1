"""What is to be driven: world, start, waypoints, robot, protocol."""
