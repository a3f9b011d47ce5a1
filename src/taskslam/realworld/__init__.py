"""Measuring a real robot with AprilTags: tags, cameras, poses at waypoints."""
