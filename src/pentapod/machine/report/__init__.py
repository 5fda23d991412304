"""The report on a machine: its work volume sampled, the worst poses, and its text."""
