"""The time law of one piece of the path, and of the setpoints that are sampled from it."""
