"""What the ORB-SLAM3 adapter needs besides the package: a vocabulary, a settings file, and which map it is in."""
