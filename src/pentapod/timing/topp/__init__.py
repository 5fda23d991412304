"""Time-optimal path parametrisation (TOPP-RA): the two passes, compiled, and the reference."""
