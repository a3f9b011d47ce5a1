"""The figures of the paper: vector or PNG files at the size at which they are printed (docs/figures.md)."""
