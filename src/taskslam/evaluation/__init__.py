"""Pure functions from records and arrays to metrics."""
