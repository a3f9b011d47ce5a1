"""AprilTags: printing, detecting, and where a tag is."""
