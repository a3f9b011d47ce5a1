"""Advances simulated time and yields measurements in stamp order."""
