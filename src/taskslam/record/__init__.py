"""What a run leaves behind: events, journal, run directory, trajectories."""
