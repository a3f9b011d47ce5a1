"""Reading and writing recordings and trajectories in the forms that the field uses."""
