"""The closed loop and the protocol around it."""
