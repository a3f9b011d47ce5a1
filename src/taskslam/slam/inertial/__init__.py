"""What an IMU says of a motion: rotations, propagation of a state and of its covariance, and the still start."""
