"""Engines: where runs are driven."""
