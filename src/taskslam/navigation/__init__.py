"""One fixed navigation stack for every SLAM method (protocol section 3)."""
