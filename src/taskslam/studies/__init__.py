"""Many recorded runs compared: open-loop studies."""
